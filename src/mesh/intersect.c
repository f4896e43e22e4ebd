/* intersect.c: all pairs at once, from a tree of boxes. What meets a triangle's box are its neighbours as a rule: where these are
 * certain not to intersect it (star.h), they are counted alone, and only triangles that meet more are tested, pair by pair. Where only a
 * few are looked at, the tree holds these alone, and each of the others asks it. */
#include "mesh/intersect.h"

#include "base/thread.h"
#include "mesh/boxtree.h"
#include "mesh/orient.h"
#include "mesh/star.h"

#include <stdlib.h>
#include <string.h>

enum { GRAIN = 16, OTHERS_GRAIN = 1024, RUN = 16 };
enum { FEW = 8 }; /* fewer than one in so many are looked at */

typedef struct PairList {
    int n, cap;
    TriPair *pair;
} PairList;

struct PairSearch {
    TriSoup soup;
    const uint8_t *look;
    bool begun;            /* it was asked before */
    bool holds_all;        /* its tree does, not those alone that were looked at */
    BoxTree tree;
    uint16_t *looked;      /* [tree.nleaf] bits of those looked at */
    uint8_t *sure, *later; /* stars_find's, or NULL */
    int nask;
    int32_t *ask;          /* [nask] those looked at, of a tree that holds all */
    PairList *found;       /* a block */
};

/* --- a pair -------------------------------------------------------------------------------------------------------------- */

/* A triangle that is tested against others. */
typedef struct Tested {
    int t;
    const int32_t *v;
    int32_t sure[3];       /* its corners, NONE for those that are not sure */
    Vec3 p[3];
    double error;          /* of how far apart two points, its own or in the tree, are along a vector with components that sum up to 1 */
} Tested;

static void corners_of(const TriSoup *s, int t, Vec3 p[3])
{
    for (int k = 0; k < 3; k++) p[k] = s->pos[s->tri[3 * t + k]];
}

static Tested tested_of(const PairSearch *s, int t)
{
    Tested a = {.t = t, .v = s->soup.tri + 3 * t, .sure = {NONE, NONE, NONE}};
    double far = s->tree.far;
    corners_of(&s->soup, t, a.p);
    for (int k = 0; k < 3; k++) {
        if (s->sure && s->sure[a.v[k]]) a.sure[k] = a.v[k];
        far = real_max(far, real_max(real_max(fabs(a.p[k].x), fabs(a.p[k].y)), fabs(a.p[k].z)));
    }
    a.error = 16 * ORIENT_EPS * far;
    return a;
}

/* Along the line between their centroids one certainly ends before the other begins, but for the one corner that they may share. */
static bool are_apart(const Tested *a, const int32_t *v, const Vec3 q[3])
{
    const Vec3 d = v_sub(v_add(v_add(q[0], q[1]), q[2]), v_add(v_add(a->p[0], a->p[1]), a->p[2]));
    double end = -INFINITY, begin = INFINITY, x[3], y[3];
    int shared = NONE, n = 0;
    for (int k = 0; k < 3; k++) x[k] = v_dot(d, a->p[k]), y[k] = v_dot(d, q[k]);
    const double error = a->error * (fabs(d.x) + fabs(d.y) + fabs(d.z));
    for (int k = 0; k < 9; k++)
        if (a->v[k / 3] == v[k % 3]) shared = k, n++;
    if (n > 1) return false;
    for (int k = 0; k < 3; k++) {
        if (n == 0 || k != shared / 3) end = x[k] > end ? x[k] : end;
        if (n == 0 || k != shared % 3) begin = y[k] < begin ? y[k] : begin;
    }
    if (n == 0) return end < begin - error;
    return end < x[shared / 3] - error && begin > x[shared / 3] + error;
}

/* Their boxes meet. */
static void test_pair(const PairSearch *s, const Tested *a, int u, PairList *list)
{
    const int32_t *v = s->soup.tri + 3 * u;
    Vec3 q[3];
    int sure = 0;
    for (int k = 0; k < 3; k++) sure |= (a->sure[k] == v[0]) | (a->sure[k] == v[1]) | (a->sure[k] == v[2]);
    if (sure) return;
    corners_of(&s->soup, u, q);
    if (are_apart(a, v, q) || !triangles_intersect(a->v, a->p, v, q)) return;
    RESERVE(list->pair, list->cap, list->n + 1);
    list->pair[list->n++] = (TriPair){int_min(a->t, u), int_max(a->t, u)};
}

/* --- leaf by leaf -------------------------------------------------------------------------------------------------------- */

/* What the box of one of a leaf's triangles meets in a leaf. */
typedef struct Hits {
    int of, leaf;
    unsigned bits;
} Hits;

/* A leaf's triangles and all that their boxes meet behind them. */
typedef struct Query {
    int leaf;
    int count[ROW];
    int n, cap;
    Hits *hits;
} Query;

