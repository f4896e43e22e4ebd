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

/* A gradient and where it was taken. */
typedef struct Slope {
    Vec3 at, g;
} Slope;

/* A point on its way from q to `next`, with F there; then, once F changes sign between the two, its zero there. */
typedef struct Walker {
    int which;
    Place at;              /* of the last value */
    Vec3 q, next;
    double F, Fnext;
    double wF, wnext;      /* the values that the false position goes by */
    int stayed;            /* 1: q; -1: next */
} Walker;

/* Several points are taken along together, step by step: what one waits for, another does not. */
enum { TOGETHER = 32 };

static Vec3 nearer_end(const Walker *w) { return fabs(w->F) < fabs(w->Fnext) ? w->q : w->next; }

/* Takes the end that lies on m's side there. */
static void close_in(Walker *w, Vec3 m, double Fm)
{
    if ((Fm > 0) == (w->F > 0)) {
        w->q = m, w->wF = w->F = Fm;
        if (w->stayed == -1) w->wnext *= 0.5;
        w->stayed = -1;
    } else {
        w->next = m, w->wnext = w->Fnext = Fm;
        if (w->stayed == 1) w->wF *= 0.5;
        w->stayed = 1;
    }
}

/* The zeros between q (value F) and next (value Fnext, of the other sign or 0) of n walkers, TOGETHER at most, into root[which], by the
 * Illinois rule: false position, where an end that stays for a second time counts half, so that both ends come near. */
static void find_roots(const Blend *f, int n, Walker *w, Vec3 *root)
{
    Vec3 m[TOGETHER];
    double slope[TOGETHER], Fm[TOGETHER];
    for (int i = 0; i < n; i++) w[i].wF = w[i].F, w[i].wnext = w[i].Fnext, w[i].stayed = 0;
    for (int k = 0; n > 0; k++) {
        int left = 0;
        for (int i = 0; i < n; i++) {
            double width = v_dist(w[i].q, w[i].next);
            if (k == ROOT_MAX || w[i].F == 0 || w[i].Fnext == 0 || !(width > f->near)) {
                root[w[i].which] = nearer_end(&w[i]);
                continue;
            }
            if (left < i) w[left] = w[i];
            slope[left] = fabs(w[left].Fnext - w[left].F) / width;
            m[left] = v_mix(w[left].q, w[left].next, w[left].wF / (w[left].wF - w[left].wnext));
            left++;
        }
        n = left;
        for (int i = 0; i < n; i++) Fm[i] = blend_value(f, m[i], &w[i].at);
        left = 0;
        for (int i = 0; i < n; i++) {
            if (fabs(Fm[i]) <= f->near * slope[i]) {
                root[w[i].which] = m[i];
                continue;
            }
            if (left < i) w[left] = w[i];
            close_in(&w[left++], m[i], Fm[i]);
        }
        n = left;
    }
}

/* Where a Newton step takes n walkers. Those that have one come first, in order: returns how many. What stands on the surface is put
 * behind the *nroot at roots. */
static int aim(const Blend *f, int n, Walker *w, int *nroot, Walker *root, Slope *last)
{
    int left = 0;
    for (int i = 0; i < n; i++) {
        if (!is_known(&w[i].at)) continue;
        w[i].next = w[i].q, w[i].Fnext = w[i].F;
        if (w[i].F == 0) {
            root[(*nroot)++] = w[i];
            continue;
        }
        Vec3 g = blend_gradient(f, &w[i].at);
        double g2 = v_len2(g);
        if (last) last[w[i].which] = (Slope){w[i].q, g};
        if (!(g2 > 0)) continue;
        double len = fabs(w[i].F) / sqrt(g2) * OVERSHOOT + f->near;
        if (left < i) w[left] = w[i];
        w[left].next = v_axpy(w[left].q, (w[left].F > 0 ? -1 : 1) * real_min(len, STEP_MAX_VOX * f->a->voxel) / sqrt(g2), g);
        left++;
    }
    return left;
}

