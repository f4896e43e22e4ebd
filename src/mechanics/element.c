#include "mechanics/mechanics_priv.h"

void element_stiffness(double young, double poisson, double k[6][6])
{
    ASSERT(young > 0 && poisson > -1 && poisson < 1);
    /* gradients of the shape functions for side 1: strain eps = B d */
    const double h = 0.5 * sqrt(3.0), area = 0.5 * h;
    const double gx[3] = {-1, 1, 0}, gy[3] = {-0.5 / h, -0.5 / h, 1 / h};
    /* plane stress: sigma = D eps, D = E / (1 - nu^2) [1 nu 0; nu 1 0; 0 0 (1 - nu) / 2] */
    const double d0 = young / (1 - poisson * poisson), d1 = poisson * d0, d2 = 0.5 * (1 - poisson) * d0;
    /* K = area B^T D B */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            k[2 * i][2 * j] = area * (d0 * (gx[i] * gx[j]) + d2 * (gy[i] * gy[j]));
            k[2 * i][2 * j + 1] = area * (d1 * (gx[i] * gy[j]) + d2 * (gy[i] * gx[j]));
            k[2 * i + 1][2 * j] = area * (d1 * (gy[i] * gx[j]) + d2 * (gx[i] * gy[j]));
            k[2 * i + 1][2 * j + 1] = area * (d0 * (gy[i] * gy[j]) + d2 * (gx[i] * gx[j]));
        }
}

/* A unit vector across x, along n x x where that is one, else along the axis that x leans to least. */
static Vec3 unit_across(Vec3 n, Vec3 x)
{
    Vec3 y = v_cross(n, x);
    if (v_len2(y) > ELEMENT_FLAT) return v_unit(y);
    double ax = fabs(x.x), ay = fabs(x.y), az = fabs(x.z);
    Vec3 axis = ax <= ay && ax <= az ? vec3(1, 0, 0) : ay <= az ? vec3(0, 1, 0) : vec3(0, 0, 1);
    return v_unit(v_cross(axis, x));
}

/* Turns the frame x, y, in which v = (vx, 0) and w = (wx, wy > 0), to the rotation nearest to the triangle's
 * deformation gradient G: tan = (G21 - G12) / (G11 + G22). */
static ElementFrame polar_frame(Vec3 x, Vec3 y, double vx, double wx, double wy)
{
    const double h = 0.5 * sqrt(3.0); /* for side 1: only ratios count */
    double c = vx + wy / h, s = -(wx - 0.5 * vx) / h, l = sqrt(c * c + s * s);
    c /= l;
    s /= l;
    return (ElementFrame){v_axpy(v_scale(x, c), s, y), v_axpy(v_scale(y, c), -s, x)};
}

ElementFrame element_frame(const Vec3 p[3], const Vec3 normal[3], bool inverted, int *turn)
{
    double len2[3];
    int longest = 0;
    for (int i = 0; i < 3; i++) {
        len2[i] = v_len2(v_sub(p[(i + 1) % 3], p[i]));
        if (len2[i] > len2[longest]) longest = i;
    }
    *turn = 0;
    if (!(len2[longest] > 0)) return (ElementFrame){0};

    /* the height over the longest edge against that edge: |u-v x u-w| / |u-v|^2 */
    double least = ELEMENT_FLAT * len2[longest];
    bool flat = v_len2(v_area2(p[0], p[1], p[2])) <= least * least;
    int t = flat || inverted ? longest : 0;
    *turn = t;
    Vec3 u = p[t], v = p[(t + 1) % 3], w = p[(t + 2) % 3];
    Vec3 x = v_unit(v_sub(v, u));
    if (flat) return (ElementFrame){x, unit_across(normal[(t + 2) % 3], x)};
    Vec3 uw = v_sub(w, u);
    Vec3 y = v_unit(v_axpy(uw, -v_dot(uw, x), x));
    if (inverted) return (ElementFrame){x, v_scale(y, -1)};
    return polar_frame(x, y, v_dot(v_sub(v, u), x), v_dot(uw, x), v_dot(uw, y));
}

void element_force(double k[6][6], double rest, const ElementFrame *frame, const Vec3 uvw[3], Vec3 f[3])
{
    /* d = R^T x - x0 relative to u. Of an inverted element y is reflected, so that d's last component reads
     * -w^y - w0^y as in 2.6.2. */
    const Vec3 v0 = v_scale(frame->x, rest), up = v_scale(frame->y, 0.5 * sqrt(3.0) * rest);
    Vec3 dv = v_sub(v_sub(uvw[1], uvw[0]), v0);
    Vec3 dw = v_sub(v_sub(uvw[2], uvw[0]), v_axpy(up, 0.5, v0));
    element_apply(k, frame, vec3(0, 0, 0), dv, dw, f); /* reads the parts along x and y only */
    for (int i = 0; i < 3; i++) f[i] = v_scale(f[i], -1);
}
