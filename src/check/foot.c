/* foot.c: how far a point is from the surface.
 *
 * Two ways lead to it: down the gradient from the point itself, and from the nearest triangle of the reference; each is
 * then slid along the surface towards the point. Every candidate is on the surface, so the distance is never too short.
 * The gradient is the cell's own, for the surface measured has its kinks between cells; where the function is known, that
 * one's. */
#include "check/check_priv.h"

enum { NEWTON_MOST = 24, ROOT_MOST = 60, SLIDES = 12, CUTS = 4 };
#define STEP_VOX 0.5          /* of Newton and of a slide: longer ones jump over thin sheets */
#define OVERSHOOT 1.0000001   /* lets a step that would end just short of the surface pass it */
#define ROOT_WIDTH_VOX 1e-8
#define DOWN_REACH_VOX 0.3
#define SLIDE_REACH_VOX 1.0
#define SLIDE_DONE 3e-3       /* of the distance, along the surface: the error is half its square */
#define SLIDE_CUT 0.4

/* F and its gradient; outside what is known, no gradient. */
static double value_at(const Field *f, Vec3 p, Vec3 *grad)
{
    bool known;
    double F = field_value(f, p, grad, &known);
    if (!known) *grad = vec3(0, 0, 0);
    if (known && f->exact.sample && depth_of(f, p) >= 0) f->exact.sample(f->exact.ctx, 1, &p, &F, grad);
    return F;
}

/* The zero between p and q, where F is of two signs: false position, where an end that stays twice counts half. */
static Vec3 root_between(const Field *f, Vec3 p, double Fp, Vec3 q, double Fq)
{
    double wp = Fp, wq = Fq, width = ROOT_WIDTH_VOX * f->voxel;
    int stayed = 0; /* 1: p; -1: q */
    for (int k = 0; k < ROOT_MOST && Fp != 0 && Fq != 0 && v_len2(v_sub(q, p)) > width * width; k++) {
        Vec3 g, m = v_mix(p, q, wp / (wp - wq));
        double F = value_at(f, m, &g);
        if ((F > 0) == (Fp > 0)) {
            p = m, wp = Fp = F;
            if (stayed == -1) wq *= 0.5;
            stayed = -1;
        } else {
            q = m, wq = Fq = F;
            if (stayed == 1) wp *= 0.5;
            stayed = 1;
        }
    }
    return fabs(Fp) < fabs(Fq) ? p : q;
}

bool foot_land(const Field *f, Vec3 *p, double reach_vox)
{
    const double reach = reach_vox * f->voxel;
    Vec3 g, q = *p;
    double F = value_at(f, q, &g);
    for (int k = 0; k < NEWTON_MOST; k++) {
        double slope = v_len(g), len = real_min(fabs(F) / slope * OVERSHOOT, STEP_VOX * f->voxel);
        if (!(slope > 0)) return false;
        if (len <= ROOT_WIDTH_VOX * f->voxel) return *p = q, true;
        Vec3 next = v_axpy(q, (F > 0 ? -len : len) / slope, g);
        double Fn = value_at(f, next, &g);
        if ((Fn > 0) != (F > 0) || Fn == 0) return *p = root_between(f, q, F, next, Fn), true;
        q = next;
        F = Fn;
        if (v_len2(v_sub(q, *p)) > reach * reach) return false;
    }
    return false;
}

/* Slides the surface point p towards q as long as that brings it nearer; the distance that is left. */
static double slide(const Field *f, Vec3 q, Vec3 p)
{
    double best = v_dist(p, q);
    for (int i = 0; i < SLIDES; i++) {
        Vec3 g;
        value_at(f, p, &g);
        Vec3 n = v_unit(g), off = v_sub(q, p), way = v_axpy(off, -v_dot(off, n), n);
        double len = v_len(way), step = real_min(1, STEP_VOX * f->voxel / len);
        if (!(len > SLIDE_DONE * (best + 1e-3 * f->voxel))) return best;
        bool nearer = false;
        for (int k = 0; k < CUTS && !nearer; k++, step *= SLIDE_CUT) {
            Vec3 next = v_axpy(p, step, way);
            nearer = foot_land(f, &next, SLIDE_REACH_VOX) && v_dist(next, q) < best - 1e-7 * f->voxel;
            if (nearer) p = next, best = v_dist(p, q);
        }
        if (!nearer) return best;
    }
    return best;
}

double foot_distance_vox(const CheckSurface *s, Vec3 q)
{
    const Field *f = s->field;
    double best = INFINITY;
    Vec3 p = q;
    if (foot_land(f, &p, DOWN_REACH_VOX)) best = slide(f, q, p);
    if (best < FOOT_NEAR_VOX * f->voxel || s->tri.ntri == 0) return best / f->voxel;
    Vec3 near = p = closest_find(&s->index, q).point;
    return real_min(best, foot_land(f, &p, FOOT_SEEK_VOX) ? slide(f, q, p) : v_dist(near, q)) / f->voxel;
}
