/* outputs.h: the files of a run: meshes as PLY, glTF and textures, report, events and timings, and PREFIX.state.
 *
 * All of them are begun before the first frame is read, so that a folder that cannot be written shows at once. None
 * bears its final name before it is whole: PLYs after their frame, textures after their run of frames, the others, which grow
 * as PATH.part, when all ends, early or not. After a frame what was written is synced and PREFIX.state replaced (state.h), so that
 * a run killed at any instant can be gone on with: the parts are cut off to the lengths the state holds. That takes no more than a
 * twenty-fifth of the time: where frames come faster not all have a state. */
#pragma once
#include "cli/pictures.h"
#include "io/file.h"
#include "io/gltf.h"
#include "io/vat.h"

enum { KIND_MECHANICAL, KIND_GEOMETRIC, KIND_COUNT };
enum { GLTF_FILE_COUNT = 2 };                              /* .glb, .gltf */
/* What grows: three .jsonl, or for a chunk alone what chunk.h describes. */
enum { LINES_REPORT, LINES_EVENTS, LINES_TIMINGS, LINES_CHUNK, LINES_COUNT };

/* A frame as it is handed over to be written. */
typedef struct OutFrame {
    char label[FRAME_DIGITS_MAX + 2]; /* digits of its number */
    FrameFate fate;
    int gap;                          /* frame intervals since the last one shown */
    const TriMesh *mesh;              /* [KIND_COUNT] borrowed; held: the last ones again; NULL: skipped */
    int ncarried[KIND_COUNT];         /* vertices of the last meshes, where their connectivity ends and they are shown moving */
    float *carried[KIND_COUNT][2];    /* [3*ncarried] owned: on to where they are at this frame, and the normals there; else NULL */
    FrameStat stat;                   /* tracked */
    StageSeconds seconds;             /* but for `write` */
    char *surface;                    /* owned: how it was chosen; NULL: as before */
    FrameEvents events;               /* owned; tracked */
    char *since;                      /* owned: the label of the frame tracked before; NULL: there was none */
    Store state;                      /* owned: what the run will need, where outputs_are_due; the outputs' own is put behind it */
} OutFrame;
void outframe_free(OutFrame *f);

typedef struct Outputs {
    const MeshJob *job;                      /* NULL: not open */
    OutFile lines[LINES_COUNT];
    Gltf *gltf[KIND_COUNT][GLTF_FILE_COUNT]; /* NULL: not wanted */
    Vat *vat[KIND_COUNT];                    /* NULL: not wanted */
    Pictures *pictures;                      /* NULL: not wanted */
    ReportTotals totals;
    int nframe;                              /* shown so far; in a chunk, all */
    double due_s;                            /* when the next state is to be written, on console_clock */
    bool kept;                               /* a state of this run is on disk */
    bool left;                               /* closed, and there to be gone on with */
} Outputs;

/* `fps`: frames a second of the glTF. False leaves nothing behind. */
bool outputs_open(Outputs *o, const MeshJob *job, double fps, Err *err);
/* Goes on with what the store says. False leaves all as it was; err is untouched where the store is bad. */
bool outputs_reopen(Outputs *o, const MeshJob *job, double fps, Store *s, Err *err);
/* Whether the next frame is to bring a state. */
bool outputs_are_due(const Outputs *o);
/* Writes a frame in all formats wanted, then the state, if it has one. */
bool outputs_add_frame(Outputs *o, OutFrame *f, Err *err);
/* Gives all files their names; everything is tried, err tells of the first failure. Complete and without failure: parts and
 * state go. Else they stay to be gone on with, beside files of the finished frames that can be played; where nothing was
 * shown nothing is left. `state`: that of the last frame, if it is to be written yet; else NULL. */
bool outputs_close(Outputs *o, bool complete, Store *state, Err *err);
/* Removes what a run that was killed after it gave the last of its files its name may have left. */
bool outputs_sweep(const MeshJob *job, Err *err);
