/* remesh_priv.h: the guards, shared inside the module. */
#pragma once
#include "remesh/remesh.h"

/* --- limits: all dimensionless ---------------------------------------------------------------------------------- */

/* What an edit may leave behind, unless it was worse before. */
typedef struct Limits {
    double facing;        /* mean cosine of a triangle's normal to its corners' field normals; an octahedron in a ball has 0.58 */
    double quality;       /* of a triangle, 1 is equilateral */
    double deviation_vox; /* of a triangle's centroid from the surface */
    double longest;       /* no edge grows beyond this, in edges wanted */
} Limits;

extern const Limits LIMITS_EDIT, LIMITS_MOVE /* laxer, or tight places would freeze */, LIMITS_TIDY /* to be rid of very short edges and needles */;

#define DEVIATION_FAR_VOX 2.0     /* farther is not measured: where the gradient vanishes the estimate is worth nothing */
#define DEVIATION_EDGE_VOX 1.0    /* triangles of shorter edges cannot deviate, and are not looked at */

#define FACING_SURE 0.98          /* a triangle that faces as its corners' normals do to this degree lies along the surface: no need to sample it */

enum { EDGE_LOCKED = 2 };    /* flagged by the step before */

/* How good a set of triangles is: its worst. */
typedef struct Fitness {
    double facing;  /* mean cosine of the normal to the corners' field normals */
    double quality; /* 2 sqrt(3) |2 area| / (sum of squared edges), 1 for an equilateral triangle */
} Fitness;

static inline Fitness fitness_best(void) { return (Fitness){1, 1}; }
Fitness triangle_fitness(const Vec3 p[3], const Vec3 n[3]);
/* The quality alone. */
static inline double triangle_quality(Vec3 a, Vec3 b, Vec3 c)
{
    double area2 = v_len(v_area2(a, b, c)), sum = v_len2(v_sub(b, a)) + v_len2(v_sub(c, b)) + v_len2(v_sub(a, c));
    return area2 > 0 ? 3.4641016151377544 * area2 / sum : 0;
}
void fitness_worsen(Fitness *f, Fitness by);
static inline bool fitness_allows(Fitness before, Fitness after, const Limits *limits)
{
    return after.facing >= real_min(limits->facing, before.facing) && after.quality >= real_min(limits->quality, before.quality);
}
/* How far a triangle's centroid is from the surface, to first order, in voxels; at most DEVIATION_FAR_VOX. */
double triangle_deviation(const Field *f, const Vec3 p[3]);

static inline bool remesh_in_zone(const Remesh *r, int v) { return !r->zone || r->zone[v]; }
static inline bool remesh_touches_zone(const Remesh *r, int t)
{
    const int32_t *c = r->mesh->corner + 3 * t;
    return remesh_in_zone(r, c[0]) || remesh_in_zone(r, c[1]) || remesh_in_zone(r, c[2]);
}

/* Triangle and half-edge i of those in scope, the lower before the higher; how many triangles. */
static inline int remesh_scope_size(const Remesh *r) { return r->scope ? r->nscope + r->mesh->ntri - r->scope_end : r->mesh->ntri; }
static inline int remesh_scope_tri(const Remesh *r, int i) { return !r->scope ? i : i < r->nscope ? r->scope[i] : r->scope_end + i - r->nscope; }
static inline int remesh_scope_half(const Remesh *r, int i) { return 3 * remesh_scope_tri(r, i / 3) + i % 3; }

/* Place i in the plane across n around p: eight to a ring, the rings `step` edges apart. */
Vec3 remesh_place_around(Vec3 p, Vec3 n, int i, double step, double edge);
/* The field's outward unit normal at p. */
Vec3 remesh_normal_at(const Remesh *r, Vec3 p);
/* Lands p, meant for vertex v, within reach: on the surface, on v's own component. False: p and its normal are as they were. */
bool remesh_land_point(const Remesh *r, int v, Vec3 *p, double reach, Vec3 *normal);
/* The same of n points, each meant for a vertex of its own; landed[n]. */
void remesh_land_points(const Remesh *r, int n, const int32_t *v, Vec3 *p, double reach, Vec3 *normal, bool *landed);
void remesh_make_room(Remesh *r);
/* Splits at the landed midpoint; the new vertex gets a fresh identity. */
void remesh_split(Remesh *r, int h);
/* The link condition, and the vertices across the edge must not both come down to valence three: a component ends as an
 * octahedron, not as a tetrahedron whose faces look every way. */
bool remesh_can_collapse(const Mesh *m, int h);
/* Collapses at the midpoint or at either end, whichever the guards allow first; the older identity stays. False: none is allowed. */
bool remesh_try_collapse(Remesh *r, int h, const Limits *limits);
int remesh_flip_within(Remesh *r, double gain, const Limits *limits);
/* An edge by its ends: edits move half-edges to other slots while a list is worked off. */
typedef struct EdgeEnds {
    double length;
    int32_t h, from, to;
} EdgeEnds;

/* Which edges: with an end in the zone, of a length between lo and hi, and if `test` is not NULL those it holds of. Tests are called from
 * several threads. */
typedef struct EdgeChoice {
    double lo, hi;
    bool (*test)(const Mesh *m, int h, double length, const void *ctx);
    const void *ctx;
} EdgeChoice;

/* Live edges by index; the caller frees them. */
int remesh_find_edges(const Remesh *r, const EdgeChoice *choice, EdgeEnds **edges);
/* By merging: those of equal length stay in the order they come in. */
void remesh_sort_edges(int n, EdgeEnds *e, bool descending);
/* Live edges sorted by length (ascending or descending, ties by index); the caller frees them. */
int remesh_edges_by_length(const Remesh *r, const EdgeChoice *choice, bool descending, EdgeEnds **edges);
/* The half-edge between the ends, or NONE if the edge is gone. */
int remesh_find_edge(const Mesh *m, const EdgeEnds *e);
/* Lands all vertices that `moved` marks (NULL: all) and renews their normals; those lost stay. */
void remesh_land(Remesh *r, const uint8_t *moved, double reach);
