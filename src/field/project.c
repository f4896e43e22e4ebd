/* project.c: GI'07 eq. 3: points onto the trilinear surface. */
#include "field/field_priv.h"

#include "base/thread.h"

#include <math.h>

enum { NEWTON_MAX = 24, ROOT_MAX = 60, GRAIN = 512 };
#define STEP_MAX_VOX 0.5      /* a Newton step's length: longer ones jump over thin sheets */
#define CAST_STEP_VOX 0.25
#define OVERSHOOT 1.05        /* of a Newton step: from a bracket on, no more gradients are wanted */
#define ROOT_VOX 1e-6         /* how near to its root a point comes, to first order; what float32 positions hold */
#define NORMAL_VOX 0.02       /* as far from where it was taken a gradient serves for a normal */
#define BLEND_ROOT_VOX 0.01   /* the same in a blend, from which points go on */

/* The function followed: a alone, or the blend (1 - t) a + t b. */
typedef struct Blend {
    const Field *a, *b;
    double t;
    bool cell;   /* a alone, down its cells' own gradients */
    double near; /* how near to its root a point must come, world units */
} Blend;

/* Where a point lies in the two fields. */
typedef struct Place {
    Spot a, b;
    bool in_a, in_b;
} Place;

static double blend_value(const Blend *f, Vec3 p, Place *at)
{
    at->in_a = field_locate(f->a, p, &at->a);
    at->in_b = f->b && field_locate(f->b, p, &at->b);
    if (!at->in_b) return at->in_a ? spot_value(f->a, &at->a) : -f->a->far;
    double vb = spot_value(f->b, &at->b);
    return at->in_a ? (1 - f->t) * spot_value(f->a, &at->a) + f->t * vb : vb;
}

static bool is_known(const Place *at) { return at->in_a || at->in_b; }

static Vec3 blend_gradient(const Blend *f, const Place *at)
{
    if (f->cell) return spot_cell_gradient(f->a, &at->a);
    if (!at->in_b) return spot_steer(f->a, &at->a);
    Vec3 gb = spot_steer(f->b, &at->b);
    return at->in_a ? v_mix(spot_steer(f->a, &at->a), gb, f->t) : gb;
}

/* The zero between p (value Fp) and q (value Fq, of the other sign or 0), by the Illinois rule: false position, where an end that
 * stays for a second time counts half, so that both ends come near. */
static Vec3 root_between(const Blend *f, Vec3 p, double Fp, Vec3 q, double Fq)
{
    double wp = Fp, wq = Fq;
    int stayed = 0; /* 1: p; -1: q */
    for (int k = 0; k < ROOT_MAX && Fp != 0 && Fq != 0; k++) {
        double width = v_dist(p, q), slope = fabs(Fq - Fp) / width;
        if (!(width > f->near)) break;
        Vec3 m = v_mix(p, q, wp / (wp - wq));
        Place at;
        double Fm = blend_value(f, m, &at);
        if (fabs(Fm) <= f->near * slope) return m;
        if ((Fm > 0) == (Fp > 0)) {
            p = m, wp = Fp = Fm;
            if (stayed == -1) wq *= 0.5;
            stayed = -1;
        } else {
            q = m, wq = Fq = Fm;
            if (stayed == 1) wp *= 0.5;
            stayed = 1;
        }
    }
    return fabs(Fp) < fabs(Fq) ? p : q;
}

/* A gradient and where it was taken. */
typedef struct Slope {
    Vec3 at, g;
} Slope;

/* last: the last gradient followed. */
static Landing project_one(const Blend *f, Vec3 *p, double reach, Slope *last)
{
    const double voxel = f->a->voxel;
    Vec3 q = *p;
    Place at;
    last->at = vec3(INFINITY, INFINITY, INFINITY);
    double F = blend_value(f, q, &at);
    for (int k = 0; k < NEWTON_MAX && is_known(&at); k++) {
        if (F == 0) return *p = q, LANDED;
        Vec3 g = blend_gradient(f, &at);
        double g2 = v_len2(g);
        *last = (Slope){q, g};
        if (!(g2 > 0)) return LANDING_LOST;
        double len = fabs(F) / sqrt(g2) * OVERSHOOT + f->near;
        Vec3 next = v_axpy(q, (F > 0 ? -1 : 1) * real_min(len, STEP_MAX_VOX * voxel) / sqrt(g2), g);
        double Fn = blend_value(f, next, &at);
        if (!is_known(&at)) return LANDING_LOST;
        if ((Fn > 0) != (F > 0)) {
            next = root_between(f, q, F, next, Fn);
            if (v_len2(v_sub(next, *p)) > reach * reach) return LANDING_LOST;
            return *p = next, LANDED;
        }
        q = next;
        F = Fn;
        if (v_len2(v_sub(q, *p)) > reach * reach) return LANDING_LOST;
    }
    return LANDING_LOST;
}

