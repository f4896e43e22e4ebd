/* tree.c: the sum of R^2/d^2 over many points. A far group of M points counts as its centre of mass and its second
 * moments. Along any line 1/d^2 has the Taylor coefficients U_n / d^(n+2), U_n a Chebyshev polynomial of the second kind,
 * |U_3| <= 4: the third order left out is at most 4 R^2 sum|r|^3 / (D - radius)^5. A group is taken where that is at most
 * its share M/N of the error that is allowed, so the errors of all groups add up to no more. */
#include "scene/kernel.h"

#include <stdlib.h>

enum { LEAF = 8 };

typedef struct Builder {
    PointTree *tree;
    int capnode;
    double share;         /* of the error, a point */
} Builder;

static int compare_along(const void *pa, const void *pb, int axis)
{
    const Vec3 *a = pa, *b = pb;
    for (int k = 0; k < 3; k++) {
        double x = v_get(*a, (axis + k) % 3), y = v_get(*b, (axis + k) % 3);
        if (x != y) return x < y ? -1 : 1;
    }
    return 0;
}

static int compare_x(const void *a, const void *b) { return compare_along(a, b, 0); }
static int compare_y(const void *a, const void *b) { return compare_along(a, b, 1); }
static int compare_z(const void *a, const void *b) { return compare_along(a, b, 2); }

static TreeNode moments_of(const Builder *b, int begin, int end)
{
    const Vec3 *p = b->tree->point;
    TreeNode t = {.begin = begin, .end = end};
    double radius = 0, cube = 0, R = b->tree->R;
    for (int i = begin; i < end; i++) t.centre = v_add(t.centre, p[i]);
    t.centre = v_scale(t.centre, 1.0 / (end - begin));
    for (int i = begin; i < end; i++) {
        Vec3 r = v_sub(p[i], t.centre);
        double l = v_len(r), q[6] = {r.x * r.x, r.y * r.y, r.z * r.z, r.x * r.y, r.x * r.z, r.y * r.z};
        for (int k = 0; k < 6; k++) t.q[k] += q[k];
        cube += l * l * l;
        radius = real_max(radius, l);
    }
    double gap = pow(4 * R * R * cube / (b->share * (end - begin)), 0.2); /* where the bound above is the share */
    double far = radius * (1 + 1e-9) + real_max(gap * (1 + 1e-9), sqrt(CORE_W) * R);
    t.far2 = far * far;
    return t;
}

static int widest_axis(const Vec3 *p, int begin, int end)
{
    int axis = 0;
    double most = -1;
    for (int a = 0; a < 3; a++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int i = begin; i < end; i++) lo = real_min(lo, v_get(p[i], a)), hi = real_max(hi, v_get(p[i], a));
        if (hi - lo > most) most = hi - lo, axis = a;
    }
    return axis;
}

/* Halves as deep as log2 of the number of points. */
static void build(Builder *b, int begin, int end)
{
    PointTree *t = b->tree;
    int at = t->nnode++;
    RESERVE(t->node, b->capnode, t->nnode);
    t->node[at] = moments_of(b, begin, end);
    if (end - begin > LEAF) {
        int (*const compare[3])(const void *, const void *) = {compare_x, compare_y, compare_z};
        qsort(t->point + begin, (size_t)(end - begin), sizeof *t->point, compare[widest_axis(t->point, begin, end)]);
        int mid = begin + (end - begin) / 2;
        build(b, begin, mid);
        build(b, mid, end);
    }
    t->node[at].skip = t->nnode;
}

void tree_build(PointTree *t, int n, const Vec3 *point, double R, double error)
{
    *t = (PointTree){.point = NEW(Vec3, n), .R = R};
    for (int i = 0; i < n; i++) t->point[i] = point[i];
    Builder b = {.tree = t, .share = error / n};
    build(&b, 0, n);
}

void tree_free(PointTree *t)
{
    mem_free(t->node);
    mem_free(t->point);
    *t = (PointTree){0};
}

/* sum 1/d^2 = M/D^2 - tr Q/D^4 + 4 x.Qx/D^6, x from the centre to p. */
static double far_sum(const TreeNode *t, Vec3 x, double d2, Vec3 *grad)
{
    const double *q = t->q;
    double M = t->end - t->begin, i2 = 1 / d2, i4 = i2 * i2, i6 = i4 * i2, trace = q[0] + q[1] + q[2];
    Vec3 Qx = vec3(q[0] * x.x + q[3] * x.y + q[4] * x.z, q[3] * x.x + q[1] * x.y + q[5] * x.z, q[4] * x.x + q[5] * x.y + q[2] * x.z);
    double xQx = v_dot(x, Qx);
    *grad = v_axpy(v_scale(Qx, 8 * i6), -2 * M * i4 + 4 * trace * i6 - 24 * xQx * i6 * i2, x);
    return M * i2 - trace * i4 + 4 * xQx * i6;
}

double tree_sum(const PointTree *t, Vec3 p, Vec3 *grad)
{
    const double R2 = t->R * t->R, scale = 1 / R2;
    double sum = 0;
    for (int i = 0; i < t->nnode;) {
        const TreeNode *node = &t->node[i];
        Vec3 x = v_sub(p, node->centre), g;
        double d2 = v_len2(x);
        if (d2 > node->far2) {
            sum += R2 * far_sum(node, x, d2, &g);
            *grad = v_axpy(*grad, R2, g);
            i = node->skip;
            continue;
        }
        for (int k = node->begin; k < node->end && node->skip == i + 1; k++) {
            double slope;
            Vec3 r = v_sub(p, t->point[k]);
            sum += kernel_value(KERNEL_INVERSE_SQUARE, v_len2(r) * scale, &slope);
            *grad = v_axpy(*grad, 2 * slope * scale, r);
        }
        i++;
    }
    return sum;
}
