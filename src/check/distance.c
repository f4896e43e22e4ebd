/* distance.c: how far a mesh and the surface are from one another, both ways, over samples of each. */
#include "check/check_priv.h"

#include "base/hash.h"
#include "base/thread.h"

enum { GRAIN = 256 };
#define DENSITY 4.0         /* drawn samples a square voxel */
#define DRAWN_MOST 1e6      /* of a triangle */

/* --- samples -------------------------------------------------------------------------------------- */

typedef struct Samples {
    int n, cap;
    Vec3 *pos;
    double *weight, *dist;
} Samples;

static int samples_add(Samples *s, Vec3 p, double weight)
{
    if (s->n == s->cap) {
        s->cap = int_max(4096, 2 * s->cap);
        RESIZE(s->pos, s->cap);
        RESIZE(s->weight, s->cap);
    }
    s->pos[s->n] = p;
    s->weight[s->n] = weight;
    return s->n++;
}

static void samples_free(Samples *s)
{
    mem_free(s->pos);
    mem_free(s->weight);
    mem_free(s->dist);
}

/* The k-th number of triangle t, in [0, 1). */
static double draw(int t, int k) { return (double)(hash_mix(hash_mix(key_pair(t, k)) + 1) >> 11) * 0x1p-53; }

/* How many samples are drawn from triangle t: its area's share, rounded up as often as that is right on average. */
static int drawn_count(double area, double voxel, int t)
{
    double want = area / (voxel * voxel) * DENSITY;
    return want < DRAWN_MOST ? (int)(want + draw(t, 0)) : 0;
}

static Vec3 drawn_point(const Vec3 q[3], int t, int k)
{
    double s = sqrt(draw(t, 2 * k + 1)), r = draw(t, 2 * k + 2);
    return v_axpy(v_axpy(v_scale(q[0], 1 - s), s * (1 - r), q[1]), s * r, q[2]);
}

/* A triangle's area falls in equal shares to its corners, the middles of its edges, its own middle and the drawn samples.
 */
static void sample_mesh(const Ready *r, double voxel, Samples *out)
{
    const MeshStructure *m = &r->s;
    int nvert = r->mesh->nvert;
    for (int v = 0; v < nvert; v++) samples_add(out, r->pos[v], 0);
    for (int e = 0; e < m->nedge; e++) samples_add(out, v_mid(r->pos[m->edge[e][0]], r->pos[m->edge[e][1]]), 0);
    for (int t = 0; t < r->ntri; t++) {
        Vec3 q[3];
        for (int k = 0; k < 3; k++) q[k] = r->pos[r->tri[3 * t + k]];
        double area = 0.5 * v_len(v_area2(q[0], q[1], q[2]));
        int drawn = drawn_count(area, voxel, t);
        double share = area / (7 + drawn);
        for (int k = 0; k < 3; k++) {
            out->weight[r->tri[3 * t + k]] += share;
            out->weight[nvert + m->side_edge[3 * t + k]] += share;
        }
        samples_add(out, v_scale(v_add(q[0], v_add(q[1], q[2])), 1.0 / 3), share);
        for (int k = 0; k < drawn; k++) samples_add(out, drawn_point(q, t, k), share);
    }
}

typedef struct LandJob {
    const Field *field;
    Samples *samples;
    uint8_t *landed;
} LandJob;

static void land_block(void *ctx, int begin, int end)
{
    LandJob *job = ctx;
    for (int i = begin; i < end; i++) job->landed[i] = field_drop(job->field, &job->samples->pos[i], FOOT_SEEK_VOX * job->field->voxel);
}

static void land_samples(const Field *f, Samples *s)
{
    uint8_t *landed = NEW(uint8_t, s->n);
    int n = 0;
    parallel_for(s->n, GRAIN, land_block, &(LandJob){f, s, landed});
    for (int i = 0; i < s->n; i++) {
        if (!landed[i]) continue;
        s->pos[n] = s->pos[i];
        s->weight[n++] = s->weight[i];
    }
    s->n = n;
    mem_free(landed);
}

/* Points drawn from the reference and landed on the surface; its cut grid edges besides, for the extremes. */
static void sample_surface(const CheckSurface *s, Samples *out)
{
    for (int t = 0; t < s->tri.ntri; t++) {
        Vec3 q[3];
        for (int k = 0; k < 3; k++) q[k] = s->tri.pos[s->tri.tri[3 * t + k]];
        int drawn = drawn_count(0.5 * v_len(v_area2(q[0], q[1], q[2])), s->field->voxel, t);
        for (int k = 0; k < drawn; k++) samples_add(out, drawn_point(q, t, k), 1);
    }
    for (int e = 0; e < s->iso.nedge; e++) samples_add(out, affine_to_world(&s->field->xform, s->iso.edge_pos[e]), 0);
    land_samples(s->field, out);
}

/* --- measuring ------------------------------------------------------------------------------------ */

typedef struct Measure {
    const CheckSurface *surface;
    const ClosestIndex *mesh; /* NULL: distances to the surface */
    Samples *samples;
} Measure;

static void measure_block(void *ctx, int begin, int end)
{
    const Measure *m = ctx;
    for (int i = begin; i < end; i++) {
        Vec3 p = m->samples->pos[i];
        m->samples->dist[i] =
            m->mesh ? sqrt(closest_find(m->mesh, p).dist2) / m->surface->field->voxel : foot_distance_vox(m->surface, p);
    }
}

static void measure(const CheckSurface *surface, const ClosestIndex *mesh, Samples *samples)
{
    samples->dist = NEW(double, samples->n);
    parallel_for(samples->n, GRAIN, measure_block, &(Measure){surface, mesh, samples});
}

/* `first` is the mean; behind it come the percentiles and the greatest. */
static void tell(const Field *f, const Samples *samples, CheckFigure first, CheckRow *row)
{
    Spread s = {0};
    for (int i = 0; i < samples->n; i++)
        if (depth_of(f, samples->pos[i]) >= 0) spread_add(&s, samples->dist[i], samples->weight[i]);
    spread_sort(&s);
    row->value[first] = spread_mean(&s);
    row->value[first + 1] = spread_quantile(&s, 0.95);
    row->value[first + 2] = spread_quantile(&s, 0.99);
    row->value[first + 3] = spread_most(&s);
    spread_free(&s);
}

/* The first samples are the vertices. */
static int count_off(const Field *f, const Ready *r, const Samples *samples)
{
    int n = 0;
    for (int v = 0; v < r->mesh->nvert; v++)
        n += samples->weight[v] > 0 && samples->dist[v] > FOOT_NEAR_VOX && depth_of(f, r->pos[v]) >= 0;
    return n;
}

void measure_distances(const CheckSurface *surface, const Ready *r, CheckRow *row)
{
    Samples there = {0}, back = {0};
    ClosestIndex index;
    if (r->ntri == 0 || surface->tri.ntri == 0) return;
    sample_mesh(r, surface->field->voxel, &there);
    measure(surface, NULL, &there);
    tell(surface->field, &there, CHECK_TO_SURFACE_MEAN, row);
    row->value[CHECK_OFF_SURFACE] = count_off(surface->field, r, &there);
    samples_free(&there);

    closest_build(&index, r->ntri, r->pos, r->tri);
    sample_surface(surface, &back);
    measure(surface, &index, &back);
    tell(surface->field, &back, CHECK_FROM_SURFACE_MEAN, row);
    samples_free(&back);
    closest_free(&index);
}
