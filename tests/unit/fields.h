/* fields.h: analytic fields sampled into small grids, for the tests of what works on a Field.
 *
 * With TWINMESH_TOLD set in the environment these tests print the figures they judge.
 *
 * A FieldFn is a signed distance in voxels, positive inside, over index space; `k` are its numbers. */
#pragma once
#include "field/field.h"
#include "mechanics_shapes.h"

typedef double FieldFn(const double *k, Vec3 p);

/* centre, radius */
static inline double fn_ball(const double *k, Vec3 p) { return k[3] - v_dist(p, vec3(k[0], k[1], k[2])); }

/* twice fn_ball */
static inline double fn_two_balls(const double *k, Vec3 p) { return real_max(fn_ball(k, p), fn_ball(k + 4, p)); }

/* centre, radius of the circle about the z axis, radius of the tube */
static inline double fn_torus(const double *k, Vec3 p)
{
    Vec3 d = v_sub(p, vec3(k[0], k[1], k[2]));
    return k[4] - hypot(hypot(d.x, d.y) - k[3], d.z);
}

/* z of the middle, half the thickness */
static inline double fn_slab(const double *k, Vec3 p) { return k[1] - fabs(p.z - k[0]); }

/* centre, outer and inner radius */
static inline double fn_cavity(const double *k, Vec3 p)
{
    double r = v_dist(p, vec3(k[0], k[1], k[2]));
    return real_min(k[3] - r, r - k[4]);
}

/* centre, radius in the 1-norm */
static inline double fn_octahedron(const double *k, Vec3 p)
{
    return (k[3] - fabs(p.x - k[0]) - fabs(p.y - k[1]) - fabs(p.z - k[2])) / sqrt(3.0);
}

/* An x n x n samples; inside above 0. */
static inline Grid grid_of(int n, FieldFn *fn, const double *k)
{
    float *v = NEW(float, n * n * n);
    for (int i = 0; i < n * n * n; i++) v[i] = (float)fn(k, vec3(i % n, i / n % n, i / (n * n)));
    Grid g;
    grid_init(&g, 1);
    grid_from_dense(&g, v, (int[3]){n, n, n});
    mem_free(v);
    return g;
}

/* n x n x n samples even in [-0.5, 0.5); `steps` > 0: rounded to that many, 0 among them. */
static inline Grid grid_of_noise(int n, uint64_t seed, int steps)
{
    float *v = NEW(float, n * n * n);
    for (int i = 0; i < n * n * n; i++) {
        double x = shape_noise(&seed);
        v[i] = (float)(steps ? rint(x * steps) / steps : x);
    }
    Grid g;
    grid_init(&g, 1);
    grid_from_dense(&g, v, (int[3]){n, n, n});
    mem_free(v);
    return g;
}

/* Builds the field of a grid, which is given up. */
static inline Field field_from(Grid g)
{
    Field f;
    Err err = {0};
    FieldSpec spec = {0, false};
    if (!field_build(&f, &g, &spec, &err)) fail_msg("%s", err.text);
    grid_free(&g);
    return f;
}

static inline Field field_of(int n, FieldFn *fn, const double *k) { return field_from(grid_of(n, fn, k)); }

/* A transform from its columns and its place. */
static inline Affine affine_of(Vec3 x, Vec3 y, Vec3 z, Vec3 t)
{
    Affine a = {.m = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}, .t = t};
    if (!affine_invert(&a)) fail_msg("no transform");
    return a;
}
