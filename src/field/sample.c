/* sample.c: F and the smooth gradient in batches. */
#include "field/field_priv.h"

#include <string.h>

enum { LANES = 32, NORMALS = 64, Y = BRICK_SPAN, Z = BRICK_SPAN * BRICK_SPAN };

/* The 32 samples that central differences at a cell's corners need: the 4x4x4 block around the cell without its
 * edges and corners. Per axis: the corners' neighbours below and above. STENCIL[8 + 8 axis + c]: corner c's sample
 * at -1 (corners with bit axis 0) or at +1 (bit axis 1); the other neighbour is a corner of the cell itself. */
static int stencil_offset(int k)
{
    int c = k & 7, at = (c & 1) + Y * (c >> 1 & 1) + Z * (c >> 2), axis = (k >> 3) - 1;
    if (axis < 0) return at;
    int step = axis == 0 ? 1 : axis == 1 ? Y : Z;
    return at + (c >> axis & 1 ? step : -step);
}

typedef struct Lanes {
    double v[32][LANES];
    double x[LANES], y[LANES], z[LANES];
    double F[LANES], g[3][LANES];
} Lanes;



static void gather(const Field *f, int n, const Vec3 *p, Lanes *l, bool *found)
{
    int offset[32];
    for (int k = 0; k < 32; k++) offset[k] = stencil_offset(k);
    for (int i = 0; i < n; i++) {
        Spot s;
        found[i] = field_locate(f, p[i], &s);
        l->x[i] = found[i] ? s.x : 0;
        l->y[i] = found[i] ? s.y : 0;
        l->z[i] = found[i] ? s.z : 0;
        for (int k = 0; k < 32; k++) l->v[k][i] = found[i] ? (double)s.v[offset[k]] : 0;
    }
    for (int i = n; i < LANES; i++) {
        l->x[i] = l->y[i] = l->z[i] = 0;
        for (int k = 0; k < 32; k++) l->v[k][i] = 0;
    }
}

/* Trilinear interpolation of eight rows of lanes. */
static void blend8(const double v[8][LANES], const Lanes *l, double *out)
{
    for (int i = 0; i < LANES; i++) {
        double a0 = v[0][i] + l->x[i] * (v[1][i] - v[0][i]), a1 = v[2][i] + l->x[i] * (v[3][i] - v[2][i]);
        double a2 = v[4][i] + l->x[i] * (v[5][i] - v[4][i]), a3 = v[6][i] + l->x[i] * (v[7][i] - v[6][i]);
        double b0 = a0 + l->y[i] * (a1 - a0), b1 = a2 + l->y[i] * (a3 - a2);
        out[i] = b0 + l->z[i] * (b1 - b0);
    }
}

static void evaluate(Lanes *l)
{
    blend8((const double(*)[LANES])l->v, l, l->F);
    for (int axis = 0; axis < 3; axis++) {
        double d[8][LANES];
        for (int c = 0; c < 8; c++) {
            const double *own = l->v[c ^ (1 << axis)], *far = l->v[8 + 8 * axis + c];
            double sign = c >> axis & 1 ? 0.5 : -0.5;
            for (int i = 0; i < LANES; i++) d[c][i] = sign * (far[i] - own[i]);
        }
        blend8((const double(*)[LANES])d, l, l->g[axis]);
    }
}

void field_sample(const Field *f, int n, const Vec3 *p, double *F, Vec3 *grad)
{
    Lanes l;
    bool found[LANES];
    for (int begin = 0; begin < n; begin += LANES) {
        int m = int_min(LANES, n - begin);
        gather(f, m, p + begin, &l, found);
        evaluate(&l);
        for (int i = 0; i < m; i++) {
            F[begin + i] = found[i] ? f->sign * (l.F[i] - f->iso) : -f->far;
            if (grad) grad[begin + i] = affine_gradient(&f->xform, v_scale(vec3(l.g[0][i], l.g[1][i], l.g[2][i]), f->sign));
        }
    }
    if (f->exact.sample && grad) exact_sample(f, n, p, F, grad);
}

/* The central differences along one axis, interpolated: `step` to the next sample along it, t of the way; the other axes
 * likewise. */
static inline double slope_along(const float *v, int step, double t, int step1, double t1, int step2, double t2)
{
    double d[4];
    for (int k = 0; k < 4; k++) {
        const float *row = v + (k & 1 ? step1 : 0) + (k & 2 ? step2 : 0);
        double below = (double)row[step] - (double)row[-step], above = (double)row[2 * step] - (double)row[0];
        d[k] = below + t * (above - below);
    }
    double a = d[0] + t1 * (d[1] - d[0]), b = d[2] + t1 * (d[3] - d[2]);
    return 0.5 * (a + t2 * (b - a));
}

Vec3 spot_gradient(const Field *f, const Spot *s)
{
    double gx = slope_along(s->v, 1, s->x, Y, s->y, Z, s->z), gy = slope_along(s->v, Y, s->y, 1, s->x, Z, s->z);
    double gz = slope_along(s->v, Z, s->z, 1, s->x, Y, s->y);
    return affine_gradient(&f->xform, v_scale(vec3(gx, gy, gz), f->sign));
}

Vec3 field_gradient(const Field *f, Vec3 p)
{
    Spot s;
    Vec3 g = field_locate(f, p, &s) ? spot_gradient(f, &s) : vec3(0, 0, 0);
    if (f->exact.sample) exact_sample(f, 1, &p, &(double){0}, &g);
    return g;
}

Vec3 spot_steer(const Field *f, const Spot *spot)
{
    Vec3 smooth = spot_gradient(f, spot), cell = spot_cell_gradient(f, spot);
    /* in a sheet thinner than two voxels the central differences see the other side: the cell knows better */
    double s = v_len(smooth), c = v_len(cell);
    return v_dot(smooth, cell) >= FIELD_STEER_COS * s * c && s > 0 ? smooth : cell;
}

Vec3 field_steer(const Field *f, Vec3 p)
{
    Spot s;
    return field_locate(f, p, &s) ? spot_steer(f, &s) : vec3(0, 0, 0);
}

void field_normals(const Field *f, int n, const Vec3 *p, Vec3 *normal)
{
    for (int i = 0; i < n; i++) normal[i] = field_steer(f, p[i]);
    if (f->exact.sample) {
        double F[NORMALS];
        for (int i = 0; i < n; i += NORMALS) exact_sample(f, int_min(NORMALS, n - i), p + i, F, normal + i);
    }
    for (int i = 0; i < n; i++) {
        double l = v_len(normal[i]);
        normal[i] = l > 0 ? v_scale(normal[i], -1 / l) : vec3(0, 0, 1);
    }
}

double field_distance_vox(const Field *f, Vec3 p)
{
    Vec3 g;
    double F = field_value(f, p, &g, NULL), l = v_len(g), d = l > 0 ? fabs(F) / (l * f->voxel) : INFINITY;
    if (!exact_is_known(f, p)) return d;
    f->exact.sample(f->exact.ctx, 1, &p, &F, &g);
    l = v_len(g);
    return l > 0 ? real_min(d, fabs(F) / (l * f->voxel)) : d;
}
