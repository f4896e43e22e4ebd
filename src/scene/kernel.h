/* kernel.h: k and ||.||_q, written in w = (d / radius)^2; k(1) = 1. */
#pragma once
#include "scene/scene_priv.h"

#define CORE_W 0.0625    /* within a quarter of the radius 1/d^2 goes on as a parabola: finite, smooth, 32 at the skeleton */
#define SUPPORT_W 4.0    /* the compact kernel ends at twice the radius */
#define SUPPORT 2.0
#define RATIO_LEAST 1e-9 /* of |r_i| to ||r||: q < 1 has infinite slopes where a coordinate is 0 */

static inline double kernel_value(KernelKind kind, double w, double *slope)
{
    if (kind == KERNEL_COMPACT) { /* (1 - w/4)^3, scaled to 1 at w = 1 */
        const double scale = 64.0 / 27, s = w < SUPPORT_W ? 1 - w / SUPPORT_W : 0;
        *slope = -0.75 * scale * s * s;
        return scale * s * s * s;
    }
    if (w >= CORE_W) {
        const double k = 1 / w;
        *slope = -k * k;
        return k;
    }
    *slope = -1 / (CORE_W * CORE_W);
    return (2 - w / CORE_W) / CORE_W;
}

/* ||r||_q, any q > 0. */
static inline double norm_length(double q, Vec3 r)
{
    double x = fabs(r.x), y = fabs(r.y), z = fabs(r.z);
    if (q == 2) return sqrt(x * x + y * y + z * z);
    if (q == 1) return x + y + z;
    double m = real_max(x, real_max(y, z));
    if (!(m > 0)) return 0;
    return m * pow(pow(x / m, q) + pow(y / m, q) + pow(z / m, q), 1 / q);
}

static inline double norm_slope(double q, double x, double length)
{
    double ratio = real_max(fabs(x) / length, RATIO_LEAST);
    return x == 0 ? 0 : (x < 0 ? -1 : 1) * pow(ratio, q - 1);
}

/* ||r||^2_q and its gradient; 0 at r = 0. */
static inline double norm_square(double q, Vec3 r, Vec3 *grad)
{
    if (q == 2) {
        *grad = v_scale(r, 2);
        return v_len2(r);
    }
    double n = norm_length(q, r);
    *grad = vec3(0, 0, 0);
    if (n > 0) *grad = v_scale(vec3(norm_slope(q, r.x, n), norm_slope(q, r.y, n), norm_slope(q, r.z, n)), 2 * n);
    return n * n;
}
