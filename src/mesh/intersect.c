/* intersect.c: all pairs at once. Triangles in Morton order, LEAF to a leaf of a balanced tree of boxes; each leaf searches
 * the tree for those that its box meets. Sizes may differ by any factor. Where only some are looked at, the tree holds these
 * alone, and each of the others searches it. */
#include "mesh/intersect.h"

#include "base/thread.h"
#include "mesh/facet.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF = BOX_ROW, GRAIN = 16, OTHERS_GRAIN = 1024, RUN = 16, TREE_DEPTH_MAX = 32, MORTON_BITS = 10, RADIX_BITS = 10 };

typedef struct PairList {
    int n, cap;
    TriPair *pair;
} PairList;

typedef struct Tree {
    const TriSoup *soup;
    const uint8_t *look;   /* [soup->ntri] or NULL */
    int n;                 /* triangles looked at that have an area */
    int32_t *tri;          /* [n] in Morton order */
    Facet *facet;          /* [n] */
    Box32 *box;            /* [n] */
    BoxRow *leaf;          /* [nleaf] */
    int nleaf, first_leaf; /* nodes from first_leaf on are leaves; node i has children 2 i and 2 i + 1, the root is 1 */
    Box32 *node;           /* [2 * first_leaf] */
    PairList *found;       /* a block */
} Tree;

/* --- Morton order -------------------------------------------------------------------------------------------------------- */

