/* closest.h: the point of a triangle mesh closest to a place, however far away it is: a tree of boxes.
 *
 * Where a reach and a side are known, nearest.h is quicker. Deterministic, immutable once built: any number of threads
 * may search it. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef struct ClosestBox {
    Vec3 lo, hi;
} ClosestBox;

typedef struct ClosestIndex {
    int ntri;
    const Vec3 *pos;     /* borrowed */
    const int32_t *tri;  /* [3*ntri] borrowed */
    int32_t *order;      /* [ntri] triangles by where they are, a leaf's one behind the other */
    int leaves;          /* a power of two */
    ClosestBox *box;     /* [2*leaves] the root is 1, the children of i are 2i and 2i + 1, the leaves come last */
} ClosestIndex;

typedef struct ClosestHit {
    int32_t tri;         /* NONE: there are no triangles */
    Vec3 point;
    double dist2;
} ClosestHit;

void closest_build(ClosestIndex *ix, int ntri, const Vec3 *pos, const int32_t *tri);
void closest_free(ClosestIndex *ix);
ClosestHit closest_find(const ClosestIndex *ix, Vec3 p);
