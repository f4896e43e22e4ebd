/* pose.c: the scene at a frame. */
#include "scene/kernel.h"

enum { TREE_LEAST = 64 };
static const double PI = 3.14159265358979323846;

/* w x y z to a matrix; the quaternion need not be a unit one. */
static void matrix_of(const double q[4], double m[3][3])
{
    double l = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    double w = q[0] / l, x = q[1] / l, y = q[2] / l, z = q[3] / l;
    const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) m[i][j] = r[i][j];
}

static void place(Pose *p, double frame)
{
    const Element *e = p->e;
    double q[4] = {1, 0, 0, 0}, s[3], t[3], degrees;
    if (e->degrees.n) {
        keys_at(&e->degrees, frame, &degrees);
        double half = degrees * PI / 360, along = sin(half);
        Vec3 a = v_unit(e->axis);
        q[0] = cos(half), q[1] = along * a.x, q[2] = along * a.y, q[3] = along * a.z;
    } else {
        keys_at(&e->rotate, frame, q);
    }
    keys_at(&e->translate, frame, t);
    keys_at(&e->scale, frame, s);
    if (e->scale.width == 1) s[1] = s[2] = s[0];
    double r[3][3];
    matrix_of(q, r);
    p->shrink = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            p->place.m[i][j] = r[i][j] * s[j];
            p->place.inv[j][i] = r[i][j] / s[j];
        }
        p->shrink = real_max(p->shrink, 1 / fabs(s[i]));
    }
    p->shrink *= 1 + 1e-12;
    p->place.t = vec3(t[0], t[1], t[2]);
}

static void pose_element(Pose *p, const Scene *s, const Element *e, double frame)
{
    *p = (Pose){.e = e};
    place(p, frame);
    keys_at(&e->radius, frame, &p->radius);
    for (int k = 0; k < e->nwarp; k++) {
        keys_at(&e->warp[k].amount, frame, &p->amount[k]);
        if (e->warp[k].kind != WARP_TAPER) p->amount[k] *= PI / 180;
    }
    if (e->kernel == KERNEL_COMPACT) index_build(&p->index, e, SUPPORT * p->radius);
    else if (e->shape == SHAPE_POINTS && e->norm == 2 && e->npart > TREE_LEAST) tree_build(&p->tree, e->npart, e->corner, p->radius, s->tolerance * s->iso / fabs(e->strength) / s->nelement);
}

SceneFrame *scene_frame(const Scene *s, int64_t frame)
{
    SceneFrame *f = NEW0(SceneFrame, 1);
    f->scene = s;
    f->frame = (double)frame;
    f->pose = NEW(Pose, s->nelement);
    for (int i = 0; i < s->nelement; i++) pose_element(&f->pose[i], s, &s->element[i], f->frame);
    return f;
}

void scene_frame_free(SceneFrame *f)
{
    if (!f) return;
    for (int i = 0; i < f->scene->nelement; i++) {
        index_free(&f->pose[i].index);
        tree_free(&f->pose[i].tree);
    }
    mem_free(f->pose);
    mem_free(f);
}

/* --- F and its gradient ----------------------------------------------------------------------------------- */

/* Clears n lanes only: most callers ask for one point. */
static void lanes_clear(Lanes *l, int n)
{
    for (int i = 0; i < n; i++) l->x[i] = l->y[i] = l->z[i] = 0;
}

static Vec3 lane_at(const Lanes *l, int i) { return vec3(l->x[i], l->y[i], l->z[i]); }
static void lane_set(Lanes *l, int i, Vec3 p) { l->x[i] = p.x, l->y[i] = p.y, l->z[i] = p.z; }

/* One element's part of a chunk: to its straight local space, and the gradients back. way[k] is what warp k - 1 gets. */
static void add_element(const Pose *ps, int n, const Vec3 *p, double *phi, Lanes *grad)
{
    const Element *e = ps->e;
    Lanes way[WARPS_MAX + 1], g;
    double sum[LANES];
    lanes_clear(&g, n);
    for (int i = 0; i < n; i++) {
        sum[i] = 0;
        Vec3 q = affine_to_index(&ps->place, p[i]);
        lane_set(&way[e->nwarp], i, q);
        for (int k = e->nwarp - 1; k >= 0; k--) {
            q = warp_undo(e->warp[k].kind, e->warp[k].axis, ps->amount[k], q);
            lane_set(&way[k], i, q);
        }
    }
    pose_add(ps, n, &way[0], sum, &g);
    for (int i = 0; i < n; i++) {
        phi[i] += e->strength * sum[i];
        if (!grad) continue;
        Vec3 back = v_scale(lane_at(&g, i), e->strength);
        for (int k = 0; k < e->nwarp; k++) back = warp_gradient(e->warp[k].kind, e->warp[k].axis, ps->amount[k], lane_at(&way[k + 1], i), back);
        lane_set(grad, i, v_add(lane_at(grad, i), affine_gradient(&ps->place, back)));
    }
}

void scene_sample(const SceneFrame *f, int n, const Vec3 *p, double *F, Vec3 *grad)
{
    for (int begin = 0; begin < n; begin += LANES) {
        int m = int_min(LANES, n - begin);
        double phi[LANES];
        Lanes g;
        lanes_clear(&g, m);
        for (int i = 0; i < m; i++) phi[i] = 0;
        for (int i = 0; i < f->scene->nelement; i++) add_element(&f->pose[i], m, p + begin, phi, grad ? &g : NULL);
        for (int i = 0; i < m; i++) {
            F[begin + i] = phi[i] - f->scene->iso;
            if (grad) grad[begin + i] = lane_at(&g, i);
        }
    }
}

static void exact_sample(const void *ctx, int n, const Vec3 *p, double *F, Vec3 *grad) { scene_sample(ctx, n, p, F, grad); }

FieldExact scene_exact(const SceneFrame *f) { return (FieldExact){exact_sample, f}; }
