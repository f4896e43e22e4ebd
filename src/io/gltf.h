/* gltf.h: animated glTF of a mesh whose connectivity changes, streamed: memory of a few frames whatever the length.
 *
 * One node and mesh a *run* (a stretch of frames of one connectivity), cut into pieces of at most 8 morph targets
 * (DESIGN's GLTF notes): base POSITION and NORMAL at the piece's first frame, difference targets, a `weights` channel,
 * visibility by a STEP `scale` channel. Every run but the last ends with one more target: its connectivity carried
 * to the next run's first frame. Bytes go to PREFIX.bin.part as frames come; gltf_close assembles the file under a
 * temporary name, syncs and renames it. */
#pragma once
#include "mesh/trimesh.h"

typedef struct Gltf Gltf;

typedef struct GltfOptions {
    const char *path;    /* final name; .glb: binary, .gltf: JSON and .bin parts */
    double fps;
    const char *name;    /* of the nodes: "mechanical", "geometric" */
    bool step;           /* hold each frame instead of interpolating */
} GltfOptions;

/* NULL on failure, with the sentence. */
Gltf *gltf_open(const GltfOptions *options, Err *err);
/* One frame. `carried_pos`, `carried_normal` ([3 * nvert of the last frame given]): where the last frame's connectivity
 * stands at this one's time; NULL when the connectivity is the same (trimesh_is_same_run) or this is the first. `frames`
 * is the number of frame intervals since the last call (normally 1; more after a skipped frame: nothing is shown between).
 * The mesh is copied. An empty mesh shows nothing. */
bool gltf_add_frame(Gltf *g, const TriMesh *mesh, const float *carried_pos, const float *carried_normal, int frames, Err *err);
/* Writes the file and frees g, in any case. */
bool gltf_close(Gltf *g, Err *err);
/* Gives up: removes what was written, frees g. */
void gltf_abort(Gltf *g);

typedef struct GltfStat {
    int runs;
    double median_run;   /* frames */
} GltfStat;
GltfStat gltf_stat(const Gltf *g);