/* TOGETHER points at most, each at most reach[] far; last[] (may be NULL): the last gradients followed. */
static void project_together(const Blend *f, int n, Vec3 *p, const double *reach, uint8_t *status, Slope *last)
{
    Walker w[TOGETHER], at_root[TOGETHER];
    Vec3 root[TOGETHER];
    int going = n, nroot = 0;
    for (int i = 0; i < n; i++) {
        w[i].which = i;
        w[i].q = p[i];
        w[i].F = blend_value(f, p[i], &w[i].at);
        status[i] = LANDING_LOST;
        if (last) last[i].at = vec3(INFINITY, INFINITY, INFINITY);
    }
    for (int k = 0; k < NEWTON_MAX && going > 0; k++) {
        int left = 0, aimed = aim(f, going, w, &nroot, at_root, last);
        for (int i = 0; i < aimed; i++) w[i].Fnext = blend_value(f, w[i].next, &w[i].at);
        for (int i = 0; i < aimed; i++) {
            if (!is_known(&w[i].at)) continue;
            if ((w[i].Fnext > 0) != (w[i].F > 0)) {
                at_root[nroot++] = w[i];
                continue;
            }
            double r = reach[w[i].which];
            if (v_len2(v_sub(w[i].next, p[w[i].which])) > r * r) continue;
            if (left < i) w[left] = w[i];
            w[left].q = w[left].next;
            w[left++].F = w[i].Fnext;
        }
        going = left;
    }
    for (int i = 0; i < nroot; i++) status[at_root[i].which] = LANDED;
    find_roots(f, nroot, at_root, root);
    for (int i = 0; i < n; i++) {
        if (status[i] != LANDED) continue;
        if (v_len2(v_sub(root[i], p[i])) > reach[i] * reach[i]) status[i] = LANDING_LOST;
        else p[i] = root[i];
    }
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
            Walker w[TOGETHER];
            w[0] = (Walker){.q = q, .F = F, .next = next, .Fnext = Fn};
            find_roots(&one, 1, w, p);
            Vec3 from = *p;
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
    uint8_t status;
    project_together(&one, 1, p, &reach, &status, NULL);
    if (f->exact.sample) exact_land(f, 1, &from, p, &status);
    return status == LANDED;
}

/* TOGETHER points at most. */
static void land_together(const Field *f, int n, Vec3 *p, double reach, Vec3 *normal, uint8_t *status)
{
    const Blend one = {.a = f, .near = ROOT_VOX * f->voxel};
    Vec3 from[TOGETHER];
    double reaches[TOGETHER];
    Slope last[TOGETHER];
    for (int i = 0; i < TOGETHER; i++) reaches[i] = reach;
    for (int i = 0; i < n; i++) from[i] = p[i];
    project_together(&one, n, p, reaches, status, last);
    if (f->exact.sample) exact_land(f, n, from, p, status);
    for (int i = 0; i < n; i++) {
        if (status[i] != LANDED) continue;
        if (f->exact.sample || v_dist(p[i], last[i].at) > NORMAL_VOX * f->voxel) field_normals(f, 1, &p[i], &normal[i]);
        else normal[i] = v_scale(last[i].g, -1 / v_len(last[i].g));
    }
}

bool field_land(const Field *f, Vec3 *p, double reach, Vec3 *normal)
{
    uint8_t status;
    land_together(f, 1, p, reach, normal, &status);
    return status == LANDED;
}

void field_land_each(const Field *f, int n, Vec3 *p, double reach, Vec3 *normal, uint8_t *status)
{
    for (int i = 0; i < n; i += TOGETHER) land_together(f, int_min(TOGETHER, n - i), p + i, reach, normal + i, status + i);
}

static void project_some(const Blend *f, int n, Vec3 *p, const double *reach, uint8_t *status)
{
    const bool exact = f->a->exact.sample && !f->b;
    Vec3 from[TOGETHER];
    for (int i = 0; i < n && exact; i++) from[i] = p[i];
    project_together(f, n, p, reach, status, NULL);
    if (exact) exact_land(f->a, n, from, p, status);
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
    double reach[TOGETHER];
    uint8_t status[TOGETHER];
    int lost = 0;
    for (int i = 0; i < TOGETHER; i++) reach[i] = job->reach;
    for (int first = begin; first < end; first += TOGETHER) {
        int n = int_min(TOGETHER, end - first);
        project_some(&job->blend, n, job->p + first, reach, status);
        for (int i = 0; i < n; i++) {
            lost += status[i] != LANDED;
            if (job->status) job->status[first + i] = status[i];
        }
    }
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

void field_project_each(const Field *f, int n, Vec3 *p, const double *reach, uint8_t *status)
{
    const Blend one = {.a = f, .near = ROOT_VOX * f->voxel};
    for (int i = 0; i < n; i += TOGETHER) project_some(&one, int_min(TOGETHER, n - i), p + i, reach + i, status + i);
}
