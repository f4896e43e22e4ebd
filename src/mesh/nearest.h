/* nearest.h: the point of a triangle mesh nearest to a place, by a grid of cells.
 *
 * Triangles that look away from the direction asked are passed over: so the other side of a thin sheet is never the nearest.
 * Deterministic: of equally near triangles the first. Immutable once built: any number of threads may search it. */
#pragma once
#include "base/base.h"
#include "base/hash.h"
#include "base/vec.h"

/* The point of triangle q nearest to p, as weights of its corners: all >= 0, their sum is 1. */
void triangle_nearest(Vec3 p, const Vec3 q[3], double w[3]);

typedef struct NearestIndex {
    int ntri;
    const Vec3 *pos;     /* borrowed */
    const int32_t *tri;  /* [3*ntri] borrowed; NONE at 3t: dead */
    double cell;         /* side: the farthest that is searched */
    Map at;              /* by cell: where its list starts */
    int32_t *first;      /* [at.count + 1] */
    int32_t *member;     /* triangles, cell by cell, rising */
} NearestIndex;

typedef struct NearestHit {
    int32_t tri;         /* NONE: there is none within reach */
    double w[3];
    double dist2;
} NearestHit;

/* `reach` > 0: nothing farther is found; best about as long as the triangles' edges: triangles whose boxes touch more than 64 cubes
 * of that side are left out. */
void nearest_build(NearestIndex *ix, int ntri, const Vec3 *pos, const int32_t *tri, double reach);
void nearest_free(NearestIndex *ix);
/* `n`: a triangle's normal must have a positive cosine with it. */
NearestHit nearest_find(const NearestIndex *ix, Vec3 p, Vec3 n);
