/* intersect_priv.h: a triangle made ready for many tests, shared inside the module. */
#pragma once
#include "mesh/intersect.h"

typedef struct Facet {
    Vec3 p[3];
    int32_t v[3];
    Vec3 normal;   /* (p1 - p0) x (p2 - p0) */
    Vec3 all;      /* the same with every term taken positive: the scale of the normal's error */
} Facet;

/* False: no area, not to be tested. */
bool facet_make(Facet *f, const int32_t v[3], const Vec3 p[3]);
/* Do they intersect, as intersect.h says? */
bool facets_intersect(const Facet *f, const Facet *g);

/* Exact: the coordinates are float32. */
typedef struct Box32 {
    float lo[3], hi[3];
} Box32;

Box32 box32_of(const Vec3 p[3]);
static inline bool box32_meets(const Box32 *a, const Box32 *b)
{
    return (a->lo[0] <= b->hi[0]) & (b->lo[0] <= a->hi[0]) & (a->lo[1] <= b->hi[1]) & (b->lo[1] <= a->hi[1]) &
           (a->lo[2] <= b->hi[2]) & (b->lo[2] <= a->hi[2]);
}
