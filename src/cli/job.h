/* job.h: what one run of `twinmesh mesh` is to do: the options, checked and turned into settings. */
#pragma once
#include "cli/console.h"
#include "cli/options.h"
#include "cli/turn.h"
#include "io/gltf.h"
#include "io/volume.h"
#include "report/report.h"
#include "scene/scene.h"
#include "sequence/pattern.h"
#include "track/track.h"

enum { FORMAT_PLY = 1, FORMAT_GLB = 2, FORMAT_GLTF = 4, FORMAT_VAT = 8 }; /* bits, as options.def lists them */
enum { FORMATS_CARRIED = FORMAT_GLB | FORMAT_GLTF | FORMAT_VAT }; /* their runs go on to where the next one begins */
enum { ATTRIBUTES_MAX = 32 };
typedef enum OnError { ON_ERROR_STOP, ON_ERROR_SKIP, ON_ERROR_HOLD } OnError;
typedef enum VelocityUnits { VELOCITY_BY_GRID = -1, VELOCITY_WORLD, VELOCITY_VOXEL, VELOCITY_MANTAFLOW } VelocityUnits;

/* Fields that another command makes, instead of files or a scene. `next` is called for one frame after the other, by the
 * thread that reads ahead. */
typedef struct FieldSource {
    bool (*open)(void *maker, Sequence *out, Err *err);
    bool (*next)(void *maker, const Frame *frame, Field *out, Err *err); /* NULL: there is no such source */
    void *maker;
} FieldSource;

/* Texts are borrowed from argv. */
typedef struct MeshJob {
    const char *prefix;
    unsigned formats;
    bool gltf_step, print;
    GltfCompress compress;
    const char *render;         /* PATTERN of pictures; NULL: none */
    int nrender_option;
    char **render_option;       /* [nrender_option] borrowed: what render is told of them */
    bool resume, keep_state, follow;
    bool is_chunk;              /* a part of a sequence (farm): its frames go to one file (chunk.h); never by options of mesh */
    int place, nplace;          /* of its frames in the sequence */
    uint64_t max_memory;        /* bytes; 0: no limit */
    const char *start_from;     /* NULL: anew */
    Turn turn;                  /* of what is written */
    const char *frames;         /* A-B[xS]; NULL: all */
    FieldSource source;
    bool has_scene;             /* the frames are a scene's */
    Scene scene;
    bool trilinear;             /* its vertices land on the samples' surface */
    OnError on_error;
    VolumeRequest request;
    char attribute_text[1000];  /* cut into names, which request.attribute points to: a job stays where it was made */
    const char *attribute[ATTRIBUTES_MAX];
    double iso;                 /* NaN: by the grid */
    int inside;                 /* 1 above, -1 below, 0 by the grid */
    bool open_border;
    VelocityUnits velocity_units;
    TrackSettings track;
    int threads;
    Loudness loudness;
    bool json_log;
} MeshJob;

/* *job is not to be moved afterwards. */
bool job_make(MeshJob *job, const Options *o, Err *err);
/* Loads the scene where one is named as the frames, with its frame rate where no other is given. job_free in any case. */
bool job_load_scene(MeshJob *job, Options *o, Err *err);
/* What the frames' numbers rise by: of 10, 12, 14: 2. Played at a half of the frame rate they keep their pace, without gaps.
 * Of names on standard input nothing is known yet: 1. */
bool job_find_step(const MeshJob *job, const Options *o, int64_t *step, Err *err);
/* The frames: of the scene, or those that the operands name. */
bool job_open_sequence(const MeshJob *job, const Options *o, Sequence *out, Err *err);
/* Frame intervals from one number to the next; 1 where there is none before (NONE). Names on standard input need not come in order. */
int job_intervals(int64_t from, int64_t to, int64_t step);
void job_free(MeshJob *job);

/* The settings as the report's first line has them. */
void job_echo(const Options *o, const char *version, FILE *report);
