/* vec.h: three-vectors and affine maps in double precision, by value. */
#pragma once
#include <math.h>

typedef struct Vec3 {
    double x, y, z;
} Vec3;

static inline Vec3 vec3(double x, double y, double z) { return (Vec3){x, y, z}; }
static inline Vec3 v_add(Vec3 a, Vec3 b) { return vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline Vec3 v_sub(Vec3 a, Vec3 b) { return vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline Vec3 v_scale(Vec3 a, double s) { return vec3(a.x * s, a.y * s, a.z * s); }
static inline Vec3 v_axpy(Vec3 a, double s, Vec3 b) { return vec3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z); }
static inline Vec3 v_mix(Vec3 a, Vec3 b, double t) { return v_axpy(a, t, v_sub(b, a)); }
static inline Vec3 v_mid(Vec3 a, Vec3 b) { return vec3(0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z)); }
static inline double v_dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec3 v_cross(Vec3 a, Vec3 b)
{
    return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double v_len2(Vec3 a) { return v_dot(a, a); }
static inline double v_len(Vec3 a) { return sqrt(v_len2(a)); }
static inline double v_dist(Vec3 a, Vec3 b) { return v_len(v_sub(a, b)); }
/* A unit vector along a; a itself where its length is 0. */
static inline Vec3 v_unit(Vec3 a)
{
    double l = v_len(a);
    return l > 0 ? v_scale(a, 1 / l) : a;
}
static inline double v_get(Vec3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }
static inline void v_set(Vec3 *a, int axis, double s) { *(axis == 0 ? &a->x : axis == 1 ? &a->y : &a->z) = s; }
/* Twice the area of (a, b, c) along its normal, counter-clockwise seen from the normal's tip. */
static inline Vec3 v_area2(Vec3 a, Vec3 b, Vec3 c) { return v_cross(v_sub(b, a), v_sub(c, a)); }
/* The nearest float32 of each coordinate: what a file holds. */
static inline Vec3 v_round32(Vec3 a) { return vec3((float)a.x, (float)a.y, (float)a.z); }

/* world = m * index + t; inv is m's inverse. */
typedef struct Affine {
    double m[3][3], inv[3][3];
    Vec3 t;
} Affine;

static inline Vec3 mat_mul(const double m[3][3], Vec3 p)
{
    return vec3(m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z, m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z,
                m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z);
}
static inline Vec3 mat_mul_transposed(const double m[3][3], Vec3 p)
{
    return vec3(m[0][0] * p.x + m[1][0] * p.y + m[2][0] * p.z, m[0][1] * p.x + m[1][1] * p.y + m[2][1] * p.z,
                m[0][2] * p.x + m[1][2] * p.y + m[2][2] * p.z);
}
static inline Vec3 affine_to_world(const Affine *a, Vec3 index) { return v_add(mat_mul(a->m, index), a->t); }
static inline Vec3 affine_to_index(const Affine *a, Vec3 world) { return mat_mul(a->inv, v_sub(world, a->t)); }
/* A gradient over the index turned into one over the world: inverse transpose. */
static inline Vec3 affine_gradient(const Affine *a, Vec3 g) { return mat_mul_transposed(a->inv, g); }
static inline double affine_det(const Affine *a)
{
    const double (*m)[3] = a->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}
/* Fills inv from m. False where m has no inverse (or holds what is no number). */
static inline int affine_invert(Affine *a)
{
    double d = affine_det(a);
    if (!(fabs(d) > 0) || !isfinite(1 / d)) return 0;
    const double (*m)[3] = a->m;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int r = (j + 1) % 3, s = (j + 2) % 3, c = (i + 1) % 3, e = (i + 2) % 3;
            a->inv[i][j] = (m[r][c] * m[s][e] - m[r][e] * m[s][c]) / d;
        }
    return 1;
}
