/* remesh_priv.h: the guards, shared inside the module. */
#pragma once
#include "remesh/remesh.h"

/* --- limits: all dimensionless ---------------------------------------------------------------------------------- */

#define FACING_MIN 0.7       /* mean cosine of a triangle's normal to its corners' field normals; an octahedron in a ball has 0.58 */
#define FACING_MOVE_MIN 0.3  /* the same where vertices move: laxer, or tight places would freeze */
#define QUALITY_MIN 0.25     /* an edit leaves no triangle of less quality, unless one was worse before */
#define QUALITY_MOVE_MIN 0.1
#define DEVIATION_MAX_VOX 0.25 /* no edit leaves a triangle's centroid farther from the surface, unless one was before */
#define DEVIATION_FAR_VOX 2.0     /* farther is not measured: where the gradient vanishes the estimate is worth nothing */
#define DEVIATION_EDGE_VOX 1.0    /* triangles of shorter edges cannot deviate, and are not looked at */
#define EDGE_LONGEST 1.45    /* a collapse or flip makes no edge longer than this, in edges wanted */

enum { EDGE_LOCKED = 2 };    /* flagged by the step before */

/* How good a set of triangles is: its worst. */
typedef struct Fitness {
    double facing;  /* mean cosine of the normal to the corners' field normals */
    double quality; /* 2 sqrt(3) |2 area| / (sum of squared edges), 1 for an equilateral triangle */
} Fitness;

static inline Fitness fitness_best(void) { return (Fitness){1, 1}; }
Fitness triangle_fitness(const Vec3 p[3], const Vec3 n[3]);
void fitness_worsen(Fitness *f, Fitness by);
static inline bool fitness_allows(Fitness before, Fitness after, double facing, double quality)
{
    return after.facing >= real_min(facing, before.facing) && after.quality >= real_min(quality, before.quality);
}
/* How far a triangle's centroid is from the surface, to first order, in voxels; at most DEVIATION_FAR_VOX. */
double triangle_deviation(const Field *f, const Vec3 p[3]);

/* The field's outward unit normal at p. */
Vec3 remesh_normal_at(const Remesh *r, Vec3 p);
/* Lands p, meant for vertex v, within reach: on the surface, on v's own component. False: p is as it was. */
bool remesh_land_point(const Remesh *r, int v, Vec3 *p, double reach);
void remesh_make_room(Remesh *r);
/* Splits at the landed midpoint; the new vertex gets a fresh identity. */
void remesh_split(Remesh *r, int h);
/* The link condition, and valence four is the least: a component ends as an octahedron, not as a tetrahedron whose faces
 * look every way. */
bool remesh_can_collapse(const Mesh *m, int h);
/* Collapses at the midpoint or at either end, whichever the guards allow first; the older identity stays. False: none is allowed. */
bool remesh_try_collapse(Remesh *r, int h, double longest);
/* Live edges, one half-edge each, sorted by length (ascending or descending, ties by index), of those between lo and hi. */
int remesh_edges_by_length(const Mesh *m, double lo, double hi, bool descending, int32_t **edges);
/* Lands all vertices that `moved` marks (NULL: all) and renews their normals; those lost stay. */
void remesh_land(Remesh *r, const uint8_t *moved, double reach);
