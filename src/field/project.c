/* project.c: GI'07 eq. 3: points onto the trilinear surface. */
#include "field/field_priv.h"

#include "base/thread.h"

#include <math.h>

enum { NEWTON_MAX = 24, ROOT_MAX = 60, GRAIN = 512 };
#define STEP_MAX_VOX 0.5      /* a Newton step's length: longer ones jump over thin sheets */
#define CAST_STEP_VOX 0.25
#define OVERSHOOT 1.001       /* lets a step that would end just short of the surface bracket it */
#define ROOT_WIDTH_VOX 1e-9   /* the bracket a root is left with */

/* The function followed: a alone, or the blend (1 - t) a + t b. */
typedef struct Blend {
    const Field *a, *b;
    double t;
    bool cell; /* a alone, down its cells' own gradients */
} Blend;

static double blend_value(const Blend *f, Vec3 p, bool *known)
{
    bool in_a, in_b;
    double va = field_value(f->a, p, NULL, &in_a);
    if (!f->b) return *known = in_a, va;
    double vb = field_value(f->b, p, NULL, &in_b);
    *known = in_a || in_b;
    return in_a && in_b ? (1 - f->t) * va + f->t * vb : in_a ? va : vb;
}

static Vec3 cell_gradient(const Field *f, Vec3 p)
{
    Vec3 g;
    field_value(f, p, &g, NULL);
    return g;
}

static Vec3 blend_gradient(const Blend *f, Vec3 p)
{
    if (f->cell) return cell_gradient(f->a, p);
    if (!f->b) return field_steer(f->a, p);
    bool in_a, in_b;
    field_value(f->a, p, NULL, &in_a);
    field_value(f->b, p, NULL, &in_b);
    if (in_a && in_b) return v_mix(field_steer(f->a, p), field_steer(f->b, p), f->t);
    return field_steer(in_a ? f->a : f->b, p);
}

/* The zero between p (value Fp) and q (value Fq, of the other sign or 0), by the Illinois rule: false position, where an end that
 * stays for a second time counts half, so that both ends come near. */
static Vec3 root_between(const Blend *f, Vec3 p, double Fp, Vec3 q, double Fq, double width)
{
    double wp = Fp, wq = Fq;
    int stayed = 0; /* 1: p; -1: q */
    for (int k = 0; k < ROOT_MAX && Fp != 0 && Fq != 0 && v_len2(v_sub(q, p)) > width * width; k++) {
        Vec3 m = v_mix(p, q, wp / (wp - wq));
        bool known;
        double Fm = blend_value(f, m, &known);
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

static Landing project_one(const Blend *f, Vec3 *p, double reach)
{
    const double voxel = f->a->voxel;
    Vec3 q = *p;
    bool known;
    double F = blend_value(f, q, &known);
    for (int k = 0; k < NEWTON_MAX && known; k++) {
        if (F == 0) return *p = q, LANDED;
        Vec3 g = blend_gradient(f, q);
        double g2 = v_len2(g);
        if (!(g2 > 0)) return LANDING_LOST;
        double len = fabs(F) / sqrt(g2) * OVERSHOOT + ROOT_WIDTH_VOX * voxel;
        Vec3 next = v_axpy(q, (F > 0 ? -1 : 1) * real_min(len, STEP_MAX_VOX * voxel) / sqrt(g2), g);
        double Fn = blend_value(f, next, &known);
        if (!known) return LANDING_LOST;
        if ((Fn > 0) != (F > 0)) {
            next = root_between(f, q, F, next, Fn, ROOT_WIDTH_VOX * voxel);
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
    const Blend one = {.a = f};
    const double step = CAST_STEP_VOX * f->voxel;
    bool known;
    Vec3 q = *p;
    double F = blend_value(&one, q, &known);
    for (double way = 0; known && way < reach; way += step) {
        Vec3 next = v_axpy(q, real_min(step, reach - way), dir);
        double Fn = blend_value(&one, next, &known);
        if (known && (Fn > 0) != (F > 0)) {
            const uint8_t landed = LANDED;
            Vec3 from = *p = root_between(&one, q, F, next, Fn, ROOT_WIDTH_VOX * f->voxel);
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
    const Blend one = {.a = f, .cell = true};
    Vec3 from = *p;
    uint8_t status = (uint8_t)project_one(&one, p, reach);
    if (f->exact.sample) exact_land(f, 1, &from, p, &status);
    return status == LANDED;
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
        Landing l = project_one(&job->blend, &job->p[i], job->reach);
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
    return project_all((Blend){.a = f}, n, p, reach, status);
}

int field_project_blend(const Field *a, const Field *b, double t, int n, Vec3 *p, double reach, uint8_t *status)
{
    return project_all((Blend){.a = a, .b = b, .t = t}, n, p, reach, status);
}