static uint64_t spread_bits(uint64_t x)
{
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

/* key << 32 | index; by key, ties in order of index. Returns the sorted one of the two. */
static uint64_t *sort_keys(uint64_t *key, uint64_t *other, int n)
{
    enum { BUCKETS = 1 << RADIX_BITS };
    for (int shift = 32; shift < 32 + 3 * MORTON_BITS; shift += RADIX_BITS) {
        int32_t start[BUCKETS + 1] = {0};
        for (int i = 0; i < n; i++) start[(key[i] >> shift) % BUCKETS + 1]++;
        for (int b = 0; b < BUCKETS; b++) start[b + 1] += start[b];
        for (int i = 0; i < n; i++) other[start[(key[i] >> shift) % BUCKETS]++] = key[i];
        uint64_t *sorted = other;
        other = key;
        key = sorted;
    }
    return key;
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

/* The triangles that are looked at, in Morton order, to be freed, and their boxes by number. Returns how many. */
static int sort_triangles(const TriSoup *s, const uint8_t *look, int32_t **order, Box32 *box)
{
    uint64_t *key = NEW(uint64_t, s->ntri), *other = NEW(uint64_t, s->ntri), *sorted;
    Box32 all = box32_none();
    Vec3 p[3];
    int n = 0;
    for (int t = 0; t < s->ntri; t++) {
        if (s->tri[3 * t] == NONE || (look && !look[t])) continue;
        corners_of(s, t, p);
        box[t] = box32_of(p);
        box_grow(&all, &box[t]);
        key[n++] = (uint32_t)t;
    }
    for (int i = 0; i < n; i++) key[i] |= morton_of(&box[key[i]], &all) << 32;
    sorted = sort_keys(key, other, n);
    *order = NEW(int32_t, n);
    for (int i = 0; i < n; i++) (*order)[i] = (int32_t)(uint32_t)sorted[i];
    mem_free(key);
    mem_free(other);
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
    Box32 *box = NEW(Box32, s->ntri);
    int32_t *order;
    int n = sort_triangles(s, look, &order, box);
    *tree = (Tree){.soup = s, .look = look, .tri = NEW(int32_t, n), .facet = NEW(Facet, n), .box = NEW(Box32, n)};
    for (int i = 0; i < n; i++) {
        int t = order[i], at = tree->n;
        Vec3 p[3];
        corners_of(s, t, p);
        if (!facet_make(&tree->facet[at], s->tri + 3 * t, p)) continue;
        tree->tri[at] = t;
        tree->box[at] = box[t];
        tree->n++;
    }
    mem_free(order);
    mem_free(box);
    build_nodes(tree);
}

static void tree_free(Tree *tree)
{
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

/* Triangle i against those behind it in a leaf. */
static void test_triangle(const Tree *tree, int i, int leaf, PairList *list)
{
    unsigned hits = boxrow_test(&tree->leaf[leaf], &tree->box[i]);
    while (hits) {
        int j = leaf * LEAF + bits_next(&hits);
        if (j > i && facets_intersect(&tree->facet[i], &tree->facet[j])) pair_add(list, tree->tri[i], tree->tri[j]);
    }
}

/* The triangles of a leaf against those of another behind it, or of its own. */
static void test_leaves(const Tree *tree, int leaf, int other, PairList *list)
{
    unsigned hits = boxrow_test(&tree->leaf[leaf], &tree->node[tree->first_leaf + other]);
    while (hits) test_triangle(tree, leaf * LEAF + bits_next(&hits), other, list);
}

/* The leaves below a node whose boxes meet one, a leaf a call: from stack[depth], which holds the node at first. NONE: no more. */
static int next_leaf(const Tree *tree, const Box32 *box, int *stack, int *depth)
{
    while (*depth) {
        int i = stack[--*depth];
        if (!box32_meets(box, &tree->node[i])) continue;
        if (i >= tree->first_leaf) return i - tree->first_leaf;
        stack[(*depth)++] = 2 * i + 1;
        stack[(*depth)++] = 2 * i;
    }
    return NONE;
}

/* Each leaf against itself and those after it. */
static void search_block(void *ctx, int begin, int end)
{
    Tree *tree = ctx;
    PairList *list = &tree->found[begin / GRAIN];
    for (int leaf = begin; leaf < end; leaf++) {
        const Box32 box = tree->node[tree->first_leaf + leaf];
        test_leaves(tree, leaf, leaf, list);
        for (int i = tree->first_leaf + leaf; i > 1; i /= 2) {
            int stack[TREE_DEPTH_MAX + 1] = {i + 1}, depth = i % 2 == 0;
            for (int other; (other = next_leaf(tree, &box, stack, &depth)) != NONE;) test_leaves(tree, leaf, other, list);
        }
    }
}

/* A triangle that is not looked at, against those that are. */
static void test_other(const Tree *tree, int t, PairList *list)
{
    Facet f;
    Vec3 p[3];
    corners_of(tree->soup, t, p);
    const Box32 box = box32_of(p);
    bool made = false;
    int stack[TREE_DEPTH_MAX + 1] = {1}, depth = 1;
    for (int leaf; (leaf = next_leaf(tree, &box, stack, &depth)) != NONE;) {
        for (unsigned hits = boxrow_test(&tree->leaf[leaf], &box); hits;) {
            int i = leaf * LEAF + bits_next(&hits);
            if (!made && !facet_make(&f, tree->soup->tri + 3 * t, p)) return;
            made = true;
            if (facets_intersect(&f, &tree->facet[i])) pair_add(list, t, tree->tri[i]);
        }
    }
}

static bool is_other(const Tree *tree, int t) { return !tree->look[t] && tree->soup->tri[3 * t] != NONE; }

/* Does a box around the others among some triangles meet the box of any that is looked at? */
static bool run_is_near(const Tree *tree, int begin, int end)
{
    Box32 box = box32_none();
    for (int t = begin; t < end; t++) {
        Vec3 p[3];
        if (!is_other(tree, t)) continue;
        corners_of(tree->soup, t, p);
        const Box32 b = box32_of(p);
        box_grow(&box, &b);
    }
    int stack[TREE_DEPTH_MAX + 1] = {1}, depth = 1;
    for (int leaf; (leaf = next_leaf(tree, &box, stack, &depth)) != NONE;)
        if (boxrow_test(&tree->leaf[leaf], &box)) return true;
    return false;
}

/* The others in runs: triangles that follow one another mostly are neighbours, and far from the few that are looked at. */
static void search_others(void *ctx, int begin, int end)
{
    Tree *tree = ctx;
    PairList *list = &tree->found[begin / OTHERS_GRAIN];
    for (int run = begin; run < end; run += RUN) {
        int run_end = int_min(run + RUN, end);
        if (!run_is_near(tree, run, run_end)) continue;
        for (int t = run; t < run_end; t++)
            if (is_other(tree, t)) test_other(tree, t, list);
    }
}

static int compare_pairs(const void *pa, const void *pb)
{
    const TriPair *a = pa, *b = pb;
    return a->a != b->a ? (a->a > b->a) - (a->a < b->a) : (a->b > b->b) - (a->b < b->b);
}

void pairs_sort(int n, TriPair *pair)
{
    if (n) qsort(pair, (size_t)n, sizeof *pair, compare_pairs);
}

/* Adds what a search of n items finds to the `count` pairs; returns how many they are then. */
static int search(Tree *tree, int n, int grain, ParallelFn *fn, int count, TriPair **pair, int *cap)
{
    int blocks = (n + grain - 1) / grain;
    tree->found = NEW0(PairList, blocks);
    parallel_for(n, grain, fn, tree);
    for (int b = 0; b < blocks; b++) {
        PairList *list = &tree->found[b];
        RESERVE(*pair, *cap, count + list->n);
        if (list->n) memcpy(*pair + count, list->pair, (size_t)list->n * sizeof **pair);
        count += list->n;
        mem_free(list->pair);
    }
    mem_free(tree->found);
    return count;
}

int intersect_find(const TriSoup *soup, const uint8_t *look, TriPair **pair, int *cap)
{
    Tree tree;
    tree_build(&tree, soup, look);
    int n = search(&tree, tree.nleaf, GRAIN, search_block, 0, pair, cap);
    if (look && tree.n) n = search(&tree, soup->ntri, OTHERS_GRAIN, search_others, n, pair, cap);
    tree_free(&tree);
    pairs_sort(n, *pair);
    return n;
}
