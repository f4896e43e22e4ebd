/* hausdorff.h: the one-sided Hausdorff distance between triangle meshes: how far the farthest point of A is from B. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef struct Surface {
    int nvert, ntri;
    const Vec3 *pos;
    const int32_t *tri; /* [3*ntri] */
} Surface;

typedef struct FarPoint {
    double distance;    /* of `at`, a point of A; 0 without triangles of A */
    Vec3 at;
    double most;        /* no point of A is farther */
} FarPoint;

/* Triangles of A that can hold a point farther than what is known are halved until there is at most `slack` between
 * `distance` and `most`: a triangle lies no farther from B than its corners do from any one triangle of B. Where surfaces all but
 * coincide that would take too many pieces: they are not made smaller than 2^-16 of a triangle, and `most` says what that leaves
 * open. B has triangles, slack > 0. The same for any number of threads. */
FarPoint hausdorff_from(const Surface *a, const Surface *b, double slack);
