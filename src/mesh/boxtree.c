#include "mesh/boxtree.h"

#include "base/thread.h"

enum { GRAIN = 16, BOX_GRAIN = 1024, ORDER_BITS = 10, RADIX_BITS = 10, CURVE_STATES = 24, ROW_BITS = 4 };
_Static_assert(1 << ROW_BITS == ROW && ORDER_BITS % 2 == 0, "a level has ROW times as many; the curve is followed two steps at a time");
enum { MIN16 = INT16_MIN + 1, MAX16 = INT16_MAX - 1 }; /* coordinates in 16 bits: box16_none is apart from all */

/* What it takes to build one, by the number of a triangle in tree->tri before that is sorted. */
typedef struct Sorting {
    const TriSoup *soup;
    BoxTree *tree;
    Box32 *box;
    Box32 *block;          /* around BOX_GRAIN of them */
    uint64_t *key;         /* place along the curve << 32 | number */
    uint16_t curve[CURVE_STATES][64];
} Sorting;

/* --- boxes --------------------------------------------------------------------------------------------------------------- */

/* The box lies within the tree's. */
static Box16 box16_of(const BoxTree *tree, const Box32 *b)
{
    Box16 c;
    for (int k = 0; k < 3; k++) {
        c.lo[k] = (int16_t)((int)((b->lo[k] - tree->origin[k]) * tree->scale) + MIN16);
        c.hi[k] = (int16_t)((int)((b->hi[k] - tree->origin[k]) * tree->scale) + MIN16);
    }
    return c;
}

/* What lies outside is brought to the border: the order of coordinates stays. */
Box16 boxtree_box16(const BoxTree *tree, const Box32 *b)
{
    Box32 c;
    for (int k = 0; k < 3; k++) {
        c.lo[k] = (float)real_clamp(b->lo[k], tree->all.lo[k], tree->all.hi[k]);
        c.hi[k] = (float)real_clamp(b->hi[k], tree->all.lo[k], tree->all.hi[k]);
    }
    return box16_of(tree, &c);
}

static Box16 box16_none(void) { return (Box16){{INT16_MAX, INT16_MAX, INT16_MAX}, {INT16_MIN, INT16_MIN, INT16_MIN}}; }

static void row16_set(Row16 *row, int at, Box16 b)
{
    for (int k = 0; k < 3; k++) row->lo[k][at] = b.lo[k], row->hi[k][at] = b.hi[k];
}

/* --- the order: along Hilbert's curve ------------------------------------------------------------------------------------ */

/* Three bits, turned round. */
static int turn_left(int bits, int by) { return (bits << by | bits >> (3 - by)) & 7; }

/* one[state][octant]: the octant's number along the curve, and 8 times the state within it. A state is where the curve enters, as
 * bits of x, y, z, and along which axis it leaves (Hamilton 2006). */
static void find_octants(uint8_t one[CURVE_STATES][8])
{
    static const uint8_t GRAY[8] = {0, 1, 3, 2, 6, 7, 5, 4}, ENTER[8] = {0, 0, 0, 3, 3, 6, 6, 5}, ALONG[8] = {0, 1, 1, 2, 2, 1, 1, 0};
    for (int state = 0; state < CURVE_STATES; state++)
        for (int i = 0; i < 8; i++) {
            int enter = state / 3, turn = (state % 3 + 1) % 3;
            int octant = turn_left(GRAY[i], turn) ^ enter, within = enter ^ turn_left(ENTER[i], turn);
            one[state][octant] = (uint8_t)((3 * within + (state % 3 + ALONG[i] + 1) % 3) * 8 + i);
        }
}

