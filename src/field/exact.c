/* exact.c: landings and gradients by the function that the samples were taken from, where it is known.
 *
 * The trilinear surface decides what is there: a point lands on it first, and goes on to F = 0 only where that leads to a
 * cell it crosses, on the same side of a sheet, not far away. Else the trilinear landing stands: the surface's topology is
 * that of the samples, whatever the function does between them. */
#include "field/field_priv.h"

enum { STEPS = 16, CHUNK = 32 };
#define REACH_VOX 1.0     /* between the two landings: samples cut off ridges by less */
#define STEP_VOX 0.25     /* a Newton step's length */
#define DONE_VOX 1e-10    /* to first order, from F = 0 */
#define GOOD_VOX 1e-5     /* what is accepted when steps run out, as on ridges */

/* Beyond the bounding box the samples close the surface, and the function knows nothing of that. */
static bool is_within(const Field *f, Vec3 p)
{
    Vec3 q = affine_to_index(&f->xform, p);
    return q.x >= f->lo[0] && q.x <= f->hi[0] && q.y >= f->lo[1] && q.y <= f->hi[1] && q.z >= f->lo[2] && q.z <= f->hi[2];
}

bool exact_is_known(const Field *f, Vec3 p) { return f->exact.sample && is_within(f, p); }

static bool is_crossed(const Field *f, Vec3 p)
{
    Spot s;
    if (!field_locate(f, p, &s)) return false;
    int inside = 0;
    for (int c = 0; c < 8; c++) inside += f->sign * ((double)s.v[(c & 1) + BRICK_SPAN * (c >> 1 & 1) + BRICK_SPAN * BRICK_SPAN * (c >> 2)] - f->iso) > 0;
    return inside > 0 && inside < 8;
}

/* May a point that landed at `on` stand at p, where the function's gradient is g? As written, in float32. */
static bool is_fit(const Field *f, Vec3 on, Vec3 p, Vec3 g)
{
    Vec3 q = v_round32(p);
    return v_dist(p, on) <= REACH_VOX * f->voxel && is_within(f, q) && is_crossed(f, q) && v_dot(g, field_steer(f, on)) > 0;
}

typedef struct Walk {
    int n;              /* points still on their way */
    int which[CHUNK];
    Vec3 at[CHUNK], grad[CHUNK];
    double F[CHUNK];
    const Vec3 *on;     /* [] the trilinear landings */
    Vec3 *to;           /* [] where points come to stand */
    bool *landed;       /* [] */
} Walk;

/* One Newton step of all; those that are there, or lost, leave. */
static void walk_on(const Field *f, Walk *w, bool last)
{
    int left = 0;
    f->exact.sample(f->exact.ctx, w->n, w->at, w->F, w->grad);
    for (int k = 0; k < w->n; k++) {
        int i = w->which[k];
        double g = v_len(w->grad[k]), off = fabs(w->F[k]) / g;
        if (!(g > 0) || v_dist(w->at[k], w->on[i]) > 2 * REACH_VOX * f->voxel) continue;
        if (off <= (last ? GOOD_VOX : DONE_VOX) * f->voxel) {
            w->landed[i] = is_fit(f, w->on[i], w->at[k], w->grad[k]);
            if (w->landed[i]) w->to[i] = w->at[k];
            continue;
        }
        double step = real_min(off, STEP_VOX * f->voxel) / g;
        w->at[left] = v_axpy(w->at[k], w->F[k] > 0 ? -step : step, w->grad[k]);
        w->which[left++] = i;
    }
    w->n = left;
}

static void walk(const Field *f, Walk *w)
{
    for (int k = 0; w->n > 0 && k <= STEPS; k++) walk_on(f, w, k == STEPS);
}

static void land_chunk(const Field *f, int n, const Vec3 *from, Vec3 *p, const uint8_t *status)
{
    Vec3 on[CHUNK];
    bool landed[CHUNK] = {false};
    Walk w = {.on = on, .to = p, .landed = landed};
    for (int i = 0; i < n; i++) {
        on[i] = p[i];
        if (status[i] != LANDED || v_dist(from[i], p[i]) > REACH_VOX * f->voxel) continue;
        w.at[w.n] = from[i];
        w.which[w.n++] = i;
    }
    walk(f, &w);
    for (int i = 0; i < n; i++) {
        if (status[i] != LANDED || landed[i]) continue;
        w.at[w.n] = on[i];
        w.which[w.n++] = i;
    }
    walk(f, &w);
}

void exact_land(const Field *f, int n, const Vec3 *from, Vec3 *p, const uint8_t *status)
{
    for (int i = 0; i < n; i += CHUNK) land_chunk(f, int_min(CHUNK, n - i), from + i, p + i, status + i);
}

void exact_sample(const Field *f, int n, const Vec3 *p, double *F, Vec3 *grad)
{
    for (int begin = 0; begin < n; begin += CHUNK) {
        Vec3 at[CHUNK], g[CHUNK];
        double value[CHUNK];
        int which[CHUNK], m = 0;
        for (int i = begin; i < int_min(n, begin + CHUNK); i++) {
            if (!is_within(f, p[i]) || v_len2(grad[i]) == 0) continue; /* where the samples are not known, F is not */
            at[m] = p[i];
            which[m++] = i;
        }
        f->exact.sample(f->exact.ctx, m, at, value, g);
        for (int k = 0; k < m; k++) {
            if (!(v_len2(g[k]) > 0)) continue;
            F[which[k]] = value[k];
            grad[which[k]] = g[k];
        }
    }
}
