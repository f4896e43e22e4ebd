/* reader.h: reads one frame ahead: while a frame is solved, a thread of its own reads the next file and builds its
 * field. parallel_for belongs to the solve: what that thread calls runs on it alone. */
#pragma once
#include "base/digest.h"
#include "cli/job.h"
#include "field/field.h"
#include "sequence/pattern.h"

/* How the surface was chosen, once for all frames: by the first that holds anything. */
typedef struct Surface {
    bool chosen;
    FieldSpec spec;
} Surface;

/* The surface's samples in the last frame that could be read. */
typedef struct LastSamples {
    bool known;
    Digest128 digest;
} LastSamples;

typedef struct ReadFrame {
    SequenceStep step;         /* ..._FRAME: there is one; ..._ERROR: err says why the sequence cannot go on */
    Frame frame;
    bool good;                 /* it could be read; else err says why not */
    Err err;
    bool same;                 /* its samples are those of the last frame that could be read: `field` is not built, that one's serves */
    Field field;
    bool lent;                 /* the next frame has the field too, and frees it */
    SceneFrame *scene;         /* what the field is of, or NULL; goes with it */
    bool has_velocity;
    Grid velocity;             /* world units a second */
    VelocityUnits units;       /* it came in */
    int nattribute;
    Grid *attribute;           /* [nattribute] as the job names them */
    Surface surface;           /* as of this frame */
    char why[300];             /* how it was chosen; "" when that was said before */
    uint64_t digest;           /* of the file; 0: not to be read */
    double seconds;
} ReadFrame;

typedef struct Reader Reader;

/* `job` and `sequence` stay the caller's, who leaves them alone until reader_close. `surface`: as of the last frame read, or
 * zero. NULL when no thread can be had. */
Reader *reader_open(const MeshJob *job, Sequence *sequence, Surface surface, Err *err);
/* Waits for the next frame. False when a signal came instead. The caller frees the frame. */
bool reader_take(Reader *r, ReadFrame *out);
void reader_close(Reader *r);
/* Reads f->frame, at once, f being zero otherwise. `last` is brought up to date; NULL: f->field is wanted in any case. */
void readframe_read(const MeshJob *job, Surface surface, LastSamples *last, ReadFrame *f);
/* Gives f, whose samples are the same, the field of the frame before it. */
void readframe_borrow(ReadFrame *f, ReadFrame *before);
void readframe_free(ReadFrame *f);
