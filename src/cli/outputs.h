/* outputs.h: the files of a run: meshes as PLY and glTF, report, events and timings.
 *
 * All of them are begun before the first frame is read, so that a folder that cannot be written shows at once. None
 * bears its final name before it is whole: PLYs after their frame, the others when the run ends, early or not. */
#pragma once
#include "cli/job.h"
#include "io/file.h"
#include "io/gltf.h"

enum { KIND_MECHANICAL, KIND_GEOMETRIC, KIND_COUNT };
enum { GLTF_FILE_COUNT = 2 }; /* .glb, .gltf */

typedef struct Outputs {
    const MeshJob *job;
    OutFile report, events, timings;
    Gltf *gltf[KIND_COUNT][GLTF_FILE_COUNT]; /* NULL: not wanted */
    char *gltf_path[KIND_COUNT][GLTF_FILE_COUNT];
    TriMesh last[KIND_COUNT];
    int nframe;                              /* shown so far */
    double carry_s;                          /* of the last frame's seconds, those of track_carry */
} Outputs;

/* `fps`: frames a second of the glTF. False leaves nothing behind. */
bool outputs_open(Outputs *o, const MeshJob *job, double fps, Err *err);
/* The meshes of the frame just tracked, with the job's attributes from `attribute` (NULL: without). `frames`: intervals
 * since the last one shown. */
bool outputs_add_frame(Outputs *o, const Track *track, const Grid *attribute, const char *label, int frames, Err *err);
/* The last meshes once more. */
bool outputs_hold_frame(Outputs *o, const char *label, int frames, Err *err);
/* Ends and names what is open; everything is tried, err tells of the first failure. */
bool outputs_close(Outputs *o, const ReportTotals *totals, bool complete, Err *err);
/* Removes what is open. */
void outputs_abort(Outputs *o);
