/* fields.h: the frames of volumes, or of a scene, as fields one after the other, for commands that look at each in turn.
 * The surface is chosen as twinmesh mesh does: once, by the first frame that holds anything. */
#pragma once
#include "cli/options.h"
#include "field/field.h"
#include "io/volume.h"
#include "scene/scene.h"
#include "sequence/pattern.h"

typedef struct Fields {
    Sequence sequence;
    bool has_scene;
    Scene scene;
    bool trilinear;          /* of a scene, the samples' surface */
    VolumeRequest request;
    double iso;              /* as volume_options.h gives them */
    int inside;
    bool chosen;
    FieldSpec spec;
} Fields;

typedef struct FieldFrame {
    Frame frame;
    Field field;
    SceneFrame *scene;       /* what the field is of, or NULL */
    char surface[300];       /* how the surface was chosen; "" when that was said before */
} FieldFrame;

/* The operands and the options `frames`, `projection`, and those of volume_options.h. Texts are borrowed from the options.
 * fields_close in any case. */
bool fields_open(Fields *f, const Options *o, Err *err);
void fields_close(Fields *f);

/* The next frame's name and number; fields_read makes its field, which fieldframe_free gives back. */
SequenceStep fields_next(Fields *f, FieldFrame *out, Err *err);
bool fields_read(Fields *f, FieldFrame *frame, Err *err);
void fieldframe_free(FieldFrame *frame);
