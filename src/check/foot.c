/* foot.c: how far a point is from the surface.
 *
 * Two ways lead to it: down the gradient from the point itself, and from the nearest triangle of the reference; each is
 * then slid along the surface towards the point. Every candidate is on the surface, so the distance is never too short.
 * The gradient is the cell's own, for the surface measured has its kinks between cells; where the function is known, that
 * one's. */
#include "check/check_priv.h"

enum { SLIDES = 12, CUTS = 4 };
#define STEP_VOX 0.5          /* of a slide: longer ones jump over thin sheets */
#define DOWN_REACH_VOX 0.3
#define SLIDE_REACH_VOX 1.0
#define SLIDE_DONE 3e-3       /* of the distance, along the surface: the error is half its square */
#define SLIDE_CUT 0.4

static Vec3 gradient_at(const Field *f, Vec3 p)
{
    Vec3 g;
    if (f->exact.sample) return field_gradient(f, p);
    field_value(f, p, &g, NULL);
    return g;
}

/* Slides the surface point p towards q as long as that brings it nearer; the distance that is left. */
static double slide(const Field *f, Vec3 q, Vec3 p)
{
    double best = v_dist(p, q);
    for (int i = 0; i < SLIDES; i++) {
        Vec3 n = v_unit(gradient_at(f, p)), off = v_sub(q, p), way = v_axpy(off, -v_dot(off, n), n);
        double len = v_len(way), step = real_min(1, STEP_VOX * f->voxel / len);
        if (!(len > SLIDE_DONE * (best + 1e-3 * f->voxel))) return best;
        bool nearer = false;
        for (int k = 0; k < CUTS && !nearer; k++, step *= SLIDE_CUT) {
            Vec3 next = v_axpy(p, step, way);
            nearer = field_drop(f, &next, SLIDE_REACH_VOX * f->voxel) && v_dist(next, q) < best - 1e-7 * f->voxel;
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
    if (field_drop(f, &p, DOWN_REACH_VOX * f->voxel)) best = slide(f, q, p);
    if (best < FOOT_NEAR_VOX * f->voxel || s->tri.ntri == 0) return best / f->voxel;
    Vec3 near = p = closest_find(&s->index, q).point;
    return real_min(best, field_drop(f, &p, FOOT_SEEK_VOX * f->voxel) ? slide(f, q, p) : v_dist(near, q)) / f->voxel;
}
