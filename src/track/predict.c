/* predict.c: last frame's points on this frame's surface. */
#include "track/track_priv.h"

#include "base/thread.h"

enum { GRAIN = 256, ADVECT_STEPS = 4 /* at most */, BLENDS_MAX = 8 };
#define BLEND_MOTION_VOX 0.7 /* a blended field is at most about this far from the last */
#define REACH_EDGES 1.5      /* a landing is at most this far away, in edges wanted */

/* Velocity linear in time between the two frames' grids; t from 0 to 1. */
static Vec3 velocity_at(const Track *tr, Vec3 p, double t)
{
    Vec3 b = grid_vector(tr->velocity, p);
    return tr->last_velocity ? v_mix(grid_vector(tr->last_velocity, p), b, t) : b;
}

/* Steps so small that none goes farther than about a voxel. */
static int steps_for(const Track *tr, Vec3 velocity)
{
    return 1 + (int)real_min(v_len(velocity) * tr->span_s / tr->field->voxel, ADVECT_STEPS - 1);
}

Vec3 track_advect(const Track *tr, Vec3 p)
{
    if (!tr->velocity) return p;
    Vec3 v = velocity_at(tr, p, 0);
    const int steps = steps_for(tr, v);
    const double dt = tr->span_s / steps;
    for (int k = 0; k < steps; k++) { /* second-order Runge-Kutta: the midpoint's velocity */
        if (k > 0) v = velocity_at(tr, p, (double)k / steps);
        p = v_axpy(p, dt, velocity_at(tr, v_axpy(p, 0.5 * dt, v), (k + 0.5) / steps));
    }
    return p;
}

typedef struct AdvectJob {
    const Track *tr;
    Vec3 *p;
} AdvectJob;

static void advect_block(void *ctx, int begin, int end)
{
    AdvectJob *job = ctx;
    for (int i = begin; i < end; i++) job->p[i] = track_advect(job->tr, job->p[i]);
}

/* The 95th percentile of the points' distance from the new surface, in voxels. */
static double motion_of(const Field *f, int n, const Vec3 *p)
{
    double *d = NEW(double, n), *F = NEW(double, n);
    Vec3 *g = NEW(Vec3, n);
    field_sample(f, n, p, F, g);
    for (int i = 0; i < n; i++) {
        double l = v_len(g[i]);
        d[i] = l > 0 ? fabs(F[i]) / l / f->voxel : 4;
    }
    double motion = n ? real_select(d, n, (int)(0.95 * (n - 1))) : 0;
    mem_free(d);
    mem_free(F);
    mem_free(g);
    return motion;
}

int track_predict(const Track *tr, int n, Vec3 *p, uint8_t *status, int *substeps)
{
    double reach = REACH_EDGES * tr->edge;
    *substeps = 0;
    if (tr->velocity) {
        parallel_for(n, GRAIN, advect_block, &(AdvectJob){tr, p});
    } else if (tr->last_field && tr->last_field->nbrick) {
        *substeps = int_clamp((int)(motion_of(tr->field, n, p) / BLEND_MOTION_VOX), 0, BLENDS_MAX);
        for (int k = 1; k <= *substeps; k++)
            field_project_blend(tr->last_field, tr->field, (double)k / (*substeps + 1), n, p, reach, NULL);
    }
    return field_project(tr->field, n, p, reach, status);
}
