/* intersect.h: which triangles of a mesh or of a soup run through one another.
 *
 * Two triangles intersect when they have a point in common that is not of what they share: without a common vertex, any
 * point at all, a mere touch included; with one, any other point; with an edge, only where one is folded flat onto the other. That
 * is the rule of CGAL's Polygon Mesh Processing. All signs are exact (orient.h): positions must hold float32 values.
 * Triangles without area are left out, a fault of their own: they intersect nothing. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

bool triangle_is_collinear(const Vec3 p[3]);
/* One pair, by vertex numbers and positions. */
bool triangles_intersect(const int32_t va[3], const Vec3 pa[3], const int32_t vb[3], const Vec3 pb[3]);

typedef struct TriSoup {
    int ntri;
    const Vec3 *pos;
    const int32_t *tri;   /* [3*ntri] into pos; NONE at 3t: the triangle is dead (a Mesh's corners will do) */
} TriSoup;

typedef struct TriPair {
    int32_t a, b;         /* a < b */
} TriPair;

/* All pairs that intersect, or those with look[t] set for one of the two (look[ntri]; NULL: all), sorted. *pair is grown as
 * needed (*cap items; both 0 at first) and the caller's to free. Returns how many. The same for any number of threads. */
int intersect_find(const TriSoup *soup, const uint8_t *look, TriPair **pair, int *cap);
/* intersect_find of one soup again and again. Between two calls those of its triangles alone may move that have look[t] set in the
 * second; what the soup points to stays where it is. */
typedef struct PairSearch PairSearch;
PairSearch *pair_search_begin(const TriSoup *soup);
int pair_search_find(PairSearch *s, const uint8_t *look, TriPair **pair, int *cap);
void pair_search_end(PairSearch *s);
/* As intersect_find sorts them. */
void pairs_sort(int n, TriPair *pair);
