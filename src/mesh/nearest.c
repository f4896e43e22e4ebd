#include "mesh/nearest.h"

#include <math.h>
#include <string.h>

#define CELL_LIMIT 1048574.0 /* cells beyond it share one: slow, not wrong */

void triangle_nearest(Vec3 p, const Vec3 q[3], double w[3])
{
    Vec3 n = v_area2(q[0], q[1], q[2]);
    double area2 = v_len2(n), best = INFINITY;
    if (area2 > 0) {
        for (int k = 0; k < 3; k++) w[k] = v_dot(n, v_area2(p, q[(k + 1) % 3], q[(k + 2) % 3])) / area2;
        if (w[0] >= 0 && w[1] >= 0 && w[2] >= 0) return;
    }
    double out[3] = {1, 0, 0};
    for (int k = 0; k < 3; k++) {
        int i = k, j = (k + 1) % 3;
        Vec3 d = v_sub(q[j], q[i]);
        double l2 = v_len2(d), t = l2 > 0 ? real_clamp(v_dot(v_sub(p, q[i]), d) / l2, 0, 1) : 0, far = v_len2(v_sub(p, v_axpy(q[i], t, d)));
        if (!(far < best)) continue;
        best = far;
        out[i] = 1 - t, out[j] = t, out[(k + 2) % 3] = 0;
    }
    memcpy(w, out, sizeof out);
}

static int cell_of(const NearestIndex *ix, double x) { return (int)real_clamp(floor(x / ix->cell), -CELL_LIMIT, CELL_LIMIT); }

static void corners_of(const NearestIndex *ix, int t, Vec3 q[3])
{
    for (int k = 0; k < 3; k++) q[k] = ix->pos[ix->tri[3 * t + k]];
}

/* The cells that a triangle's box touches. */
static void span_of(const NearestIndex *ix, int t, int lo[3], int hi[3])
{
    Vec3 q[3];
    corners_of(ix, t, q);
    for (int a = 0; a < 3; a++) {
        double x = v_get(q[0], a), y = v_get(q[1], a), z = v_get(q[2], a);
        lo[a] = cell_of(ix, real_min(x, real_min(y, z)));
        hi[a] = cell_of(ix, real_max(x, real_max(y, z)));
    }
}

enum { SPAN_MAX = 64 }; /* cells of a triangle */

static bool is_small(const int lo[3], const int hi[3])
{
    return ((int64_t)hi[0] - lo[0] + 1) * ((int64_t)hi[1] - lo[1] + 1) * ((int64_t)hi[2] - lo[2] + 1) <= SPAN_MAX;
}

/* Goes through the cells of all triangles: counts, or with `fill` files them. */
static void file_triangles(NearestIndex *ix, int32_t *fill, int *cap)
{
    for (int t = 0; t < ix->ntri; t++) {
        int lo[3], hi[3];
        if (ix->tri[3 * t] == NONE) continue;
        span_of(ix, t, lo, hi);
        if (!is_small(lo, hi)) continue;
        for (int z = lo[2]; z <= hi[2]; z++)
            for (int y = lo[1]; y <= hi[1]; y++)
                for (int x = lo[0]; x <= hi[0]; x++) {
                    int c = map_put(&ix->at, key_coord(x, y, z), ix->at.count);
                    if (fill) {
                        ix->member[fill[c]++] = t;
                        continue;
                    }
                    if (c + 2 > *cap) {
                        int was = *cap;
                        RESERVE(ix->first, *cap, c + 2);
                        memset(ix->first + was, 0, (size_t)(*cap - was) * sizeof *ix->first);
                    }
                    ix->first[c + 1]++;
                }
    }
}

void nearest_build(NearestIndex *ix, int ntri, const Vec3 *pos, const int32_t *tri, double reach)
{
    ASSERT(reach > 0);
    *ix = (NearestIndex){.ntri = ntri, .pos = pos, .tri = tri, .cell = reach};
    map_init(&ix->at, ntri);
    int cap = 0;
    file_triangles(ix, NULL, &cap);
    int cells = ix->at.count;
    if (cells == 0) return;
    for (int c = 0; c < cells; c++) ix->first[c + 1] += ix->first[c];
    ix->member = NEW(int32_t, ix->first[cells]);
    int32_t *fill = NEW(int32_t, cells);
    memcpy(fill, ix->first, (size_t)cells * sizeof *fill);
    file_triangles(ix, fill, &cap);
    mem_free(fill);
}

void nearest_free(NearestIndex *ix)
{
    map_free(&ix->at);
    mem_free(ix->first);
    mem_free(ix->member);
    *ix = (NearestIndex){0};
}

static void look_at(const NearestIndex *ix, int t, Vec3 p, Vec3 n, NearestHit *best)
{
    Vec3 q[3];
    double w[3];
    corners_of(ix, t, q);
    if (!(v_dot(v_area2(q[0], q[1], q[2]), n) > 0)) return;
    triangle_nearest(p, q, w);
    double far = v_len2(v_sub(p, v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2])));
    if (far < best->dist2 || (far == best->dist2 && t < best->tri)) *best = (NearestHit){t, {w[0], w[1], w[2]}, far};
}

NearestHit nearest_find(const NearestIndex *ix, Vec3 p, Vec3 n)
{
    NearestHit best = {.tri = NONE, .dist2 = ix->cell * ix->cell};
    int at[3] = {cell_of(ix, p.x), cell_of(ix, p.y), cell_of(ix, p.z)};
    for (int k = 0; k < 27; k++) {
        int c = map_get(&ix->at, key_coord(at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1));
        for (int i = c == NONE ? 0 : ix->first[c]; c != NONE && i < ix->first[c + 1]; i++) look_at(ix, ix->member[i], p, n, &best);
    }
    return best;
}
