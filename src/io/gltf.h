/* gltf.h: animated glTF of a mesh whose connectivity changes, streamed: memory of a few frames whatever the
 * length.
 *
 * One *run* is a stretch of frames of one connectivity, cut into pieces of at most 8 morph targets, a node
 * and a mesh each: base POSITION and NORMAL at the piece's first frame, difference targets, a `weights`
 * channel, visibility by a STEP `scale` channel. Every run but the last ends with one more target: its
 * connectivity carried to the next run's first frame. The base also bears _ID and the attributes (of the
 * run's first frame) and _VELOCITY (of the piece's). Frame k, counted from 0 with skipped frames, stands at k
 * / fps seconds, rounded toward zero to float32; the last one is shown until the next would come.
 *
 * Bytes go to PREFIX.bin.part (PREFIX: the path without .gltf; PREFIX.1.bin.part and so on past 1 GiB each), for
 * a .glb to PREFIX.glb.bin.part, as frames come; gltf_close assembles the file under a temporary name, syncs and renames it. A .glb
 * that would pass 2^32-1 bytes becomes PREFIX.gltf with its .bin files. A call that failed has said why;
 * after it gltf_close fails with the same sentence. No failure leaves a file under a final name, nor a part
 * behind gltf_close or gltf_abort. */
#pragma once
#include "mesh/trimesh.h"

typedef struct Gltf Gltf;

/* Positions as 16-bit and normals as 8-bit whole numbers (KHR_mesh_quantization), and the arrays packed beside
 * (EXT_meshopt_compression). A position is moved by at most half of a step, a power of two below 1/16383 of the mesh's longest
 * side; triangles, identities, velocities and attributes stay exact. */
typedef enum GltfCompress { GLTF_PLAIN, GLTF_QUANTIZE, GLTF_MESHOPT } GltfCompress;

typedef struct GltfOptions {
    const char *path; /* final name; .glb: binary, .gltf: JSON and .bin parts */
    double fps;
    const char *name;                   /* of the nodes: "mechanical", "geometric" */
    bool step;                          /* hold each frame instead of interpolating */
    GltfCompress compress;
    void (*warn)(const char *sentence); /* called by gltf_close for a .glb that became .gltf; may be NULL */
} GltfOptions;

/* NULL on failure, with the sentence. The options are copied. */
Gltf *gltf_open(const GltfOptions *options, Err *err);
/* One frame. `carried_pos`, `carried_normal` ([3 * nvert of the last frame given]): where the last frame's
 * connectivity stands at this one's time; NULL when the connectivity is the same (trimesh_is_same_run) or
 * this is the first; where the connectivity is another and they are NULL the surface stands still until this
 * frame (normals alone NULL: they do). `frames` is the number of frame intervals since the last call
 * (normally 1, also for the first; more after skipped frames: nothing is shown between, and a run ends). The
 * mesh is copied. An empty mesh shows nothing, and serves for skipped frames at the end. */
bool gltf_add_frame(Gltf *g, const TriMesh *mesh, const float *carried_pos, const float *carried_normal,
                    int frames, Err *err);
/* Writes the file of the frames given so far. Frames cannot be added any more, but the parts on disk stay, for
 * gltf_abort or gltf_leave. */
bool gltf_finish(Gltf *g, Err *err);
/* Frees g and removes its parts: what gltf_finish has not written is lost. */
void gltf_abort(Gltf *g);
/* gltf_finish and gltf_abort. */
bool gltf_close(Gltf *g, Err *err);

/* A mesh that stands still, with texture coordinates: uv[2 * nvert], from the top left. */
bool gltf_write_still(const char *path, const TriMesh *mesh, const float *uv, const char *name, Err *err);

/* Going on in another run: gltf_sync makes the parts outlast this one, gltf_store keeps in a store all that is known beside
 * them, gltf_leave frees g and lets them stand, as after gltf_finish. gltf_reopen makes of the same options, the store and
 * the parts, which are cut off to what they were, a Gltf that takes the next frame; NULL with a sentence where that cannot
 * be (a bad store is left to the caller to tell of; err is then as it was). */
bool gltf_sync(Gltf *g, Err *err);
void gltf_store(Gltf *g, Store *s);
void gltf_leave(Gltf *g);
Gltf *gltf_reopen(const GltfOptions *options, Store *s, Err *err);
/* Removes the parts that a killed run left of the file `path`. */
void gltf_sweep(const char *path);

typedef struct GltfStat {
    int runs;
    double median_run; /* frames; 0 without runs */
} GltfStat;
GltfStat gltf_stat(const Gltf *g);
