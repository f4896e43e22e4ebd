/* mesh.h: the living triangle mesh: a closed 2-manifold of half-edges in flat arrays.
 *
 * Half-edge h = 3 t + k runs from corner[h] to the next corner of triangle t. Invariant (mesh_check): opp is an
 * involution, opposite half-edges run between the same vertices in opposite directions, out[v] leaves v, and each
 * vertex has one umbrella. Edits are local and keep the Euler characteristic of each component (link condition).
 * Dead vertices and triangles (out[v] == NONE, corner[3t] == NONE) stay until mesh_compact. One thread at a time; or
 * several that collapse edges, as long as the rings of the ends of one have no vertex in common with those of another, each
 * through a copy of the struct, whose counts of the dead are added up afterwards (coarsen.c). */
#pragma once
#include "base/store.h"
#include "base/vec.h"

enum { EDGE_FLAGGED = 1, MESH_ID_STEP = 2 };

typedef struct Mesh {
    int nvert, ntri;        /* in use, the dead included */
    int capvert, captri;
    int deadvert, deadtri;
    int nsorted;            /* the first of the vertices are as mesh_sort left them; those that came later lie behind */
    Vec3 *pos;              /* [nvert] world units */
    int32_t *id;            /* [nvert] persistent identity */
    int32_t *out;           /* [nvert] a half-edge that leaves v; NONE: dead */
    int32_t *corner;        /* [3*ntri] */
    int32_t *opp;           /* [3*ntri] */
    float *length;          /* [3*ntri] the edge's length after the last step (GI'07 2.5); < 0: not known. Same on both half-edges */
    uint8_t *flag;          /* [3*ntri] EDGE_FLAGGED: not to be modified in this step. Same on both half-edges */
    int32_t next_id;        /* the first identity never used; they go up by MESH_ID_STEP: those between are for midpoints (refine.h) */
} Mesh;

void mesh_init(Mesh *m);
void mesh_free(Mesh *m);
void mesh_clear(Mesh *m);   /* no vertices; identities go on */
int32_t mesh_fresh_id(Mesh *m);

static inline int he_next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
static inline int he_prev(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
static inline int he_from(const Mesh *m, int h) { return m->corner[h]; }
static inline int he_to(const Mesh *m, int h) { return m->corner[he_next(h)]; }
/* The next half-edge leaving the same vertex, clockwise. */
static inline int he_around(const Mesh *m, int h) { return he_next(m->opp[h]); }
static inline bool tri_is_dead(const Mesh *m, int t) { return m->corner[3 * t] == NONE; }
static inline bool vert_is_dead(const Mesh *m, int v) { return m->out[v] == NONE; }

/* Appends closed manifold triangles over new vertices; ids may be NULL (fresh ones are given out).
 * tri: 3*ntri indices into pos. ASSERTs that the triangles close up. */
void mesh_append(Mesh *m, int nvert, const Vec3 *pos, const int32_t *id, int ntri, const int32_t *tri);
/* `to` becomes what `from` is, in the room that it has. */
void mesh_copy(Mesh *to, const Mesh *from);
/* Sweeps the dead out, keeping order. `vert_to` (may be NULL, [nvert before]) gets each vertex's new index or NONE. */
void mesh_compact(Mesh *m, int32_t *vert_to);
/* Renumbers a compact mesh: vertices by key[nvert], each 0 ... nkey - 1, triangles by their least vertex; otherwise they keep their order.
 * vert_to[nvert] gets each vertex's new index. */
void mesh_sort(Mesh *m, int nkey, const int32_t *key, int32_t *vert_to);
/* Component of each triangle and vertex (NONE for the dead), numbered by first triangle; returns how many. Either array may be NULL. */
int mesh_components(const Mesh *m, int32_t *tri_comp, int32_t *vert_comp);
/* Kills every triangle (and vertex) for which drop[component] is set. */
void mesh_drop_components(Mesh *m, const int32_t *tri_comp, const uint8_t *drop);

/* Takes out the triangles drop[ntri] and puts `ntri` new ones in, which must close the gaps: tri[3*ntri] names vertices of the mesh
 * and, from nvert on, the `nvert_new` new ones at pos (fresh identities). Vertices left without a triangle die. */
void mesh_patch(Mesh *m, const uint8_t *drop, int nvert_new, const Vec3 *pos, int ntri, const int32_t *tri);

int mesh_valence(const Mesh *m, int v);
/* The half-edge from a to b, or NONE. */
static inline int mesh_find_edge(const Mesh *m, int a, int b)
{
    int h = m->out[a];
    do
        if (he_to(m, h) == b) return h;
    while ((h = he_around(m, h)) != m->out[a]);
    return NONE;
}
Vec3 mesh_tri_area2(const Mesh *m, int t); /* twice the area times the unit normal */
static inline double mesh_edge_length(const Mesh *m, int h) { return v_dist(m->pos[he_from(m, h)], m->pos[he_to(m, h)]); }
Vec3 mesh_ring_mean(const Mesh *m, int v); /* of its neighbours */

/* --- edits: each keeps a closed manifold. Changed edges become EDGE_FLAGGED, their length unknown. --- */

/* Puts a new vertex at p on the edge; returns it. Two new triangles. */
int mesh_split_edge(Mesh *m, int h, Vec3 p, int32_t id);
/* GI'07 figure 3: the link condition, and no component below four triangles. */
bool mesh_can_collapse(const Mesh *m, int h);
/* Joins to(h) into from(h), which moves to p and keeps its identity. Precondition: mesh_can_collapse. */
void mesh_collapse_edge(Mesh *m, int h, Vec3 p);
/* The other diagonal does not exist yet, and both ends keep a valence of at least three. */
bool mesh_can_flip(const Mesh *m, int h);
void mesh_flip_edge(Mesh *m, int h);

/* Checks the invariant, all of it; NULL or a sentence. For tests, debug builds, and what was read. */
const char *mesh_check(const Mesh *m);
/* A compact mesh into a store, or out of it into one that is zero: a mesh, or the store is bad. */
void mesh_store(Mesh *m, Store *s);