bool field_cast(const Field *f, Vec3 *p, Vec3 dir, double reach)
{
    const Blend one = {.a = f, .near = ROOT_VOX * f->voxel};
    const double step = CAST_STEP_VOX * f->voxel;
    Place at;
    Vec3 q = *p;
    double F = blend_value(&one, q, &at);
    for (double way = 0; at.in_a && way < reach; way += step) {
        Vec3 next = v_axpy(q, real_min(step, reach - way), dir);
        double Fn = blend_value(&one, next, &at);
        if (at.in_a && (Fn > 0) != (F > 0)) {
            const uint8_t landed = LANDED;
            Vec3 from = *p = root_between(&one, q, F, next, Fn);
            if (f->exact.sample) exact_land(f, 1, &from, p, &landed);
            return true;
        }
        q = next;
        F = Fn;
    }
    return false;
}

bool field_drop(const Field *f, Vec3 *p, double reach)
{
    const Blend one = {.a = f, .cell = true, .near = ROOT_VOX * f->voxel};
    Vec3 from = *p;
    uint8_t status = (uint8_t)project_one(&one, p, reach, &(Slope){0});
    if (f->exact.sample) exact_land(f, 1, &from, p, &status);
    return status == LANDED;
}

bool field_land(const Field *f, Vec3 *p, double reach, Vec3 *normal)
{
    const Blend one = {.a = f, .near = ROOT_VOX * f->voxel};
    const uint8_t landed = LANDED;
    Vec3 from = *p;
    Slope last;
    if (project_one(&one, p, reach, &last) != LANDED) return false;
    if (f->exact.sample) exact_land(f, 1, &from, p, &landed);
    if (f->exact.sample || v_dist(*p, last.at) > NORMAL_VOX * f->voxel) field_normals(f, 1, p, normal);
    else *normal = v_scale(last.g, -1 / v_len(last.g));
    return true;
}

typedef struct Job {
    Blend blend;
    Vec3 *p;
    double reach;
    uint8_t *status;
    int *lost; /* a block */
} Job;

static void project_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    const bool exact = job->blend.a->exact.sample && !job->blend.b;
    Vec3 from[GRAIN];
    uint8_t status[GRAIN];
    int lost = 0;
    for (int i = begin; i < end; i++) {
        from[i - begin] = job->p[i];
        Landing l = project_one(&job->blend, &job->p[i], job->reach, &(Slope){0});
        lost += l != LANDED;
        status[i - begin] = (uint8_t)l;
        if (job->status) job->status[i] = (uint8_t)l;
    }
    if (exact) exact_land(job->blend.a, end - begin, from, job->p + begin, status);
    job->lost[begin / GRAIN] = lost;
}

static int project_all(Blend blend, int n, Vec3 *p, double reach, uint8_t *status)
{
    int blocks = (n + GRAIN - 1) / GRAIN, lost = 0;
    int one = 0, *count = blocks > 1 ? NEW(int, blocks) : &one;
    Job job = {blend, p, reach, status, count};
    parallel_for(n, GRAIN, project_block, &job);
    for (int b = 0; b < blocks; b++) lost += count[b];
    if (blocks > 1) mem_free(count);
    return lost;
}

int field_project(const Field *f, int n, Vec3 *p, double reach, uint8_t *status)
{
    return project_all((Blend){.a = f, .near = ROOT_VOX * f->voxel}, n, p, reach, status);
}

int field_project_blend(const Field *a, const Field *b, double t, int n, Vec3 *p, double reach, uint8_t *status)
{
    return project_all((Blend){.a = a, .b = b, .t = t, .near = BLEND_ROOT_VOX * a->voxel}, n, p, reach, status);
}