/* Of each pair one is looked at. */
static void query_leaf(const PairSearch *s, Query *q, int other)
{
    const BoxTree *tree = &s->tree;
    unsigned some = row16_test(&tree->leaf[q->leaf], &tree->around[other]);
    if (!s->looked[other]) some &= s->looked[q->leaf];
    RESERVE(q->hits, q->cap, q->n + ROW);
    while (some) {
        int k = bits_next(&some);
        const Box16 box = row16_get(&tree->leaf[q->leaf], k);
        unsigned bits = row16_test(&tree->leaf[other], &box);
        if (other == q->leaf) bits &= ~0u << k << 1;
        if (!(s->looked[q->leaf] >> k & 1)) bits &= s->looked[other];
        q->count[k] += bits_count(bits);
        q->hits[q->n] = (Hits){k, other, bits};
        q->n += bits != 0;
    }
}

/* The leaf against itself and those after it. */
static void query_tree(const PairSearch *s, Query *q, int leaf)
{
    const BoxTree *tree = &s->tree;
    memset(q->count, 0, sizeof q->count);
    q->leaf = leaf;
    q->n = 0;
    Walk w = walk_begin(tree, boxrow_get(&tree->level[0][leaf / ROW], leaf % ROW), leaf);
    for (int other; (other = walk_next(tree, &w)) != NONE;) query_leaf(s, q, other);
}

/* Those that do not meet as many as share a corner with them, for sure without intersecting them: all these meet. */
static unsigned find_suspects(const PairSearch *s, const Query *q)
{
    unsigned some = 0;
    for (int k = 0; k < ROW && q->leaf * ROW + k < s->tree.n; k++) {
        const uint8_t *later = s->later + 3 * (size_t)s->tree.tri[q->leaf * ROW + k];
        bool unsure = later[0] == LATER_UNSURE || later[1] == LATER_UNSURE || later[2] == LATER_UNSURE;
        if (unsure || later[0] + later[1] + later[2] != q->count[k]) some |= 1u << k;
    }
    return some;
}

/* Those of some of the leaf's triangles, pair by pair. */
static void test_hits(const PairSearch *s, const Query *q, unsigned some, PairList *list)
{
    const int32_t *tri = s->tree.tri;
    Tested tested[ROW];
    unsigned ready = 0;
    for (int i = 0; i < q->n; i++) {
        int k = q->hits[i].of;
        if (!(some >> k & 1)) continue;
        if (!(ready >> k & 1)) tested[k] = tested_of(s, tri[q->leaf * ROW + k]);
        ready |= 1u << k;
        for (unsigned bits = q->hits[i].bits; bits;) test_pair(s, &tested[k], tri[q->hits[i].leaf * ROW + bits_next(&bits)], list);
    }
}

static void search_block(void *ctx, int begin, int end)
{
    const PairSearch *s = ctx;
    Query q = {0};
    for (int leaf = begin; leaf < end; leaf++) {
        query_tree(s, &q, leaf);
        unsigned suspects = s->later ? find_suspects(s, &q) : ~0u;
        if (suspects) test_hits(s, &q, suspects, &s->found[begin / GRAIN]);
    }
    mem_free(q.hits);
}

/* --- one by one ---------------------------------------------------------------------------------------------------------- */

/* A triangle against all in the tree, but those up to itself that ask[...] too: from them the pair is found. */
static void test_one(const PairSearch *s, int t, const uint8_t *ask, PairList *list)
{
    const Box32 box = soup_box(&s->soup, t);
    const Box16 box16 = boxtree_box16(&s->tree, &box);
    Tested a = {.t = NONE};
    Walk w = walk_begin(&s->tree, box, 0);
    for (int leaf; (leaf = walk_next(&s->tree, &w)) != NONE;)
        for (unsigned hits = row16_test(&s->tree.leaf[leaf], &box16); hits;) {
            int u = s->tree.tri[leaf * ROW + bits_next(&hits)];
            if (ask && ask[u] && u <= t) continue;
            if (a.t == NONE) a = tested_of(s, t);
            test_pair(s, &a, u, list);
        }
}

static void ask_block(void *ctx, int begin, int end)
{
    const PairSearch *s = ctx;
    for (int i = begin; i < end; i++) test_one(s, s->ask[i], s->look, &s->found[begin / GRAIN]);
}

static bool is_other(const PairSearch *s, int t) { return !s->look[t] && s->soup.tri[3 * t] != NONE; }

/* Does a box around the others among some triangles meet the box of any that is looked at? */
static bool run_is_near(const PairSearch *s, int begin, int end)
{
    Box32 box = box32_none();
    for (int t = begin; t < end; t++) {
        if (!is_other(s, t)) continue;
        const Box32 b = soup_box(&s->soup, t);
        box32_grow(&box, &b);
    }
    const Box16 box16 = boxtree_box16(&s->tree, &box);
    Walk w = walk_begin(&s->tree, box, 0);
    for (int leaf; (leaf = walk_next(&s->tree, &w)) != NONE;)
        if (row16_test(&s->tree.leaf[leaf], &box16)) return true;
    return false;
}

