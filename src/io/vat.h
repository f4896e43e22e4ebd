/* vat.h: vertex animation textures for game engines: the frames of a mesh as images, a texel a vertex.
 *
 * For each *run*, a stretch of frames of one connectivity, under PREFIX.KIND.NNNN, the label of its first frame:
 * .base.glb, the mesh of that frame with texture coordinates that point at the middle of each vertex's first texel, and
 * .position.exr and .normal.exr, R, G and B of 32-bit floats: the way from the base to where the vertex is, and its normal.
 * A frame is a block of rows; the first one is at the top. A run that another follows at the next frame has one more block:
 * its connectivity carried to that frame. PREFIX.KIND.vat.json tells of all of them (man/twinmesh-formats.7).
 *
 * The open run's blocks grow in PREFIX.KIND.vat.0.part or .1.part, in turns, so that what a state tells of is there until
 * the next state is written; when the run ends they become its files. Memory is that of a mesh and a few rows. A call that
 * failed has said why; after it vat_finish fails with the same sentence. */
#pragma once
#include "mesh/trimesh.h"

enum { VAT_SIDE = 4096 }; /* what engines take; two blocks may be higher than that */

typedef struct Vat Vat;

typedef struct VatOptions {
    const char *prefix; /* PREFIX.KIND */
    const char *name;   /* of the mesh: "mechanical", "geometric" */
    double fps;
    int side;           /* texels of a texture's width and height at most, a power of two; VAT_SIDE */
} VatOptions;

Vat *vat_open(const VatOptions *options);
/* One frame, as gltf_add_frame takes it. `label`: the digits of its number. */
bool vat_add_frame(Vat *v, const TriMesh *mesh, const float *carried_pos, const float *carried_normal, int frames,
                   const char *label, Err *err);
/* Writes the files of the open run, and the .json of the frames given so far. Frames cannot be added any more. */
bool vat_finish(Vat *v, Err *err);
/* Frees, and removes the open run's blocks. NULL is allowed, as below. */
void vat_abort(Vat *v);

/* Going on in another run, as with gltf.h: vat_reopen is NULL with a sentence where that cannot be, or the store is bad. */
bool vat_sync(Vat *v, Err *err);
void vat_store(Vat *v, Store *s);
void vat_leave(Vat *v);
Vat *vat_reopen(const VatOptions *options, Store *s, Err *err);
/* Removes the blocks that a killed run left. */
void vat_sweep(const char *prefix);
/* PREFIX.KIND.vat.json; to be freed. */
char *vat_path(const char *prefix);
