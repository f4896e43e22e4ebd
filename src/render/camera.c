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

static bool is_nothing(const Bounds *b) { return !(b->lo.x <= b->hi.x && b->lo.y <= b->hi.y && b->lo.z <= b->hi.z); }

Vec3 bounds_centre(const Bounds *b) { return is_nothing(b) ? vec3(0, 0, 0) : v_mid(b->lo, b->hi); }

double bounds_size(const Bounds *b)
{
    double size = is_nothing(b) ? 0 : v_dist(b->lo, b->hi);
    return size > 0 ? size : 1;
}

/* How far from the centre the eye must be for a camera with these axes to see every corner. */
static double distance_for(const Bounds *b, const Camera *c)
{
    double most = 0, across = 0.5 * c->width * c->pixel / MARGIN, along = 0.5 * c->height * c->pixel / MARGIN;
    Vec3 half = v_scale(v_sub(b->hi, b->lo), 0.5);
    for (int i = 0; i < 8; i++) {
        Vec3 p = vec3(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z);
        double need = real_max(fabs(v_dot(p, c->right)) / across, fabs(v_dot(p, c->up)) / along);
        most = real_max(most, need + v_dot(p, c->back));
    }
    return most;
}

Camera camera_fit(const Bounds *b, Vec3 back, Vec3 up, bool whole_turn, double fov_deg, int width, int height)
{
    enum { STEPS = 72 };
    Vec3 centre = bounds_centre(b);
    Camera c = camera_make(v_add(centre, back), centre, up, fov_deg, width, height);
    double distance = 1e-6 * bounds_size(b);
    for (int i = 0; !is_nothing(b) && i < (whole_turn ? STEPS : 1); i++) {
        Camera t = camera_turned(&c, centre, up, 360.0 * i / STEPS);
        distance = real_max(distance, distance_for(b, &t));
    }
    c.eye = v_axpy(centre, distance, c.back);
    return c;
}
