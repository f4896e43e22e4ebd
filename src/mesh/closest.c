#include "mesh/closest.h"

#include "mesh/nearest.h"

#include <math.h>
#include <stdlib.h>

enum { LEAF = 8, MORTON_BITS = 21 };

static void corners_of(const ClosestIndex *ix, int t, Vec3 q[3])
{
    for (int k = 0; k < 3; k++) q[k] = ix->pos[ix->tri[3 * t + k]];
}

/* --- the tree ------------------------------------------------------------------------------------- */

static const ClosestBox NOWHERE = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void box_add(ClosestBox *b, Vec3 lo, Vec3 hi)
{
    b->lo = vec3(real_min(b->lo.x, lo.x), real_min(b->lo.y, lo.y), real_min(b->lo.z, lo.z));
    b->hi = vec3(real_max(b->hi.x, hi.x), real_max(b->hi.y, hi.y), real_max(b->hi.z, hi.z));
}

typedef struct Placed {
    uint64_t key; /* along Morton's curve */
    int32_t tri;
} Placed;

static int compare_placed(const void *pa, const void *pb)
{
    const Placed *a = pa, *b = pb;
    return a->key != b->key ? (a->key < b->key ? -1 : 1) : a->tri - b->tri;
}

/* Every third bit. */
static uint64_t spread(uint64_t x)
{
    x = (x | x << 32) & 0x001f00000000ffff;
    x = (x | x << 16) & 0x001f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

static uint64_t morton(const ClosestBox *all, Vec3 p)
{
    uint64_t key = 0;
    for (int a = 0; a < 3; a++) {
        double lo = v_get(all->lo, a), side = v_get(all->hi, a) - lo, top = (1 << MORTON_BITS) - 1;
        double x = side > 0 ? (v_get(p, a) - lo) / side * top : 0;
        key |= spread((uint64_t)real_clamp(x, 0, top)) << a;
    }
    return key;
}

static void sort_triangles(ClosestIndex *ix)
{
    ClosestBox all = NOWHERE;
    Vec3 q[3];
    Placed *placed = NEW(Placed, ix->ntri);
    for (int h = 0; h < 3 * ix->ntri; h++) box_add(&all, ix->pos[ix->tri[h]], ix->pos[ix->tri[h]]);
    for (int t = 0; t < ix->ntri; t++) {
        corners_of(ix, t, q);
        placed[t] = (Placed){morton(&all, v_scale(v_add(q[0], v_add(q[1], q[2])), 1.0 / 3)), t};
    }
    qsort(placed, (size_t)ix->ntri, sizeof *placed, compare_placed);
    for (int t = 0; t < ix->ntri; t++) ix->order[t] = placed[t].tri;
    mem_free(placed);
}

void closest_build(ClosestIndex *ix, int ntri, const Vec3 *pos, const int32_t *tri)
{
    *ix = (ClosestIndex){.ntri = ntri, .pos = pos, .tri = tri, .leaves = 1};
    if (ntri == 0) return;
    while ((int64_t)ix->leaves * LEAF < ntri) ix->leaves *= 2;
    ix->order = NEW(int32_t, ntri);
    ix->box = NEW(ClosestBox, 2 * (size_t)ix->leaves);
    sort_triangles(ix);
    for (int i = 0; i < 2 * ix->leaves; i++) ix->box[i] = NOWHERE;
    for (int i = 0; i < ntri; i++) {
        Vec3 q[3];
        corners_of(ix, ix->order[i], q);
        for (int k = 0; k < 3; k++) box_add(&ix->box[ix->leaves + i / LEAF], q[k], q[k]);
    }
    for (int i = ix->leaves - 1; i > 0; i--) {
        ix->box[i] = ix->box[2 * i];
        box_add(&ix->box[i], ix->box[2 * i + 1].lo, ix->box[2 * i + 1].hi);
    }
}

void closest_free(ClosestIndex *ix)
{
    mem_free(ix->order);
    mem_free(ix->box);
    *ix = (ClosestIndex){0};
}

/* --- the search ----------------------------------------------------------------------------------- */

static double outside(double x, double lo, double hi) { return x < lo ? lo - x : x > hi ? x - hi : 0; }

/* Squared, from a point to a box; INFINITY for an empty one. */
static double distance_to_box(const ClosestBox *b, Vec3 p)
{
    return v_len2(vec3(outside(p.x, b->lo.x, b->hi.x), outside(p.y, b->lo.y, b->hi.y), outside(p.z, b->lo.z, b->hi.z)));
}

static void look_in_leaf(const ClosestIndex *ix, int leaf, Vec3 p, ClosestHit *best)
{
    for (int i = leaf * LEAF; i < int_min((leaf + 1) * LEAF, ix->ntri); i++) {
        Vec3 q[3];
        double w[3];
        int t = ix->order[i];
        corners_of(ix, t, q);
        triangle_nearest(p, q, w);
        Vec3 at = v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2]);
        double far = v_len2(v_sub(p, at));
        if (far < best->dist2 || best->tri == NONE) *best = (ClosestHit){t, at, far};
    }
}

ClosestHit closest_find(const ClosestIndex *ix, Vec3 p)
{
    ClosestHit best = {.tri = NONE, .dist2 = INFINITY};
    struct {
        int node;
        double dist2;
    } stack[64]; /* of each level at most one waits */
    int n = 0, node = 1;
    double dist2 = 0;
    if (ix->ntri == 0) return best;
    for (;;) {
        if (dist2 < best.dist2 && node < ix->leaves) {
            int near = 2 * node, far = near + 1;
            double dn = distance_to_box(&ix->box[near], p), df = distance_to_box(&ix->box[far], p);
            if (df < dn) {
                int i = near;
                double d = dn;
                near = far, dn = df;
                far = i, df = d;
            }
            stack[n].node = far;
            stack[n++].dist2 = df;
            node = near, dist2 = dn;
            continue;
        }
        if (dist2 < best.dist2) look_in_leaf(ix, node - ix->leaves, p, &best);
        if (n == 0) return best;
        node = stack[--n].node;
        dist2 = stack[n].dist2;
    }
}
