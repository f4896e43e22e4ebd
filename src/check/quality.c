#include "check/check_priv.h"

#include "base/thread.h"

enum { GRAIN = 1024 };
#define DEGREES 57.29577951308232
#define UNIT_ERROR 1e-3

/* --- triangles and edges -------------------------------------------------------------------------- */

/* The angle across the side of squared length l2 between sides of u and w. */
static double angle_deg(double l2, double u, double w)
{
    return acos(real_clamp((u + w - l2) / (2 * sqrt(u * w)), -1, 1)) * DEGREES;
}

/* At the corner across the shortest side. */
static double least_angle_deg(const double l2[3])
{
    int s = l2[0] <= l2[1] && l2[0] <= l2[2] ? 0 : l2[1] <= l2[2] ? 1 : 2;
    return l2[s] > 0 ? angle_deg(l2[s], l2[(s + 1) % 3], l2[(s + 2) % 3]) : 0;
}

/* 2 r_in / r_circ = 16 A^2 / (a b c (a + b + c)). */
static double aspect_of(const double l2[3], double area)
{
    double a = sqrt(l2[0]), b = sqrt(l2[1]), c = sqrt(l2[2]), q = a * b * c * (a + b + c);
    return q > 0 ? 16 * area * area / q : 0;
}

static void measure_triangles(const Ready *r, CheckRow *row)
{
    Spread angle = {0}, aspect = {0};
    for (int t = 0; t < r->ntri; t++) {
        Vec3 p[3];
        double l2[3];
        for (int k = 0; k < 3; k++) p[k] = r->pos[r->tri[3 * t + k]];
        for (int k = 0; k < 3; k++) l2[k] = v_len2(v_sub(p[(k + 1) % 3], p[k]));
        spread_add(&angle, least_angle_deg(l2), 1);
        spread_add(&aspect, aspect_of(l2, 0.5 * v_len(v_area2(p[0], p[1], p[2]))), 1);
    }
    spread_sort(&angle);
    spread_sort(&aspect);
    row->value[CHECK_MIN_ANGLE_LEAST] = spread_quantile(&angle, 0);
    row->value[CHECK_MIN_ANGLE_P5] = spread_quantile(&angle, 0.05);
    row->value[CHECK_MIN_ANGLE_P50] = spread_quantile(&angle, 0.5);
    row->value[CHECK_ASPECT_P5] = spread_quantile(&aspect, 0.05);
    row->value[CHECK_ASPECT_P50] = spread_quantile(&aspect, 0.5);
    spread_free(&angle);
    spread_free(&aspect);
}

static void measure_edges(const CheckSettings *set, double voxel, const Ready *r, CheckRow *row)
{
    double sum = 0, *length = NEW(double, r->s.nedge);
    int n = r->s.nedge, odd = 0;
    for (int e = 0; e < n; e++) sum += length[e] = v_dist(r->pos[r->s.edge[e][0]], r->pos[r->s.edge[e][1]]);
    double mean = n ? sum / n : NAN, aim = set->edge > 0 ? set->edge * (set->edge_in_voxels ? voxel : 1) : mean;
    for (int e = 0; e < n; e++) odd += !(length[e] >= 0.5 * aim && length[e] <= 2 * aim);
    row->value[CHECK_EDGE_MEAN] = mean;
    row->value[CHECK_EDGES_ODD] = n ? (double)odd / n : NAN;
    mem_free(length);
}

void measure_quality(const CheckSettings *set, const Field *f, const Ready *r, CheckRow *row)
{
    measure_triangles(r, row);
    measure_edges(set, f->voxel, r, row);
}

/* --- normals -------------------------------------------------------------------------------------- */

typedef struct InvertedJob {
    const Field *field;
    const Ready *r;
    int *count; /* a block */
} InvertedJob;

static void inverted_block(void *ctx, int begin, int end)
{
    InvertedJob *job = ctx;
    int n = 0;
    for (int t = begin; t < end; t++) {
        const int32_t *v = job->r->tri + 3 * (size_t)t;
        n += field_triangle_inverted(job->field, job->r->pos[v[0]], job->r->pos[v[1]], job->r->pos[v[2]]);
    }
    job->count[begin / GRAIN] = n;
}

static int count_inverted(const Field *f, const Ready *r)
{
    int n = 0, blocks = (r->ntri + GRAIN - 1) / GRAIN, *count = NEW0(int, blocks);
    parallel_for(r->ntri, GRAIN, inverted_block, &(InvertedJob){f, r, count});
    for (int b = 0; b < blocks; b++) n += count[b];
    mem_free(count);
    return n;
}

static bool has_normals(const TriMesh *m)
{
    for (size_t i = 0; i < 3 * (size_t)m->nvert; i++)
        if (m->normal[i] != 0) return true;
    return false;
}

/* Against the outward gradient; a voxel within the bounding box, where central differences see samples alone. */
static void measure_angles(const Field *f, const Ready *r, CheckRow *row)
{
    Spread off = {0};
    int odd = 0, n = r->mesh->nvert;
    uint8_t *used = NEW0(uint8_t, n);
    for (int h = 0; h < 3 * r->ntri; h++) used[r->tri[h]] = 1;
    for (int v = 0; v < n; v++) {
        Vec3 normal = place_of(r->mesh->normal, v);
        odd += !(fabs(v_len(normal) - 1) < UNIT_ERROR);
        if (!used[v] || depth_of(f, r->pos[v]) < 1) continue;
        Vec3 out = v_scale(field_gradient(f, r->pos[v]), -1);
        if (v_len2(out) > 0) spread_add(&off, atan2(v_len(v_cross(normal, out)), v_dot(normal, out)) * DEGREES, 1);
    }
    spread_sort(&off);
    row->value[CHECK_NORMALS_P50] = spread_quantile(&off, 0.5);
    row->value[CHECK_NORMALS_P95] = spread_quantile(&off, 0.95);
    row->value[CHECK_NORMALS_ODD] = odd;
    spread_free(&off);
    mem_free(used);
}

void measure_normals(const Field *f, const Ready *r, CheckRow *row)
{
    row->value[CHECK_INVERTED] = count_inverted(f, r);
    if (has_normals(r->mesh)) measure_angles(f, r, row);
}
