/* untangle.c: refined triangles that run through one another. */
#include "refine/refine.h"

#include "mesh/intersect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS_MAX = 12 };
#define HAIR 0.01 /* of the way to where it landed */

/* How far down a vertex was brought: not at all, from where it was lifted to where it landed, and a midpoint from there to the middle
 * of its edge, which adds nothing to what the coarser triangle was. */
enum { STAYS, LANDS, LIES_FLAT };

/* Ends come before their midpoints, so that one sweep in order settles all. */
static void bring_down(RefinedMesh *m, const Vec3 *landed, const uint8_t *down, uint8_t *moved)
{
    for (int v = 0; v < m->nvert; v++) {
        if (down[v] == STAYS) continue;
        Vec3 p = down[v] == LANDS ? landed[v] : v_round32(v_mid(m->pos[m->ends[v][0]], m->pos[m->ends[v][1]]));
        if (v_len2(v_sub(p, m->pos[v])) == 0) continue;
        m->pos[v] = p;
        moved[v] = 1;
    }
}

/* Marks the vertices of the triangles in the pairs: those that are lifted, to land; where none is, the midpoints, to lie flat. False:
 * there was none left to mark. */
static bool mark_down(const RefinedMesh *m, const Vec3 *landed, int npair, const TriPair *pair, uint8_t *down)
{
    bool any = false;
    for (int step = LANDS; step <= LIES_FLAT && !any; step++)
        for (int i = 0; i < npair; i++)
            for (int k = 0; k < 6; k++) {
                int v = m->tri[3 * (k < 3 ? pair[i].a : pair[i].b) + k % 3];
                bool can = step == LANDS ? v_len2(v_sub(m->pos[v], landed[v])) > 0 : m->ends[v][0] != NONE;
                if (down[v] >= step || !can) continue;
                down[v] = (uint8_t)step;
                any = true;
            }
    return any;
}

/* How far down vertex v can be brought. */
static int lowest(const RefinedMesh *m, const Vec3 *landed, int v)
{
    return m->ends[v][0] != NONE ? LIES_FLAT : v_len2(v_sub(m->pos[v], landed[v])) > 0 ? LANDS : STAYS;
}

/* Marks all vertices of the mechanical triangles top[...]: the midpoints to lie flat, and corners to land, or they would not. */
static bool mark_parents(const RefinedMesh *m, const Vec3 *landed, const uint8_t *top, uint8_t *down)
{
    bool any = false;
    for (int t = 0; t < m->ntri; t++)
        for (int k = 0; k < 3 && top[m->parent[t]]; k++) {
            int v = m->tri[3 * t + k], low = lowest(m, landed, v);
            if (down[v] >= low) continue;
            down[v] = (uint8_t)low;
            any = true;
        }
    return any;
}

/* A triangle with only some of its midpoints flat may be turned over: its parent's are all to be. top[...] is set for these. */
static void find_turned(const RefinedMesh *m, const Field *field, const uint8_t *look, uint8_t *top)
{
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->tri + 3 * t;
        if (look[t] && field_triangle_inverted(field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]])) top[m->parent[t]] = 1;
    }
}

static void look_around(const RefinedMesh *m, const uint8_t *moved, uint8_t *look)
{
    for (int t = 0; t < m->ntri; t++) look[t] = moved[m->tri[3 * t]] | moved[m->tri[3 * t + 1]] | moved[m->tri[3 * t + 2]];
}

/* A midpoint in the middle of its edge may meet the corner of a flat triangle there: a hair above it both have an area. */
static void give_area(RefinedMesh *m, const Vec3 *landed, const uint8_t *down)
{
    for (int h = 0; h < 3 * m->ntri; h++) {
        const int32_t *c = m->tri + h - h % 3;
        int v = m->tri[h];
        if (down[v] != LIES_FLAT || v_len2(v_area2(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]])) > 0) continue;
        m->pos[v] = v_round32(v_mix(m->pos[v], landed[v], HAIR));
    }
}

/* All pairs: those of mechanical triangles that are what they were are known. look[m->ntri] is scratch. */
static int find_pairs(const RefinedMesh *m, const Vec3 *landed, const Crossings *mech, int ntop, PairSearch *search, uint8_t *look,
                      TriPair **pair, int *cap)
{
    int32_t *same = NEW(int32_t, ntop);
    for (int t = 0; t < ntop; t++) same[t] = NONE;
    for (int t = 0; t < m->ntri; t++) {
        look[t] = 0;
        for (int k = 0; k < 3; k++) {
            int v = m->tri[3 * t + k];
            look[t] |= m->ends[v][0] != NONE || v_len2(v_sub(m->pos[v], landed[v])) > 0;
        }
        if (!look[t]) same[m->parent[t]] = t;
    }
    int n = pair_search_find(search, look, pair, cap);
    for (int i = 0; i < mech->n; i++) {
        int a = same[mech->pair[i].a], b = same[mech->pair[i].b];
        if (a == NONE || b == NONE) continue;
        RESERVE(*pair, *cap, n + 1);
        (*pair)[n++] = (TriPair){int_min(a, b), int_max(a, b)};
    }
    mem_free(same);
    pairs_sort(n, *pair);
    return n;
}

