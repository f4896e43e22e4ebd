/* gltf_info.h: what a .glb or .gltf holds, from its JSON alone: no buffer is read.
 *
 * Meshes that share their indices are one run (a stretch of frames of one connectivity), as twinmesh writes them; other
 * files' meshes are runs of a frame each. Everything is checked; the memory is some twenty times the JSON's length. */
#pragma once
#include "base/base.h"

typedef struct GltfRunInfo {
    int64_t vertices, triangles;
    int pieces, targets;       /* meshes; morph targets of them all */
} GltfRunInfo;

typedef struct GltfInfo {
    bool binary;
    int nodes, meshes, nrun;
    GltfRunInfo *run;          /* [nrun] in the file's order */
    double seconds;            /* to the last key of any animation; 0: nothing moves */
    bool has_bounds;
    double lo[3], hi[3];       /* of the base meshes, where their accessors say so */
    char attributes[300];      /* "NORMAL POSITION _ID", sorted, as many as fit */
} GltfInfo;

bool gltf_info_read(const char *path, GltfInfo *out, Err *err);
void gltf_info_free(GltfInfo *info);
