/* iso.h: the exact trilinear isosurface of a frame as a combinatorial object: cut edges, loops, components.
 *
 * Counted from the grid alone, no mesh needed: components by union-find over the cut grid edges, joined around each
 * loop and across each tunnel; Euler characteristic of a component = cut edges - half the loop lengths + loops that
 * bound a disc. Built once a frame; a few milliseconds for 10^5 crossed cells. The field must outlive it. */
#pragma once
#include "field/field.h"
#include "mesh/mesh.h"

typedef struct IsoSurface {
    const Field *field;
    int nedge;             /* cut grid edges */
    int32_t *edge_comp;    /* [nedge] component */
    Vec3 *edge_pos;        /* [nedge] where the edge is cut, index space; a little away from its ends */
    int ncell;             /* crossed cells, by brick, then x fastest */
    int32_t *cell_at;      /* [ncell] brick * 512 + local sample */
    int32_t *cell_loop;    /* [ncell + 1] first loop */
    int nloop;
    int32_t *loop_start;   /* [nloop + 1] in loop_edge */
    int32_t *loop_edge;    /* cut edges, counter-clockwise seen from outside the object, in index space */
    int32_t *loop_mate;    /* [nloop] the other loop of a tunnel, or NONE */
    int32_t *loop_comp;    /* [nloop] component */
    uint8_t *loop_plain;   /* [nloop] the only loop of a cell without ambiguous faces */
    int32_t *cell_index;   /* [field->ncrossed * 512] crossed cell or NONE */
    int ncomp;
    int32_t *comp_euler;   /* [ncomp] */
    int32_t *comp_loops;   /* [ncomp] how many loops */
    double *comp_volume;   /* [ncomp] enclosed by fans over the loops, voxels; negative: a cavity */
    Vec3 (*comp_box)[2];   /* [ncomp] of its cut edges, index space */
    int ambiguous_cells, tunnels;
} IsoSurface;

void iso_build(IsoSurface *iso, const Field *field);
void iso_free(IsoSurface *iso);

/* The component whose surface a world point lies on: of the loop nearest to it in its cell, or, for points that
 * rounding put beside their cell, in a neighbour's. NONE: no crossed cell there. *sure: no other component is in that cell. */
int iso_component_at(const IsoSurface *iso, Vec3 p, bool *sure);
int iso_loop_at(const IsoSurface *iso, Vec3 p); /* that loop, or NONE */
int iso_loop_in(const IsoSurface *iso, int cell, Vec3 p); /* of a crossed cell */
static inline int iso_loop_component(const IsoSurface *iso, int loop) { return iso->loop_comp[loop]; }
/* The crossed cell (dx, dy, dz) cells away from one that is crossed, or NONE. */
int iso_cell_beside(const IsoSurface *iso, int cell, int dx, int dy, int dz);
/* Sets mark[ncell] for the crossed cells at most `reach` away from one. */
void iso_mark_beside(const IsoSurface *iso, int cell, int reach, uint8_t *mark);
/* The crossed cell that holds a world point, or NONE. _near: or one that rounding put it beside. */
int iso_cell_at(const IsoSurface *iso, Vec3 p);
int iso_cell_near(const IsoSurface *iso, Vec3 p);

/* Sets hit[ncell] for the crossed cells that a triangle passes through, sampled at most about a voxel apart. Threads may
 * share `hit`. */
void iso_mark_cells(const IsoSurface *iso, Vec3 a, Vec3 b, Vec3 c, uint8_t *hit);

/* For Homes: whether p lies on component `home` (ctx is the IsoSurface). */
bool iso_is_home(const void *ctx, int32_t home, Vec3 p);

/* The reference: marching-cubes triangles of exactly the trilinear topology, outward-facing in world space. */
typedef struct IsoTriangles {
    int nvert, ntri;
    Vec3 *pos;      /* [nvert] world units */
    int32_t *home;  /* [nvert] component */
    int32_t *tri;   /* [3*ntri] */
    int32_t *cell;  /* [ntri] the crossed cell each lies in */
} IsoTriangles;

/* The triangles of the components want_comp[ncomp] and of the cells want_cell[ncell] (either may be NULL): closed for
 * components, with rims where the cells wanted end. */
void iso_triangles(const IsoSurface *iso, const uint8_t *want_comp, const uint8_t *want_cell, IsoTriangles *out);
void iso_triangles_free(IsoTriangles *t);

/* Appends to an empty mesh the marching-cubes triangles of the components chosen (want[ncomp]), outward-facing in
 * world space. Vertices get fresh identities from mesh->next_id.
 * *home (may be NULL) gets an array of each vertex's component, the caller's to free. */
void iso_triangulate(const IsoSurface *iso, const uint8_t *want, Mesh *mesh, int32_t **home);
