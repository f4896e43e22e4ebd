/* intersect.c: all pairs at once. Triangles in Morton order, LEAF to a leaf of a balanced tree of boxes; each leaf searches
 * the tree for those that its box meets. Sizes may differ by any factor. */
#include "mesh/intersect.h"

#include "base/thread.h"
#include "mesh/facet.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF = BOX_ROW, GRAIN = 16, TREE_DEPTH_MAX = 32, MORTON_BITS = 10, RADIX_BITS = 10 };

typedef struct PairList {
    int n, cap;
    TriPair *pair;
} PairList;

typedef struct Tree {
    const uint8_t *look;   /* [ntri] or NULL */
    int n;                 /* triangles with area */
    int32_t *tri;          /* [n] in Morton order */
    Facet *facet;          /* [n] */
    Box32 *box;            /* [n] */
    BoxRow *leaf;          /* [nleaf] */
    int nleaf, first_leaf; /* nodes from first_leaf on are leaves; node i has children 2 i and 2 i + 1, the root is 1 */
    Box32 *node;           /* [2 * first_leaf] */
    PairList *found;       /* [blocks of GRAIN leaves] */
} Tree;

/* --- Morton order -------------------------------------------------------------------------------------------------------- */

static uint64_t spread_bits(uint64_t x)
{
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

/* key << 32 | index; by key, ties in order of index. */
static void sort_keys(uint64_t *key, int n)
{
    enum { BUCKETS = 1 << RADIX_BITS };
    uint64_t *other = NEW(uint64_t, n);
    for (int shift = 32; shift < 32 + 3 * MORTON_BITS; shift += RADIX_BITS) {
        int32_t start[BUCKETS + 1] = {0};
        for (int i = 0; i < n; i++) start[(key[i] >> shift) % BUCKETS + 1]++;
        for (int b = 0; b < BUCKETS; b++) start[b + 1] += start[b];
        for (int i = 0; i < n; i++) other[start[(key[i] >> shift) % BUCKETS]++] = key[i];
        memcpy(key, other, (size_t)n * sizeof *key);
    }
    mem_free(other);
}

static void box_grow(Box32 *a, const Box32 *b)
{
    for (int k = 0; k < 3; k++) {
        if (b->lo[k] < a->lo[k]) a->lo[k] = b->lo[k];
        if (b->hi[k] > a->hi[k]) a->hi[k] = b->hi[k];
    }
}

static uint64_t morton_of(const Box32 *b, const Box32 *all)
{
    uint64_t key = 0;
    for (int k = 0; k < 3; k++) {
        double wide = (double)all->hi[k] - all->lo[k], at = 0.5 * ((double)b->lo[k] + b->hi[k]) - all->lo[k];
        int cell = wide > 0 ? int_clamp((int)(at / wide * (1 << MORTON_BITS)), 0, (1 << MORTON_BITS) - 1) : 0;
        key |= spread_bits((uint64_t)cell) << k;
    }
    return key;
}

static void corners_of(const TriSoup *s, int t, Vec3 p[3])
{
    for (int k = 0; k < 3; k++) p[k] = s->pos[s->tri[3 * t + k]];
}

static int sort_triangles(const TriSoup *s, uint64_t *key)
{
    Box32 all = box32_none(), *box = NEW(Box32, s->ntri);
    Vec3 p[3];
    int n = 0;
    for (int t = 0; t < s->ntri; t++) {
        if (s->tri[3 * t] == NONE) continue;
        corners_of(s, t, p);
        box[t] = box32_of(p);
        box_grow(&all, &box[t]);
    }
    for (int t = 0; t < s->ntri; t++)
        if (s->tri[3 * t] != NONE) key[n++] = morton_of(&box[t], &all) << 32 | (uint32_t)t;
    mem_free(box);
    sort_keys(key, n);
    return n;
}

/* --- the tree ------------------------------------------------------------------------------------------------------------ */

static void build_nodes(Tree *tree)
{
    tree->nleaf = (tree->n + LEAF - 1) / LEAF;
    tree->first_leaf = 1;
    while (tree->first_leaf < tree->nleaf) tree->first_leaf *= 2;
    tree->node = NEW(Box32, 2 * tree->first_leaf);
    tree->leaf = NEW(BoxRow, tree->nleaf);
    for (int i = 0; i < 2 * tree->first_leaf; i++) tree->node[i] = box32_none();
    for (int i = 0; i < tree->nleaf * LEAF; i++) boxrow_set(&tree->leaf[i / LEAF], i % LEAF, i < tree->n ? tree->box[i] : box32_none());
    for (int i = 0; i < tree->n; i++) box_grow(&tree->node[tree->first_leaf + i / LEAF], &tree->box[i]);
    for (int i = tree->first_leaf - 1; i > 0; i--) {
        box_grow(&tree->node[i], &tree->node[2 * i]);
        box_grow(&tree->node[i], &tree->node[2 * i + 1]);
    }
}

static void tree_build(Tree *tree, const TriSoup *s, const uint8_t *look)
{
    uint64_t *key = NEW(uint64_t, s->ntri);
    int n = sort_triangles(s, key);
    *tree = (Tree){.look = look, .tri = NEW(int32_t, n), .facet = NEW(Facet, n), .box = NEW(Box32, n)};
    for (int i = 0; i < n; i++) {
        int t = (int)(uint32_t)key[i], at = tree->n;
        Vec3 p[3];
        corners_of(s, t, p);
        if (!facet_make(&tree->facet[at], s->tri + 3 * t, p)) continue;
        tree->tri[at] = t;
        tree->box[at] = box32_of(p);
        tree->n++;
    }
    mem_free(key);
    build_nodes(tree);
    tree->found = NEW0(PairList, tree->nleaf / GRAIN + 1);
}

static void tree_free(Tree *tree)
{
    for (int b = 0; b <= tree->nleaf / GRAIN; b++) mem_free(tree->found[b].pair);
    mem_free(tree->found);
    mem_free(tree->tri);
    mem_free(tree->facet);
    mem_free(tree->box);
    mem_free(tree->leaf);
    mem_free(tree->node);
}

/* --- searching it -------------------------------------------------------------------------------------------------------- */

static void pair_add(PairList *list, int a, int b)
{
    RESERVE(list->pair, list->cap, list->n + 1);
    list->pair[list->n++] = (TriPair){int_min(a, b), int_max(a, b)};
}

static bool is_looked_at(const Tree *tree, int i) { return !tree->look || tree->look[tree->tri[i]]; }

/* Triangle i, looked at, against a leaf. A pair of two that are looked at is the earlier one's. */
static void test_triangle(const Tree *tree, int i, int leaf, PairList *list)
{
    uint8_t hit[LEAF];
    boxrow_test(&tree->leaf[leaf], &tree->box[i], hit);
    for (int k = 0; k < LEAF; k++) {
        int j = leaf * LEAF + k;
        if (!hit[k] || (j <= i && is_looked_at(tree, j))) continue;
        if (facets_intersect(&tree->facet[i], &tree->facet[j])) pair_add(list, tree->tri[i], tree->tri[j]);
    }
}

/* The triangles of a leaf that are looked at, against another leaf. */
static void test_leaves(const Tree *tree, int leaf, int other, PairList *list)
{
    uint8_t hit[LEAF];
    boxrow_test(&tree->leaf[leaf], &tree->node[tree->first_leaf + other], hit);
    for (int k = 0; k < LEAF; k++)
        if (hit[k] && is_looked_at(tree, leaf * LEAF + k)) test_triangle(tree, leaf * LEAF + k, other, list);
}

/* A leaf against all below a node. */
static void search_node(const Tree *tree, int leaf, int node, PairList *list)
{
    const Box32 box = tree->node[tree->first_leaf + leaf];
    int stack[TREE_DEPTH_MAX + 1] = {node}, depth = 1;
    while (depth) {
        int i = stack[--depth];
        if (!box32_meets(&box, &tree->node[i])) continue;
        if (i >= tree->first_leaf) {
            test_leaves(tree, leaf, i - tree->first_leaf, list);
            continue;
        }
        stack[depth++] = 2 * i + 1;
        stack[depth++] = 2 * i;
    }
}

static bool leaf_is_looked_at(const Tree *tree, int leaf)
{
    int end = int_min(tree->n, (leaf + 1) * LEAF);
    for (int i = leaf * LEAF; i < end; i++)
        if (is_looked_at(tree, i)) return true;
    return false;
}

/* Each leaf against those after it; where only some triangles are looked at, against those before it too. */
static void search_block(void *ctx, int begin, int end)
{
    Tree *tree = ctx;
    PairList *list = &tree->found[begin / GRAIN];
    for (int leaf = begin; leaf < end; leaf++) {
        if (!leaf_is_looked_at(tree, leaf)) continue;
        test_leaves(tree, leaf, leaf, list);
        for (int i = tree->first_leaf + leaf; i > 1; i /= 2)
            if (tree->look || i % 2 == 0) search_node(tree, leaf, i ^ 1, list);
    }
}

static int compare_pairs(const void *pa, const void *pb)
{
    const TriPair *a = pa, *b = pb;
    return a->a != b->a ? (a->a > b->a) - (a->a < b->a) : (a->b > b->b) - (a->b < b->b);
}

int intersect_find(const TriSoup *soup, const uint8_t *look, TriPair **pair, int *cap)
{
    Tree tree;
    int n = 0;
    tree_build(&tree, soup, look);
    parallel_for(tree.nleaf, GRAIN, search_block, &tree);
    for (int b = 0; b <= tree.nleaf / GRAIN; b++) {
        const PairList *list = &tree.found[b];
        if (list->n == 0) continue;
        RESERVE(*pair, *cap, n + list->n);
        memcpy(*pair + n, list->pair, (size_t)list->n * sizeof **pair);
        n += list->n;
    }
    tree_free(&tree);
    if (n) qsort(*pair, (size_t)n, sizeof **pair, compare_pairs);
    return n;
}
