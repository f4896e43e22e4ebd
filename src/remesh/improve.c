/* improve.c: poor triangles made better by moving their corners alone: connectivity is worth keeping.
 * One after the other; but where a corner would go is found for all at once, and again only where a neighbour has moved since. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

#include <string.h>

enum { PASSES = 3, TRIES = 3, GRAIN = 128 };
#define POOR 0.85     /* an isosceles triangle has that with an angle of 36 degrees between its sides, or of 44 at its base */
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

/* A better place for vertex v, and the normal there. */
static bool find_place(const Remesh *r, int v, Vec3 *place, Vec3 *normal)
{
    Vec3 was = r->mesh->pos[v];
    Fitness before = ring_fitness(r, v, was, r->normal[v]);
    Vec3 target = find_target(r, v);
    for (int k = 0; k < TRIES; k++) {
        Vec3 p = v_mix(was, target, 1.0 / (1 << k)), n;
        if (is_poor(r, v, p, before.quality + GAIN) || !remesh_land_point(r, v, &p, REACH * r->edge, &n)) continue;
        if (v_dot(n, r->normal[v]) <= 0) continue;
        Fitness after = ring_fitness(r, v, p, n);
        if (after.quality < before.quality + GAIN || after.facing < real_min(LIMITS_EDIT.facing, before.facing)) continue;
        double far = after.facing >= FACING_SURE ? 0 : ring_deviation(r, v, p);
        if (far > LIMITS_EDIT.deviation_vox && far > ring_deviation(r, v, was)) continue;
        *place = p;
        *normal = n;
        return true;
    }
    return false;
}

/* What is known of a vertex: it is to be looked at; it may stay, as long as nothing around it moves; it has a better place. */
enum { LOOK, STAYS, MOVES };

typedef struct ImproveJob {
    Remesh *r;
    const uint8_t *held;
    uint8_t *state;       /* [nvert] */
    Vec3 *place, *normal; /* [nvert] of those that move */
} ImproveJob;

static void look_at(ImproveJob *job, int v)
{
    const Remesh *r = job->r;
    if (vert_is_dead(r->mesh, v) || (job->held && job->held[v]) || !remesh_in_zone(r, v)) return;
    bool better = is_poor(r, v, r->mesh->pos[v], POOR) && find_place(r, v, &job->place[v], &job->normal[v]);
    job->state[v] = better ? MOVES : STAYS;
}

/* Corners of poor triangles are to be looked at. */
static void poor_block(void *ctx, int begin, int end)
{
    ImproveJob *job = ctx;
    const Mesh *m = job->r->mesh;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->corner + 3 * t;
        if (tri_is_dead(m, t) || triangle_quality(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]) >= POOR) continue;
        for (int k = 0; k < 3; k++) __atomic_store_n(&job->state[c[k]], LOOK, __ATOMIC_RELAXED);
    }
}

static void look_block(void *ctx, int begin, int end)
{
    ImproveJob *job = ctx;
    for (int v = begin; v < end; v++)
        if (job->state[v] == LOOK) look_at(job, v);
}

static void move_vertex(ImproveJob *job, int v)
{
    Mesh *m = job->r->mesh;
    int h = m->out[v];
    m->pos[v] = job->place[v];
    job->r->normal[v] = job->normal[v];
    job->state[v] = LOOK;
    do job->state[he_to(m, h)] = LOOK;
    while ((h = he_around(m, h)) != m->out[v]);
}

void remesh_improve(Remesh *r, const uint8_t *held)
{
    int n = r->mesh->nvert;
    bool moved = true;
    ImproveJob job = {r, held, NEW(uint8_t, n), NEW(Vec3, n), NEW(Vec3, n)};
    memset(job.state, STAYS, (size_t)n);
    parallel_for(r->mesh->ntri, GRAIN, poor_block, &job);
    for (int k = 0; k < PASSES && moved; k++) {
        moved = false;
        parallel_for(n, GRAIN, look_block, &job);
        for (int v = 0; v < n; v++) {
            if (job.state[v] == LOOK) look_at(&job, v);
            if (job.state[v] != MOVES) continue;
            move_vertex(&job, v);
            moved = true;
        }
    }
    mem_free(job.state);
    mem_free(job.place);
    mem_free(job.normal);
}