/* The others in runs: triangles that follow one another mostly are neighbours, and far from the few that are looked at. */
static void others_block(void *ctx, int begin, int end)
{
    const PairSearch *s = ctx;
    for (int run = begin; run < end; run += RUN) {
        int run_end = int_min(run + RUN, end);
        if (!run_is_near(s, run, run_end)) continue;
        for (int t = run; t < run_end; t++)
            if (is_other(s, t)) test_one(s, t, NULL, &s->found[begin / OTHERS_GRAIN]);
    }
}

/* --- all together -------------------------------------------------------------------------------------------------------- */

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
static int search(PairSearch *s, int n, int grain, ParallelFn *fn, int count, TriPair **pair, int *cap)
{
    int blocks = (n + grain - 1) / grain;
    s->found = NEW0(PairList, blocks);
    parallel_for(n, grain, fn, s);
    for (int b = 0; b < blocks; b++) {
        PairList *list = &s->found[b];
        RESERVE(*pair, *cap, count + list->n);
        if (list->n) memcpy(*pair + count, list->pair, (size_t)list->n * sizeof **pair);
        count += list->n;
        mem_free(list->pair);
    }
    mem_free(s->found);
    return count;
}

static bool is_looked_at(const PairSearch *s, int t) { return s->soup.tri[3 * t] != NONE && (!s->look || s->look[t]); }

static void forget_stars(PairSearch *s)
{
    mem_free(s->sure);
    mem_free(s->later);
    s->sure = s->later = NULL;
}

/* Those looked at have moved in a tree that holds all; they ask it, each for itself. */
static int search_again(PairSearch *s, TriPair **pair, int *cap)
{
    forget_stars(s);
    s->ask = NEW(int32_t, s->soup.ntri);
    s->nask = 0;
    for (int t = 0; t < s->soup.ntri; t++)
        if (is_looked_at(s, t)) s->ask[s->nask++] = t;
    for (int i = 0; i < s->nask; i++) boxtree_move(&s->tree, &s->soup, s->ask[i]);
    int n = search(s, s->nask, GRAIN, ask_block, 0, pair, cap);
    mem_free(s->ask);
    return n;
}

static int search_anew(PairSearch *s, TriPair **pair, int *cap)
{
    BoxTree *tree = &s->tree;
    boxtree_free(tree);
    forget_stars(s);
    boxtree_build(tree, &s->soup, s->holds_all ? NULL : s->look);
    s->looked = NEW0(uint16_t, tree->nleaf);
    for (int i = 0; i < tree->n; i++) s->looked[i / ROW] |= (uint16_t)(is_looked_at(s, tree->tri[i]) << i % ROW);
    if (s->holds_all) {
        s->sure = NEW(uint8_t, soup_nvert(&s->soup));
        s->later = NEW(uint8_t, 3 * (size_t)s->soup.ntri);
        stars_find(&s->soup, tree->n, tree->tri, s->look, s->sure, s->later);
    }
    int n = search(s, tree->nleaf, GRAIN, search_block, 0, pair, cap);
    mem_free(s->looked);
    return s->holds_all || !tree->n ? n : search(s, s->soup.ntri, OTHERS_GRAIN, others_block, n, pair, cap);
}

/* Are not only a few looked at? */
static bool are_many(const PairSearch *s)
{
    int living = 0, looked = 0;
    for (int t = 0; t < s->soup.ntri; t++) {
        living += s->soup.tri[3 * t] != NONE;
        looked += is_looked_at(s, t);
    }
    return looked > living / FEW;
}

PairSearch *pair_search_begin(const TriSoup *soup)
{
    PairSearch *s = NEW0(PairSearch, 1);
    s->soup = *soup;
    return s;
}

int pair_search_find(PairSearch *s, const uint8_t *look, TriPair **pair, int *cap)
{
    s->look = look;
    bool many = are_many(s), again = s->holds_all && !many;
    s->holds_all = many || s->begun;
    s->begun = true;
    int n = again ? search_again(s, pair, cap) : search_anew(s, pair, cap);
    pairs_sort(n, *pair);
    return n;
}

void pair_search_end(PairSearch *s)
{
    boxtree_free(&s->tree);
    forget_stars(s);
    mem_free(s);
}

int intersect_find(const TriSoup *soup, const uint8_t *look, TriPair **pair, int *cap)
{
    PairSearch *s = pair_search_begin(soup);
    int n = pair_search_find(s, look, pair, cap);
    pair_search_end(s);
    return n;
}
