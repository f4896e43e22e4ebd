#include "mesh/orient.h"

/* --- exact sums: a nonoverlapping expansion, least component first (Shewchuk 1997, grow-expansion) --------------------- */

enum { EXPANSION_MAX = 48 };

typedef struct Expansion {
    int n;
    double part[EXPANSION_MAX];
} Expansion;

static void expansion_add(Expansion *e, double x)
{
    int n = 0;
    for (int i = 0; i < e->n; i++) {
        double sum = x + e->part[i], virtual = sum - x;
        double low = (x - (sum - virtual)) + (e->part[i] - virtual);
        if (low != 0) e->part[n++] = low;
        x = sum;
    }
    if (x != 0) e->part[n++] = x;
    e->n = n;
}

static int expansion_sign(const Expansion *e) { return e->n == 0 ? 0 : e->part[e->n - 1] > 0 ? 1 : -1; }

/* sign * x * y * z: the first product of two float32 is exact. */
static void add_product(Expansion *e, double sign, double x, double y, double z)
{
    double xy = sign * x * y, high = xy * z;
    expansion_add(e, fma(xy, z, -high));
    expansion_add(e, high);
}

static void add_determinant(Expansion *e, double sign, Vec3 p, Vec3 q, Vec3 r)
{
    add_product(e, sign, p.x, q.y, r.z);
    add_product(e, -sign, p.x, q.z, r.y);
    add_product(e, sign, p.y, q.z, r.x);
    add_product(e, -sign, p.y, q.x, r.z);
    add_product(e, sign, p.z, q.x, r.y);
    add_product(e, -sign, p.z, q.y, r.x);
}

int orient3_exact(Vec3 a, Vec3 b, Vec3 c, Vec3 d)
{
    Expansion e = {0};
    add_determinant(&e, 1, b, c, d);
    add_determinant(&e, -1, a, c, d);
    add_determinant(&e, 1, a, b, d);
    add_determinant(&e, -1, a, b, c);
    return expansion_sign(&e);
}

int orient3(Vec3 a, Vec3 b, Vec3 c, Vec3 d)
{
    Vec3 u = v_sub(b, a), v = v_sub(c, a), w = v_sub(d, a);
    double yz = u.y * v.z, zy = u.z * v.y, zx = u.z * v.x, xz = u.x * v.z, xy = u.x * v.y, yx = u.y * v.x;
    double det = w.x * (yz - zy) + w.y * (zx - xz) + w.z * (xy - yx);
    double all = fabs(w.x) * (fabs(yz) + fabs(zy)) + fabs(w.y) * (fabs(zx) + fabs(xz)) + fabs(w.z) * (fabs(xy) + fabs(yx));
    if (fabs(det) > ORIENT3_ERROR * all) return det > 0 ? 1 : -1;
    return all > 0 ? orient3_exact(a, b, c, d) : 0;
}

static int orient2_plane(double ax, double ay, double bx, double by, double cx, double cy)
{
    double left = (bx - ax) * (cy - ay), right = (by - ay) * (cx - ax), det = left - right, all = fabs(left) + fabs(right);
    if (fabs(det) > ORIENT2_ERROR * all) return det > 0 ? 1 : -1;
    if (!(all > 0)) return 0;
    const double term[6] = {bx * cy, -by * cx, cx * ay, -cy * ax, ax * by, -ay * bx};
    Expansion e = {0};
    for (int i = 0; i < 6; i++) expansion_add(&e, term[i]);
    return expansion_sign(&e);
}

int orient2(Vec3 a, Vec3 b, Vec3 c, int axis)
{
    if (axis == 0) return orient2_plane(a.y, a.z, b.y, b.z, c.y, c.z);
    if (axis == 1) return orient2_plane(a.z, a.x, b.z, b.x, c.z, c.x);
    return orient2_plane(a.x, a.y, b.x, b.y, c.x, c.y);
}
