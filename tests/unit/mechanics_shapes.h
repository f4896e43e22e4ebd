/* mechanics_shapes.h: small meshes for the tests of src/mechanics. */
#pragma once
#include "base/hash.h"
#include "mechanics/mechanics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

typedef struct Shape {
    int nvert, ntri;
    Vec3 *pos;
    int32_t *tri;
} Shape;

static inline void shape_free(Shape *s)
{
    mem_free(s->pos);
    mem_free(s->tri);
    *s = (Shape){0};
}

/* Even in [-0.5, 0.5); the same series in every run. */
static inline double shape_noise(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(hash_mix(*seed) >> 11) / 9007199254740992.0 - 0.5;
}

static inline Vec3 shape_noise3(uint64_t *seed)
{
    double x = shape_noise(seed), y = shape_noise(seed), z = shape_noise(seed);
    return vec3(x, y, z);
}

/* Equilateral triangles of side 1 in the plane z = 0: m rows of n quads, sheared. Counter-clockwise from +z. */
static inline Shape shape_sheet(int n, int m)
{
    Shape s = {.nvert = (n + 1) * (m + 1), .ntri = 2 * n * m};
    s.pos = NEW(Vec3, s.nvert);
    s.tri = NEW(int32_t, 3 * s.ntri);
    for (int y = 0; y <= m; y++)
        for (int x = 0; x <= n; x++) s.pos[y * (n + 1) + x] = vec3(x + 0.5 * (y % 2), 0.5 * sqrt(3.0) * y, 0);
    int32_t *t = s.tri;
    for (int y = 0; y < m; y++)
        for (int x = 0; x < n; x++) {
            int a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
            int quad[6] = {a, b, y % 2 ? d : c, y % 2 ? a : b, d, c};
            for (int i = 0; i < 6; i++) *t++ = quad[i];
        }
    return s;
}

/* The unit sphere: an octahedron whose triangles are cut in four, `level` times. */
static inline Shape shape_sphere(int level)
{
    static const double corner[6][3] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    static const int face[8][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4},
                                    {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}};
    Shape s = {.nvert = 6, .ntri = 8, .pos = NEW(Vec3, 6), .tri = NEW(int32_t, 24)};
    for (int v = 0; v < 6; v++) s.pos[v] = vec3(corner[v][0], corner[v][1], corner[v][2]);
    for (int i = 0; i < 24; i++) s.tri[i] = face[i / 3][i % 3];
    for (; level > 0; level--) {
        Shape f = {.nvert = s.nvert, .ntri = 4 * s.ntri};
        f.pos = NEW(Vec3, s.nvert + s.ntri * 3 / 2);
        f.tri = NEW(int32_t, 3 * f.ntri);
        memcpy(f.pos, s.pos, (size_t)s.nvert * sizeof *f.pos);
        Map mid;
        map_init(&mid, 2 * s.ntri);
        for (int t = 0; t < s.ntri; t++) {
            int c[6];
            for (int i = 0; i < 3; i++) {
                int a = s.tri[3 * t + i], b = s.tri[3 * t + (i + 1) % 3];
                c[i] = a;
                c[3 + i] = map_put(&mid, key_pair(int_min(a, b), int_max(a, b)), f.nvert);
                if (c[3 + i] == f.nvert) f.pos[f.nvert++] = v_unit(v_mid(s.pos[a], s.pos[b]));
            }
            int part[12] = {c[0], c[3], c[5], c[1], c[4], c[3], c[2], c[5], c[4], c[3], c[4], c[5]};
            for (int i = 0; i < 12; i++) f.tri[12 * t + i] = part[i];
        }
        map_free(&mid);
        shape_free(&s);
        s = f;
    }
    return s;
}

static inline double shape_mean_edge(const Shape *s)
{
    double sum = 0;
    for (int t = 0; t < s->ntri; t++)
        for (int i = 0; i < 3; i++) sum += v_dist(s->pos[s->tri[3 * t + i]], s->pos[s->tri[3 * t + (i + 1) % 3]]);
    return sum / (3 * s->ntri);
}

static inline void assert_near(double a, double b, double eps)
{
    if (!(fabs(a - b) <= eps)) fail_msg("%.17g is not %.17g within %g", a, b, eps);
}

static inline void assert_near3(Vec3 a, Vec3 b, double eps)
{
    assert_near(a.x, b.x, eps);
    assert_near(a.y, b.y, eps);
    assert_near(a.z, b.z, eps);
}
