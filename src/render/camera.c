#include "render/camera.h"

#include <math.h>

#define DEGREE 0.017453292519943295
#define MARGIN 1.06 /* room left around what is fitted */

Camera camera_make(Vec3 eye, Vec3 target, Vec3 up, double fov_deg, int width, int height)
{
    Camera c = {.eye = eye, .width = width, .height = height, .pixel = 2 * tan(0.5 * fov_deg * DEGREE) / height};
    c.back = v_unit(v_sub(eye, target));
    if (!(v_len2(c.back) > 0)) c.back = vec3(0, 0, 1);
    c.right = v_unit(v_cross(up, c.back));
    if (!(v_len2(c.right) > 0.5)) c.right = v_unit(v_cross(fabs(c.back.y) < 0.9 ? vec3(0, 1, 0) : vec3(0, 0, -1), c.back));
    c.up = v_cross(c.back, c.right);
    return c;
}

Vec3 camera_ray(const Camera *c, double x, double y)
{
    Vec3 across = v_axpy(v_scale(c->right, (x - 0.5 * c->width) * c->pixel), (0.5 * c->height - y) * c->pixel, c->up);
    return v_sub(across, c->back);
}

Vec3 camera_project(const Camera *c, Vec3 p)
{
    Vec3 d = v_sub(p, c->eye);
    double depth = -v_dot(d, c->back), scale = 1 / (depth * c->pixel);
    return vec3(0.5 * c->width + v_dot(d, c->right) * scale, 0.5 * c->height - v_dot(d, c->up) * scale, depth);
}

/* Rodrigues' formula. */
static Vec3 turned(Vec3 v, Vec3 axis, double cosine, double sine)
{
    Vec3 out = v_axpy(v_scale(v, cosine), sine, v_cross(axis, v));
    return v_axpy(out, (1 - cosine) * v_dot(axis, v), axis);
}

Camera camera_turned(const Camera *c, Vec3 through, Vec3 axis, double degrees)
{
    double cosine = cos(degrees * DEGREE), sine = sin(degrees * DEGREE);
    Camera t = *c;
    t.eye = v_add(through, turned(v_sub(c->eye, through), axis, cosine, sine));
    t.right = turned(c->right, axis, cosine, sine);
    t.up = turned(c->up, axis, cosine, sine);
    t.back = turned(c->back, axis, cosine, sine);
    return t;
}

/* --- fitting ------------------------------------------------------------------------------------------- */

Bounds bounds_none(void) { return (Bounds){vec3(INFINITY, INFINITY, INFINITY), vec3(-INFINITY, -INFINITY, -INFINITY)}; }

void bounds_add_mesh(Bounds *b, const TriMesh *m)
{
    for (int v = 0; v < m->nvert; v++)
        for (int a = 0; a < 3; a++) {
            double x = m->pos[3 * (size_t)v + (size_t)a];
            if (!isfinite(x)) continue;
            v_set(&b->lo, a, real_min(v_get(b->lo, a), x));
            v_set(&b->hi, a, real_max(v_get(b->hi, a), x));
        }
}

static bool bounds_is_nothing(const Bounds *b) { return !(b->lo.x <= b->hi.x && b->lo.y <= b->hi.y && b->lo.z <= b->hi.z); }

Vec3 bounds_centre(const Bounds *b) { return bounds_is_nothing(b) ? vec3(0, 0, 0) : v_mid(b->lo, b->hi); }

double bounds_size(const Bounds *b)
{
    double size = bounds_is_nothing(b) ? 0 : v_dist(b->lo, b->hi);
    return size > 0 ? size : 1;
}

/* Half of what the camera sees at distance 1. */
static double half_across(const Camera *c) { return 0.5 * c->width * c->pixel / MARGIN; }
static double half_along(const Camera *c) { return 0.5 * c->height * c->pixel / MARGIN; }

Fit fit_begin(Vec3 back, Vec3 up, double fov_deg, int width, int height)
{
    Fit f = {.camera = camera_make(back, vec3(0, 0, 0), up, fov_deg, width, height)};
    for (int side = 0; side < 4; side++) f.most[side] = -INFINITY;
    return f;
}

/* Of the side to the right, left, top, bottom; outward. */
static Vec3 side_normal(const Camera *c, int side)
{
    Vec3 out = v_scale(side < 2 ? c->right : c->up, side % 2 ? -1 : 1);
    return v_axpy(out, side < 2 ? half_across(c) : half_along(c), c->back);
}

void fit_add_mesh(Fit *f, const TriMesh *m)
{
    for (int side = 0; side < 4; side++) {
        Vec3 n = side_normal(&f->camera, side);
        for (int v = 0; v < m->nvert; v++) {
            const float *p = m->pos + 3 * (size_t)v;
            double out = n.x * (double)p[0] + n.y * (double)p[1] + n.z * (double)p[2];
            if (isfinite(out) && out > f->most[side]) f->most[side] = out;
        }
    }
}

Camera fit_camera(const Fit *f)
{
    Camera c = f->camera;
    if (!isfinite(f->most[0])) return c;
    double across = 0.5 * (f->most[0] + f->most[1]) / half_across(&c), along = 0.5 * (f->most[2] + f->most[3]) / half_along(&c);
    c.eye = v_scale(c.right, 0.5 * (f->most[0] - f->most[1]));
    c.eye = v_axpy(c.eye, 0.5 * (f->most[2] - f->most[3]), c.up);
    c.eye = v_axpy(c.eye, real_max(across, along), c.back);
    return c;
}

/* How far from the centre the eye must be for a camera with these axes to see every corner. */
static double distance_for(const Bounds *b, const Camera *c)
{
    double most = 0;
    Vec3 half = v_scale(v_sub(b->hi, b->lo), 0.5);
    for (int i = 0; i < 8; i++) {
        Vec3 p = vec3(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z);
        double need = real_max(fabs(v_dot(p, c->right)) / half_across(c), fabs(v_dot(p, c->up)) / half_along(c));
        most = real_max(most, need + v_dot(p, c->back));
    }
    return most;
}

Camera fit_turning(const Fit *f, const Bounds *b, Vec3 up)
{
    enum { STEPS = 72 };
    Camera c = f->camera;
    double distance = bounds_is_nothing(b) ? 1 : 0;
    for (int i = 0; !bounds_is_nothing(b) && i < STEPS; i++) {
        Camera t = camera_turned(&c, vec3(0, 0, 0), up, 360.0 * i / STEPS);
        distance = real_max(distance, distance_for(b, &t));
    }
    c.eye = v_axpy(bounds_centre(b), distance, c.back);
    return c;
}
