/* surgery.h: cutting pieces out of a mesh and sewing it up another way: the edits that change its topology.
 *
 * A Region is a set of triangles; its borders are the loops of half-edges beside it, kept ones whose opposites are in it. No
 * vertex may lie on a border twice (region_unpinch). mesh_erase opens the mesh; each border must then be capped or welded
 * to another before anything else is done to the mesh. One thread at a time. */
#pragma once
#include "mesh/mesh.h"

typedef struct Region {
    const Mesh *mesh;
    int n, cap;
    int32_t *tri;         /* [n] its triangles; those that died since are not in it */
    uint8_t *in;          /* [mesh->ntri] */
    int capin;
} Region;

typedef struct Borders {
    int n;                /* loops */
    int32_t *start;       /* [n + 1] */
    int32_t *half;        /* half-edges beside the region, each ends where the next begins */
    int32_t *piece;       /* [n] the piece of the region that the loop bounds */
    int npiece;           /* connected pieces of the region */
    int capstart, caphalf;
} Borders;

void region_init(Region *r, const Mesh *m);
void region_free(Region *r);
void region_clear(Region *r);
void region_add(Region *r, int t);
bool region_has(const Region *r, int t);
/* Adds every triangle that has a vertex of the region. */
void region_grow(Region *r);
/* Adds all triangles around a vertex that a border visits twice, until there is none. False: the region passes `most`. */
bool region_unpinch(Region *r, int most);
/* Adds what a border encloses on its far side where that is at most `most` triangles and not all of the rest: every border
 * of a piece but the longest is looked at. */
void region_fill_islands(Region *r, int most);
/* The connected piece, from 0, of each of the region's triangles; piece[mesh->ntri] elsewhere is left as it is. Returns how many. */
int region_pieces(const Region *r, int32_t *piece);
/* The borders, in the order in which their triangles were added. `b` zero or from an earlier call. */
void region_borders(const Region *r, Borders *b);
void borders_free(Borders *b);
static inline int border_length(const Borders *b, int loop) { return b->start[loop + 1] - b->start[loop]; }
static inline const int32_t *border_halves(const Borders *b, int loop) { return b->half + b->start[loop]; }
/* The mean place of the loop's vertices. */
Vec3 border_centre(const Mesh *m, const Borders *b, int loop);

/* Kills the region's triangles, and vertices that have no others. Returns how many vertices. */
int mesh_erase(Mesh *m, const Region *r);
/* Closes an open border of at least three half-edges with a fan around a new vertex at p; returns it. */
int mesh_cap(Mesh *m, int n, const int32_t *border, Vec3 p, int32_t id);
/* Whether borders a and b of a region, not erased yet, may be sewn together, half-edge a[i] to b[i], the start of one to the
 * end of the other: no two edges would come to join the same vertices. */
bool mesh_can_weld(const Mesh *m, int n, const int32_t *a, const int32_t *b);
/* Sews them together once erased: a's vertices stay, where they are. */
void mesh_weld(Mesh *m, int n, const int32_t *a, const int32_t *b);
