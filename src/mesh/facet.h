/* facet.h: a triangle made ready for many tests, and crowds of them. Positions hold float32 values, as in intersect.h. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

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

static inline float least_of(double a, double b, double c)
{
    float x = (float)a, y = (float)b, z = (float)c, lo = x < y ? x : y;
    return z < lo ? z : lo;
}
static inline float most_of(double a, double b, double c)
{
    float x = (float)a, y = (float)b, z = (float)c, hi = x > y ? x : y;
    return z > hi ? z : hi;
}
static inline Box32 box32_of(const Vec3 p[3])
{
    return (Box32){{least_of(p[0].x, p[1].x, p[2].x), least_of(p[0].y, p[1].y, p[2].y), least_of(p[0].z, p[1].z, p[2].z)},
                   {most_of(p[0].x, p[1].x, p[2].x), most_of(p[0].y, p[1].y, p[2].y), most_of(p[0].z, p[1].z, p[2].z)}};
}
static inline bool box32_meets(const Box32 *a, const Box32 *b)
{
    return (a->lo[0] <= b->hi[0]) & (b->lo[0] <= a->hi[0]) & (a->lo[1] <= b->hi[1]) & (b->lo[1] <= a->hi[1]) &
           (a->lo[2] <= b->hi[2]) & (b->lo[2] <= a->hi[2]);
}

static inline void box32_grow(Box32 *a, const Box32 *b)
{
    for (int k = 0; k < 3; k++) {
        a->lo[k] = b->lo[k] < a->lo[k] ? b->lo[k] : a->lo[k];
        a->hi[k] = b->hi[k] > a->hi[k] ? b->hi[k] : a->hi[k];
    }
}

/* Boxes in columns: one loop tests a box against all. Those not in use are box32_none(). */
enum { BOX_ROW = 16 };
typedef struct BoxRow {
    float lo[3][BOX_ROW], hi[3][BOX_ROW];
} BoxRow;

static inline Box32 box32_none(void)
{
    return (Box32){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline void boxrow_set(BoxRow *row, int at, Box32 b)
{
    for (int k = 0; k < 3; k++) row->lo[k][at] = b.lo[k], row->hi[k][at] = b.hi[k];
}

/* Bit i is set where the box meets box i. */
static inline unsigned boxrow_test(const BoxRow *row, const Box32 *b)
{
    static const unsigned BIT[BOX_ROW] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
    unsigned bits = 0;
    for (int i = 0; i < BOX_ROW; i++) {
        int meets = (row->lo[0][i] <= b->hi[0]) & (b->lo[0] <= row->hi[0][i]) & (row->lo[1][i] <= b->hi[1]) &
                    (b->lo[1] <= row->hi[1][i]) & (row->lo[2][i] <= b->hi[2]) & (b->lo[2] <= row->hi[2][i]);
        bits |= meets ? BIT[i] : 0;
    }
    return bits;
}
static inline Box32 boxrow_get(const BoxRow *row, int at)
{
    return (Box32){{row->lo[0][at], row->lo[1][at], row->lo[2][at]}, {row->hi[0][at], row->hi[1][at], row->hi[2][at]}};
}
/* Of BOX_ROW bits. */
static inline int bits_count(unsigned bits)
{
    bits -= bits >> 1 & 0x5555;
    bits = (bits & 0x3333) + (bits >> 2 & 0x3333);
    bits = (bits + (bits >> 4)) & 0x0f0f;
    return (int)((bits + (bits >> 8)) & 31);
}
/* Takes the lowest bit out of *bits, which are not 0, and returns its number. */
static inline int bits_next(unsigned *bits)
{
    int i = __builtin_ctz(*bits);
    *bits &= *bits - 1;
    return i;
}

/* Some triangles that others are tested against, one by one. Zero is an empty one. */
typedef struct Crowd {
    int n, cap;
    Facet *facet;   /* [n] */
    int32_t *name;  /* [n] */
    BoxRow *row;    /* [n / BOX_ROW, rounded up] */
} Crowd;

void crowd_clear(Crowd *c);
void crowd_free(Crowd *c);
void crowd_add(Crowd *c, const Facet *f, const Box32 *b, int name);
/* How many the facet intersects, but for those whose names are set in without[] (NULL: none); counts no further than `most`. */
int crowd_count(const Crowd *c, const Facet *f, const Box32 *b, const uint8_t *without, int most);
