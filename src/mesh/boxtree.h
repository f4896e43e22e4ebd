/* boxtree.h: triangles in a tree of boxes: ROW to a leaf along Hilbert's curve, then ROW leaves or nodes to a node, up to a single one.
 *
 * A row of boxes is tested at once. Those of the triangles are in 16 bits: what is apart in these is apart. Nodes are in float32,
 * as sizes may differ by any factor: where 16 bits are too coarse for the sizes there are, only leaves tell less. */
#pragma once
#include "mesh/facet.h"
#include "mesh/intersect.h"

enum { ROW = BOX_ROW, TREE_LEVELS_MAX = 9 };

typedef struct Box16 {
    int16_t lo[3], hi[3];
} Box16;

typedef struct Row16 {
    int16_t lo[3][ROW], hi[3][ROW];
} Row16;

typedef struct BoxTree {
    int n;                   /* triangles in it */
    int32_t *tri;            /* [n] along Hilbert's curve */
    int nleaf;
    Row16 *leaf;             /* [nleaf] leaf i is around tri[ROW i ...]; where there are no more, boxes that meet none */
    Box16 *around;           /* [nleaf] each, before one has moved */
    int nlevel;              /* a row i of the lowest is around leaves ROW i ..., of the next one around rows of that, the last has one */
    BoxRow *level[TREE_LEVELS_MAX];
    Box32 all;               /* around all when it was built, */
    double origin[3], scale; /* and what it is in 16 bits */
    double far;              /* the largest coordinate that a triangle in it has, or had */
    int32_t *place;          /* [ntri of the soup] in tri[...], once one has moved */
} BoxTree;

static inline Box32 soup_box(const TriSoup *s, int t)
{
    const int32_t *c = s->tri + 3 * t;
    const Vec3 p[3] = {s->pos[c[0]], s->pos[c[1]], s->pos[c[2]]};
    return box32_of(p);
}
/* Of those with some[t] set (NULL: of all) that are not dead. *tree is the caller's to free. */
void boxtree_build(BoxTree *tree, const TriSoup *s, const uint8_t *some);
void boxtree_free(BoxTree *tree);
/* A triangle in it has moved. Boxes around it only ever grow. */
void boxtree_move(BoxTree *tree, const TriSoup *s, int t);
/* Of any box, for a test with those in the tree. */
Box16 boxtree_box16(const BoxTree *tree, const Box32 *b);

static inline Box16 row16_get(const Row16 *row, int at)
{
    return (Box16){{row->lo[0][at], row->lo[1][at], row->lo[2][at]}, {row->hi[0][at], row->hi[1][at], row->hi[2][at]}};
}

/* As boxrow_test. */
static inline unsigned row16_test(const Row16 *row, const Box16 *b)
{
    static const uint16_t BIT[ROW] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
    const int16_t x = b->lo[0], y = b->lo[1], z = b->lo[2], X = b->hi[0], Y = b->hi[1], Z = b->hi[2];
    uint16_t apart = 0;
    for (int i = 0; i < ROW; i++) {
        uint16_t is = (uint16_t)((row->lo[0][i] > X) | (x > row->hi[0][i]) | (row->lo[1][i] > Y) | (y > row->hi[1][i]) |
                                 (row->lo[2][i] > Z) | (z > row->hi[2][i]));
        apart |= is ? BIT[i] : 0;
    }
    return (uint16_t)~apart;
}

/* The leaves whose boxes meet one, in their order, from one leaf on. The tree is not empty. */
typedef struct Walk {
    Box32 box;
    int from, depth;
    int row[TREE_LEVELS_MAX];       /* on the way down, a level each: */
    unsigned hits[TREE_LEVELS_MAX]; /* those in it that are still to come */
} Walk;
Walk walk_begin(const BoxTree *tree, Box32 box, int from);
/* NONE: no more. */
int walk_next(const BoxTree *tree, Walk *w);