/* By so many of the steps that float32 has there, along the axis nearest to n; up where n is above 0. */
static Vec3 nudged(Vec3 p, Vec3 n, int steps)
{
    int axis = fabs(n.x) > fabs(n.y) && fabs(n.x) > fabs(n.z) ? 0 : fabs(n.y) > fabs(n.z) ? 1 : 2;
    float x = (float)v_get(p, axis), end = (v_get(n, axis) > 0) == (steps > 0) ? INFINITY : -INFINITY;
    for (int k = 0; k < abs(steps); k++) x = nextafterf(x, end);
    v_set(&p, axis, x);
    return p;
}

/* Where mechanical triangles all but touch, the rounding of midpoints that lie flat may let their pieces run through one another: those
 * midpoints go the least that there is outward or inward, where that leaves fewer of the pairs. Returns how many. */
static int nudge_apart(RefinedMesh *m, const uint8_t *down, PairSearch *search, uint8_t *look, int left, TriPair **pair, int *cap)
{
    static const int STEPS[] = {1, -1, 2, -2, 4, -4};
    enum { TRIALS = sizeof STEPS / sizeof *STEPS };
    Vec3 *was = NEW(Vec3, m->nvert);
    uint8_t *moved = NEW0(uint8_t, m->nvert);
    int least = left, best = 0;
    bool any = false;
    memcpy(was, m->pos, (size_t)m->nvert * sizeof *was);
    for (int i = 0; i < left; i++)
        for (int k = 0; k < 3; k++) {
            int a = m->tri[3 * (*pair)[i].a + k], b = m->tri[3 * (*pair)[i].b + k];
            moved[a] = down[a] == LIES_FLAT;
            moved[b] = down[b] == LIES_FLAT;
            any = any || moved[a] || moved[b];
        }
    look_around(m, moved, look);
    for (int i = 0; i < left; i++) look[(*pair)[i].a] = look[(*pair)[i].b] = 1;
    for (int i = 0; i <= TRIALS && left > 0 && any; i++) {
        int steps = i < TRIALS ? STEPS[i] : best; /* the best again, if none was good */
        for (int v = 0; v < m->nvert; v++)
            if (moved[v]) m->pos[v] = nudged(was[v], m->normal[v], steps);
        left = pair_search_find(search, look, pair, cap);
        if (left < least) least = left, best = steps;
    }
    mem_free(was);
    mem_free(moved);
    return left;
}

int refine_untangle(RefinedMesh *m, const Field *field, const Vec3 *landed, const Crossings *mech, int *flattened)
{
    TriPair *pair = NULL;
    int cap = 0, left, ntop = 0;
    *flattened = 0;
    if (m->ntri == 0) return 0;
    for (int t = 0; t < m->ntri; t++) ntop = int_max(ntop, m->parent[t] + 1);
    ASSERT(ntop <= mech->ntri);
    Vec3 *own = NULL;
    if (!landed) {
        own = NEW(Vec3, m->nvert);
        memcpy(own, m->pos, (size_t)m->nvert * sizeof *own);
        landed = own;
    }
    uint8_t *down = NEW0(uint8_t, m->nvert), *moved = NEW(uint8_t, m->nvert), *look = NEW(uint8_t, m->ntri), *top = NEW(uint8_t, ntop);
    PairSearch *search = pair_search_begin(&(TriSoup){m->ntri, m->pos, m->tri});
    left = find_pairs(m, landed, mech, ntop, search, look, &pair, &cap);
    bool more = mark_down(m, landed, left, pair, down);
    for (int round = 0; (more || left) && round < ROUNDS_MAX; round++) {
        memset(moved, 0, (size_t)m->nvert);
        memset(top, 0, (size_t)ntop);
        bring_down(m, landed, down, moved);
        look_around(m, moved, look);
        find_turned(m, field, look, top);
        for (int i = 0; i < left; i++) look[pair[i].a] = look[pair[i].b] = 1; /* of one that is left over, one at least stays marked */
        left = pair_search_find(search, look, &pair, &cap);
        more = mark_down(m, landed, left, pair, down);
        for (int i = 0; i < left && !more; i++) top[m->parent[pair[i].a]] = top[m->parent[pair[i].b]] = 1;
        more = mark_parents(m, landed, top, down) || more;
        if (!more) break;
    }
    if (left) left = nudge_apart(m, down, search, look, left, &pair, &cap);
    give_area(m, landed, down);
    for (int v = 0; v < m->nvert; v++) {
        *flattened += down[v] == LIES_FLAT;
        if (down[v] != STAYS && !own) field_normals(field, 1, &landed[v], &m->normal[v]); /* not that of where it was lifted to */
    }
    pair_search_end(search);
    mem_free(own);
    mem_free(pair);
    mem_free(down);
    mem_free(moved);
    mem_free(look);
    mem_free(top);
    return left;
}
