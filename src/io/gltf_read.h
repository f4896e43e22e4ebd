/* gltf_read.h: the frames of an animated glTF as meshes.
 *
 * Read is what gltf.h writes, and what is like it: nodes without a transform but the animated `scale` of 0 or 1 that shows
 * them and a parent that moves and scales them, a mesh of one primitive each, triangles with an index, morph targets, one
 * animation of `scale` (STEP) and `weights` channels; quantized or not, arrays packed by EXT_meshopt_compression or not. A frame is a key of `weights` at a time when its node is shown, or for a node without
 * such a channel the time it is first shown at; its mesh is the base with the targets at that key's weights. Two nodes
 * shown at once are no mesh of ours: refused, as is whatever else is different.
 *
 * The JSON is held in memory, of the buffers only what is asked for. Every count and offset is checked against the files'
 * lengths before anything is allocated; ERR_INPUT. */
#pragma once
#include "mesh/trimesh.h"

typedef struct GltfReader GltfReader;

GltfReader *gltf_reader_open(const char *path, Err *err);
void gltf_reader_close(GltfReader *r); /* NULL is allowed */

/* Frames that show something. */
int gltf_reader_length(const GltfReader *r);
/* Which frame the i-th is, counted from 0 at time 0 in steps of the shortest way between two keys; rising. */
int64_t gltf_reader_frame(const GltfReader *r, int i);
/* Positions, normals (or zero), identities (or their indices), triangles. On failure *mesh is empty. */
bool gltf_reader_mesh(GltfReader *r, int i, TriMesh *mesh, Err *err);