/* The same for two levels at once: the octants' octants. */
static void find_curve(uint16_t curve[CURVE_STATES][64])
{
    uint8_t one[CURVE_STATES][8];
    find_octants(one);
    for (int state = 0; state < CURVE_STATES; state++)
        for (int i = 0; i < 64; i++) {
            int outer = one[state][i / 8], inner = one[outer / 8][i % 8];
            curve[state][i] = (uint16_t)(inner / 8 * 64 + outer % 8 * 8 + inner % 8);
        }
}

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
    for (int shift = 32; shift < 32 + 3 * ORDER_BITS; shift += RADIX_BITS) {
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

static uint64_t place_of(const Sorting *to, const Box32 *b)
{
    const BoxTree *tree = to->tree;
    const double scale = tree->scale * (0.5 / (1 << (16 - ORDER_BITS)));
    uint64_t octants = 0, place = 0;
    for (int k = 0; k < 3; k++) octants |= spread_bits((uint64_t)((b->lo[k] - tree->origin[k] + (b->hi[k] - tree->origin[k])) * scale)) << k;
    for (int level = ORDER_BITS / 2, state = 0; level-- > 0;) {
        int next = to->curve[state][octants >> 6 * level & 63];
        place = place << 6 | (next & 63);
        state = next >> 6;
    }
    return place;
}

static void box_block(void *ctx, int begin, int end)
{
    Sorting *to = ctx;
    Box32 all = box32_none();
    for (int i = begin; i < end; i++) {
        to->box[i] = soup_box(to->soup, to->tree->tri[i]);
        box32_grow(&all, &to->box[i]);
    }
    to->block[begin / BOX_GRAIN] = all;
}

static void note_far(BoxTree *tree, const Box32 *b)
{
    for (int k = 0; k < 3; k++) tree->far = real_max(tree->far, real_max(fabs(b->lo[k]), fabs(b->hi[k])));
}

static void find_scale(BoxTree *tree, int nblock, const Box32 *block)
{
    double wide = 0;
    tree->all = box32_none();
    for (int b = 0; b < nblock; b++) box32_grow(&tree->all, &block[b]);
    for (int k = 0; k < 3; k++) {
        tree->origin[k] = tree->all.lo[k];
        wide = real_max(wide, tree->all.hi[k] - tree->origin[k]);
    }
    tree->scale = wide > 0 ? (MAX16 - MIN16) / wide : 0;
    note_far(tree, &tree->all);
}

static void key_block(void *ctx, int begin, int end)
{
    const Sorting *to = ctx;
    for (int i = begin; i < end; i++) to->key[i] = place_of(to, &to->box[i]) << 32 | (uint32_t)i;
}

static void sort_triangles(Sorting *to)
{
    BoxTree *tree = to->tree;
    uint64_t *other = NEW(uint64_t, tree->n), *sorted;
    int32_t *tri = NEW(int32_t, tree->n);
    parallel_for(tree->n, BOX_GRAIN, key_block, to);
    sorted = sort_keys(to->key, other, tree->n);
    if (sorted == other) other = to->key, to->key = sorted;
    for (int i = 0; i < tree->n; i++) tri[i] = tree->tri[(uint32_t)sorted[i]];
    mem_free(tree->tri);
    tree->tri = tri;
    mem_free(other);
}

/* --- the tree ------------------------------------------------------------------------------------------------------------ */

static void leaf_block(void *ctx, int begin, int end)
{
    const Sorting *to = ctx;
    BoxTree *tree = to->tree;
    for (int leaf = begin; leaf < end; leaf++) {
        Box32 all = box32_none();
        int n = int_min(ROW, tree->n - leaf * ROW);
        for (int i = 0; i < n; i++) {
            const Box32 *b = &to->box[(uint32_t)to->key[leaf * ROW + i]];
            box32_grow(&all, b);
            row16_set(&tree->leaf[leaf], i, box16_of(tree, b));
        }
        for (int i = n; i < ROW; i++) row16_set(&tree->leaf[leaf], i, box16_none());
        boxrow_set(&tree->level[0][leaf / ROW], leaf % ROW, all);
        tree->around[leaf] = box16_of(tree, &all);
    }
}

static void make_levels(BoxTree *tree)
{
    for (int below = tree->nleaf, n = 0; n != 1; below = n) {
        n = (below + ROW - 1) / ROW;
        BoxRow *row = tree->level[tree->nlevel++] = NEW(BoxRow, n);
        for (int i = below; i < n * ROW; i++) boxrow_set(&row[i / ROW], i % ROW, box32_none());
    }
}

/* All but the lowest. */
static void fill_levels(BoxTree *tree)
{
    int n = (tree->nleaf + ROW - 1) / ROW;
    for (int l = 1; l < tree->nlevel; l++, n = (n + ROW - 1) / ROW)
        for (int i = 0; i < n; i++) {
            Box32 all = box32_none();
            for (int k = 0; k < ROW; k++) {
                const Box32 b = boxrow_get(&tree->level[l - 1][i], k);
                box32_grow(&all, &b);
            }
            boxrow_set(&tree->level[l][i / ROW], i % ROW, all);
        }
}

void boxtree_build(BoxTree *tree, const TriSoup *s, const uint8_t *some)
{
    *tree = (BoxTree){.tri = NEW(int32_t, s->ntri)};
    for (int t = 0; t < s->ntri; t++)
        if (s->tri[3 * t] != NONE && (!some || some[t])) tree->tri[tree->n++] = t;
    if (tree->n == 0) return;
    int nblock = (tree->n + BOX_GRAIN - 1) / BOX_GRAIN;
    Sorting to = {s, tree, NEW(Box32, tree->n), NEW(Box32, nblock), NEW(uint64_t, tree->n), {{0}}};
    find_curve(to.curve);
    parallel_for(tree->n, BOX_GRAIN, box_block, &to);
    find_scale(tree, nblock, to.block);
    sort_triangles(&to);
    tree->nleaf = (tree->n + ROW - 1) / ROW;
    tree->leaf = NEW(Row16, tree->nleaf);
    tree->around = NEW(Box16, tree->nleaf);
    make_levels(tree);
    parallel_for(tree->nleaf, GRAIN, leaf_block, &to);
    fill_levels(tree);
    mem_free(to.box);
    mem_free(to.block);
    mem_free(to.key);
}

void boxtree_free(BoxTree *tree)
{
    mem_free(tree->tri);
    mem_free(tree->leaf);
    mem_free(tree->around);
    for (int l = 0; l < tree->nlevel; l++) mem_free(tree->level[l]);
    mem_free(tree->place);
    *tree = (BoxTree){0};
}

static void find_places(BoxTree *tree, int ntri)
{
    tree->place = NEW(int32_t, ntri);
    for (int i = 0; i < tree->n; i++) tree->place[tree->tri[i]] = i;
}

void boxtree_move(BoxTree *tree, const TriSoup *s, int t)
{
    if (!tree->place) find_places(tree, s->ntri);
    const Box32 box = soup_box(s, t);
    int i = tree->place[t] / ROW;
    row16_set(&tree->leaf[i], tree->place[t] % ROW, boxtree_box16(tree, &box));
    for (int l = 0; l < tree->nlevel; l++, i /= ROW) {
        Box32 around = boxrow_get(&tree->level[l][i / ROW], i % ROW);
        box32_grow(&around, &box);
        boxrow_set(&tree->level[l][i / ROW], i % ROW, around);
    }
    note_far(tree, &box);
}

/* --- walking over it ----------------------------------------------------------------------------------------------------- */

static void walk_enter(const BoxTree *tree, Walk *w, int level, int row)
{
    int first = w->from >> ROW_BITS * level;
    w->row[level] = row;
    w->hits[level] = boxrow_test(&tree->level[level][row], &w->box);
    if (row == first / ROW) w->hits[level] &= ~0u << first % ROW;
}

Walk walk_begin(const BoxTree *tree, Box32 box, int from)
{
    Walk w = {.box = box, .from = from, .depth = tree->nlevel - 1};
    walk_enter(tree, &w, w.depth, 0);
    return w;
}

int walk_next(const BoxTree *tree, Walk *w)
{
    for (;;) {
        while (!w->hits[w->depth])
            if (++w->depth == tree->nlevel) return NONE;
        int next = w->row[w->depth] * ROW + bits_next(&w->hits[w->depth]);
        if (w->depth == 0) return next;
        walk_enter(tree, w, --w->depth, next);
    }
}
