/* warp.c: twist, bend and taper (Barr 1984) of an element along one of its local axes. Points are taken back to the
 * straight element; below, z is the axis and x, y the next two in turn. */
#include "scene/scene_priv.h"

#define TAPER_LEAST 0.05  /* a cross-section shrinks to a twentieth, not to nothing */
#define BEND_LEAST 1e-9   /* radians a unit: below it the element is straight */
#define BEND_CORE 1e-6    /* radii of the bend: at its very centre gradients stay finite */

static Vec3 turn_in(int axis, Vec3 p) { return axis == 2 ? p : axis == 0 ? vec3(p.y, p.z, p.x) : vec3(p.z, p.x, p.y); }
static Vec3 turn_out(int axis, Vec3 p) { return axis == 2 ? p : axis == 0 ? vec3(p.z, p.x, p.y) : vec3(p.y, p.z, p.x); }

/* The bend's polar coordinates: its centre lies at x = 1/a. */
typedef struct Polar {
    double inward, z, r;  /* from the centre towards the element, along it; the distance */
    double sign, radius;  /* of the curvature */
} Polar;

static Polar polar_of(double a, Vec3 p)
{
    Polar b = {.sign = a < 0 ? -1 : 1, .radius = fabs(1 / a)};
    b.inward = b.radius - b.sign * p.x;
    b.z = p.z;
    b.r = real_max(sqrt(b.inward * b.inward + b.z * b.z), BEND_CORE * b.radius);
    return b;
}

Vec3 warp_undo(WarpKind kind, int axis, double a, Vec3 world)
{
    Vec3 p = turn_in(axis, world);
    if (kind == WARP_TWIST) {
        double c = cos(a * p.z), s = sin(a * p.z);
        p = vec3(c * p.x + s * p.y, -s * p.x + c * p.y, p.z);
    } else if (kind == WARP_TAPER) {
        double s = real_max(1 + a * p.z, TAPER_LEAST);
        p = vec3(p.x / s, p.y / s, p.z);
    } else if (fabs(a) > BEND_LEAST) {
        Polar b = polar_of(a, p);
        p = vec3(b.sign * (b.radius - b.r), p.y, b.radius * atan2(b.z, b.inward));
    }
    return turn_out(axis, p);
}

Vec3 warp_gradient(WarpKind kind, int axis, double a, Vec3 world, Vec3 gradient)
{
    Vec3 p = turn_in(axis, world), g = turn_in(axis, gradient), to = turn_in(axis, warp_undo(kind, axis, a, world));
    if (kind == WARP_TWIST) {
        double c = cos(a * p.z), s = sin(a * p.z);
        g = vec3(c * g.x - s * g.y, s * g.x + c * g.y, g.z + a * (to.y * g.x - to.x * g.y));
    } else if (kind == WARP_TAPER) {
        double s = 1 + a * p.z;
        bool least = s < TAPER_LEAST;
        if (least) s = TAPER_LEAST;
        g = vec3(g.x / s, g.y / s, g.z - (least ? 0 : a / s * (to.x * g.x + to.y * g.y)));
    } else if (fabs(a) > BEND_LEAST) {
        Polar b = polar_of(a, p);
        double c = b.inward / b.r, s = b.z / b.r, stretch = b.radius / b.r;
        g = vec3(c * g.x + b.sign * stretch * s * g.z, g.y, -b.sign * s * g.x + stretch * c * g.z);
    }
    return turn_out(axis, g);
}

/* The largest stretch of the map within the ball, times its radius. */
double warp_ball(WarpKind kind, int axis, double a, Vec3 centre, double radius)
{
    Vec3 c = turn_in(axis, centre);
    double far = sqrt(c.x * c.x + c.y * c.y) + radius;
    if (kind == WARP_TWIST) return radius * (1 + fabs(a) * far);
    if (kind == WARP_TAPER) {
        double s = real_max(1 + a * c.z - fabs(a) * radius, TAPER_LEAST);
        return radius * (real_max(1, 1 / s) + fabs(a) * far / (s * s));
    }
    if (fabs(a) <= BEND_LEAST) return radius;
    Polar b = polar_of(a, c);
    bool at_cut = fabs(b.z) <= radius && b.inward <= radius; /* behind the centre the two ends of the turn meet */
    double near = b.r - radius;
    if (at_cut || !(near > BEND_CORE * b.radius)) return INFINITY;
    return radius * real_max(1, b.radius / near);
}

void pose_ball(const Pose *e, Vec3 *c, double *radius)
{
    *c = affine_to_index(&e->place, *c);
    *radius *= e->shrink;
    for (int k = e->e->nwarp - 1; k >= 0 && isfinite(*radius); k--) {
        const Warp *w = &e->e->warp[k];
        *radius = warp_ball(w->kind, w->axis, e->amount[k], *c, *radius);
        *c = warp_undo(w->kind, w->axis, e->amount[k], *c);
    }
}
