/* part.c: the distance to points, segments, triangles and polylines, and what the kernels make of it. */
#include "scene/kernel.h"

/* The way r to p from the nearest place (by ||.||_2) on a part. That place slides along with p: `dim` 0 not at all,
 * 1 along the line `dir`, 2 in the plane across `dir`. */
typedef struct Foot {
    Vec3 r, dir;
    int dim;
} Foot;

static Foot foot_on_segment(Vec3 p, Vec3 a, Vec3 b)
{
    Vec3 d = v_sub(b, a), ap = v_sub(p, a);
    double len2 = v_len2(d), t = len2 > 0 ? v_dot(ap, d) / len2 : 0;
    if (t <= 0) return (Foot){.r = ap};
    if (t >= 1) return (Foot){.r = v_sub(p, b)};
    return (Foot){v_axpy(ap, -t, d), v_scale(d, 1 / sqrt(len2)), 1};
}

static Foot nearer(Foot a, Foot b) { return v_len2(b.r) < v_len2(a.r) ? b : a; }

static Foot foot_on_triangle(Vec3 p, const Vec3 *q)
{
    Vec3 n = v_cross(v_sub(q[1], q[0]), v_sub(q[2], q[0]));
    bool within = v_len2(n) > 0;
    for (int k = 0; k < 3 && within; k++) {
        Vec3 a = q[k], b = q[(k + 1) % 3];
        within = v_dot(v_cross(v_sub(b, a), v_sub(p, a)), n) >= 0;
    }
    if (within) {
        n = v_unit(n);
        return (Foot){v_scale(n, v_dot(n, v_sub(p, q[0]))), n, 2};
    }
    return nearer(nearer(foot_on_segment(p, q[0], q[1]), foot_on_segment(p, q[1], q[2])), foot_on_segment(p, q[2], q[0]));
}

static Foot foot_on_part(const Element *e, int part, Vec3 p)
{
    const Vec3 *q = e->corner;
    switch (e->shape) {
    case SHAPE_POINTS: return (Foot){.r = v_sub(p, q[part])};
    case SHAPE_SEGMENTS: return foot_on_segment(p, q[2 * part], q[2 * part + 1]);
    case SHAPE_TRIANGLES: return foot_on_triangle(p, q + 3 * part);
    default: break;
    }
    Foot best = foot_on_segment(p, q[0], q[1]);
    for (int i = 1; i + 1 < e->ncorner; i++) best = nearer(best, foot_on_segment(p, q[i], q[i + 1]));
    return best;
}

static double part_add(const Pose *ps, int part, Vec3 p, Vec3 *grad)
{
    const Element *e = ps->e;
    Foot f = foot_on_part(e, part, p);
    Vec3 g;
    double slope, scale = 1 / (ps->radius * ps->radius);
    double k = kernel_value(e->kernel, norm_square(e->norm, f.r, &g) * scale, &slope);
    if (f.dim == 1) g = v_axpy(g, -v_dot(g, f.dir), f.dir);
    if (f.dim == 2) g = v_scale(f.dir, v_dot(g, f.dir));
    *grad = v_axpy(*grad, slope * scale, g);
    return k;
}

/* Few points under ||.||_2: whole lanes at a time. */
static void add_points(const Pose *ps, int n, const Lanes *p, double *phi, Lanes *g)
{
    const double scale = 1 / (ps->radius * ps->radius);
    for (int i = 0; i < ps->e->npart; i++) {
        const Vec3 q = ps->e->corner[i];
        for (int l = 0; l < n; l++) {
            double x = p->x[l] - q.x, y = p->y[l] - q.y, z = p->z[l] - q.z, slope;
            phi[l] += kernel_value(ps->e->kernel, (x * x + y * y + z * z) * scale, &slope);
            slope *= 2 * scale;
            g->x[l] += slope * x;
            g->y[l] += slope * y;
            g->z[l] += slope * z;
        }
    }
}

static double add_one(const Pose *ps, Vec3 p, Vec3 *grad)
{
    *grad = vec3(0, 0, 0);
    if (ps->tree.nnode) return tree_sum(&ps->tree, p, grad);
    bool indexed = ps->index.cell > 0;
    int n = ps->e->npart;
    const int32_t *part = indexed ? index_at(&ps->index, p, &n) : NULL;
    double sum = 0;
    for (int i = 0; i < n; i++) sum += part_add(ps, indexed ? part[i] : i, p, grad);
    return sum;
}

void pose_add(const Pose *ps, int n, const Lanes *p, double *phi, Lanes *g)
{
    ASSERT(n <= LANES);
    if (ps->e->shape == SHAPE_POINTS && ps->e->norm == 2 && !ps->tree.nnode && !(ps->index.cell > 0)) {
        add_points(ps, n, p, phi, g);
        return;
    }
    for (int l = 0; l < n; l++) {
        Vec3 grad;
        phi[l] += add_one(ps, vec3(p->x[l], p->y[l], p->z[l]), &grad);
        g->x[l] += grad.x;
        g->y[l] += grad.y;
        g->z[l] += grad.z;
    }
}

/* --- bounds ----------------------------------------------------------------------------------------------- */

/* r moves no farther than p does: each coordinate stays within `radius` of what it is at the centre. */
static void length_bound(double q, Vec3 r, double radius, double *low, double *high)
{
    if (!isfinite(radius)) {
        *low = 0;
        *high = INFINITY;
        return;
    }
    Vec3 a = vec3(real_max(fabs(r.x) - radius, 0), real_max(fabs(r.y) - radius, 0), real_max(fabs(r.z) - radius, 0));
    *low = norm_length(q, a);
    *high = norm_length(q, vec3(fabs(r.x) + radius, fabs(r.y) + radius, fabs(r.z) + radius));
    if (q == 2) *low = real_max(*low, v_len(r) - radius), *high = real_min(*high, v_len(r) + radius);
}

static Foot foot_of_polyline(const Element *e, int i, Vec3 p) { return foot_on_segment(p, e->corner[i], e->corner[i + 1]); }

bool part_bound(const Pose *ps, int part, Vec3 c, double radius, double *low, double *high)
{
    const Element *e = ps->e;
    double near = 0, far = INFINITY, slope;
    if (e->shape != SHAPE_POLYLINE || !isfinite(radius)) {
        length_bound(e->norm, isfinite(radius) ? foot_on_part(e, part, c).r : vec3(0, 0, 0), radius, &near, &far);
    } else {
        /* any of the segments that may be nearest by ||.||_2 may be it */
        double best = v_len(foot_on_part(e, part, c).r) + 2 * radius;
        near = INFINITY, far = 0;
        for (int i = 0; i + 1 < e->ncorner; i++) {
            Vec3 r = foot_of_polyline(e, i, c).r;
            double a, b;
            if (v_len(r) > best) continue;
            length_bound(e->norm, r, radius, &a, &b);
            near = real_min(near, a), far = real_max(far, b);
        }
    }
    near /= ps->radius, far /= ps->radius;
    *high = kernel_value(e->kernel, near * near, &slope);
    *low = isfinite(far) ? kernel_value(e->kernel, far * far, &slope) : 0;
    return *high > 0;
}
