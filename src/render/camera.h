/* camera.h: a perspective camera. Pixels count from the picture's upper left corner, x to the right, y down; the centre of
 * the first one is at (0.5, 0.5). */
#pragma once
#include "base/vec.h"
#include "mesh/trimesh.h"

typedef struct Camera {
    Vec3 eye, right, up, back; /* unit axes; back points from the target to the eye */
    double pixel;              /* its side at distance 1 */
    int width, height;
} Camera;

/* fov_deg: the angle between the picture's upper and lower border. Where eye and target, or the view and up, fall together,
 * the axes are still some that stand upright on each other. */
Camera camera_make(Vec3 eye, Vec3 target, Vec3 up, double fov_deg, int width, int height);
/* From the eye through a place in the picture, as long as it takes to come one unit deeper. */
Vec3 camera_ray(const Camera *c, double x, double y);
/* The place in the picture, and in z the depth: the distance from the plane of the eye. Depths of 0 and less are not seen. */
Vec3 camera_project(const Camera *c, Vec3 p);
/* Turned around an axis through a point, by degrees. */
Camera camera_turned(const Camera *c, Vec3 through, Vec3 axis, double degrees);

typedef struct Bounds {
    Vec3 lo, hi; /* lo > hi: of nothing */
} Bounds;
Bounds bounds_none(void);
void bounds_add_mesh(Bounds *b, const TriMesh *m);
Vec3 bounds_centre(const Bounds *b); /* 0 of nothing */
double bounds_size(const Bounds *b); /* the diagonal; 1 of nothing or of a point */

/* A camera with these axes and this angle that just sees all that is added, in the middle. */
typedef struct Fit {
    Camera camera;
    double most[4]; /* of places along the normals of the sides of what it sees */
} Fit;
Fit fit_begin(Vec3 back, Vec3 up, double fov_deg, int width, int height);
void fit_add_mesh(Fit *f, const TriMesh *m);
Camera fit_camera(const Fit *f);
/* One that sees the box also when it is turned around `up` through the box's centre, at which it looks. */
Camera fit_turning(const Fit *f, const Bounds *b, Vec3 up);
