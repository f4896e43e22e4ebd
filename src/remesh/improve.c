/* improve.c: poor triangles made better by moving their corners alone: connectivity is worth keeping. */
#include "remesh/remesh_priv.h"

enum { PASSES = 3, TRIES = 3 };
#define POOR 0.87     /* an isosceles triangle with an angle of 33 degrees has 0.82 or 0.66 */
#define GAIN 0.005
#define REACH 0.3     /* a landing is at most this far from its target, in edges wanted */

/* The poorest of the triangles around v if it stood at p, where the normal is n. */
static Fitness ring_fitness(const Remesh *r, int v, Vec3 p, Vec3 n)
{
    const Mesh *m = r->mesh;
    Fitness worst = fitness_best();
    int h = m->out[v];
    do {
        int a = he_to(m, h), b = m->corner[he_prev(h)];
        fitness_worsen(&worst, triangle_fitness((Vec3[3]){p, m->pos[a], m->pos[b]}, (Vec3[3]){n, r->normal[a], r->normal[b]}));
    } while ((h = he_around(m, h)) != m->out[v]);
    return worst;
}

static double ring_deviation(const Remesh *r, int v, Vec3 p)
{
    const Mesh *m = r->mesh;
    double worst = 0;
    int h = m->out[v];
    do worst = real_max(worst, triangle_deviation(r->field, (Vec3[3]){p, m->pos[he_to(m, h)], m->pos[m->corner[he_prev(h)]]}));
    while ((h = he_around(m, h)) != m->out[v]);
    return worst;
}

/* Is any of them poorer than `least`? */
static bool is_poor(const Remesh *r, int v, Vec3 p, double least)
{
    const Mesh *m = r->mesh;
    int h = m->out[v];
    do
        if (triangle_quality(p, m->pos[he_to(m, h)], m->pos[m->corner[he_prev(h)]]) < least) return true;
    while ((h = he_around(m, h)) != m->out[v]);
    return false;
}

/* The mean of the places where the triangles around v would be equilateral, the poorest counting most. */
static Vec3 find_target(const Remesh *r, int v)
{
    const Mesh *m = r->mesh;
    Vec3 sum = vec3(0, 0, 0);
    double weight = 0;
    int h = m->out[v];
    do {
        Vec3 p = m->pos[v], a = m->pos[he_to(m, h)], b = m->pos[m->corner[he_prev(h)]];
        Vec3 up = v_cross(v_area2(p, a, b), v_sub(b, a)); /* in the triangle, from its edge towards v */
        double l = v_len(up), q = triangle_quality(p, a, b), w = 1 / (real_max(q, 0.05) * real_max(q, 0.05));
        if (!(l > 0)) continue;
        sum = v_axpy(sum, w, v_axpy(v_mid(a, b), 0.8660254037844386 * v_dist(a, b) / l, up));
        weight += w;
    } while ((h = he_around(m, h)) != m->out[v]);
    return weight > 0 ? v_scale(sum, 1 / weight) : m->pos[v];
}

static bool improve_vertex(Remesh *r, int v)
{
    Mesh *m = r->mesh;
    Vec3 was = m->pos[v];
    Fitness before = ring_fitness(r, v, was, r->normal[v]);
    Vec3 target = find_target(r, v);
    for (int k = 0; k < TRIES; k++) {
        Vec3 p = v_mix(was, target, 1.0 / (1 << k));
        if (is_poor(r, v, p, before.quality + GAIN) || !remesh_land_point(r, v, &p, REACH * r->edge)) continue;
        Vec3 n = remesh_normal_at(r, p);
        if (v_dot(n, r->normal[v]) <= 0) continue;
        Fitness after = ring_fitness(r, v, p, n);
        if (after.quality < before.quality + GAIN || after.facing < real_min(LIMITS_EDIT.facing, before.facing)) continue;
        double far = ring_deviation(r, v, p);
        if (far > LIMITS_EDIT.deviation_vox && far > ring_deviation(r, v, was)) continue;
        m->pos[v] = p;
        r->normal[v] = n;
        return true;
    }
    return false;
}

static void wake_ring(const Mesh *m, int v, uint8_t *settled)
{
    int h = m->out[v];
    settled[v] = 0;
    do settled[he_to(m, h)] = 0;
    while ((h = he_around(m, h)) != m->out[v]);
}

void remesh_improve(Remesh *r, const uint8_t *held)
{
    const Mesh *m = r->mesh;
    uint8_t *settled = NEW0(uint8_t, m->nvert); /* nothing around the vertex has moved since it was last looked at */
    int moved = 1;
    for (int k = 0; k < PASSES && moved; k++) {
        moved = 0;
        for (int v = 0; v < m->nvert; v++) {
            if (settled[v] || vert_is_dead(m, v) || (held && held[v]) || !remesh_in_zone(r, v)) continue;
            settled[v] = 1;
            if (!is_poor(r, v, m->pos[v], POOR) || !improve_vertex(r, v)) continue;
            wake_ring(m, v, settled);
            moved++;
        }
    }
    mem_free(settled);
}
