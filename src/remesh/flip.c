#include "remesh/remesh_priv.h"

#include "base/thread.h"

enum { GRAIN = 1024 };
#define WANTED_LOSS 0.15 /* of quality, that an edge wanted may cost: less than the gain for which it would be flipped back */

static double find_quality(const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    return triangle_quality(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
}

static double quality_of(const Mesh *m, int t, const double *quality) { return quality[t] >= 0 ? quality[t] : find_quality(m, t); }

/* Would the other diagonal of the quad a d b c around h make its worse triangle better by `gain`? quality[ntri]: of the triangles, as
 * far as it is known; else -1. */
static bool gains(const Mesh *m, int h, double gain, const double *quality)
{
    double least = real_min(quality_of(m, h / 3, quality), quality_of(m, m->opp[h] / 3, quality)) + gain;
    if (least > 1) return false;
    Vec3 a = m->pos[he_from(m, h)], b = m->pos[he_to(m, h)], c = m->pos[m->corner[he_prev(h)]], d = m->pos[m->corner[he_prev(m->opp[h])]];
    return triangle_quality(d, c, a) >= least && triangle_quality(c, d, b) >= least;
}

/* What the quad a d b c around h looks like with either diagonal. */
static void compare_diagonals(const Remesh *r, int h, Fitness *now, Fitness *then, double *length)
{
    const Mesh *m = r->mesh;
    int g = m->opp[h], v[4] = {he_from(m, h), he_to(m, h), m->corner[he_prev(h)], m->corner[he_prev(g)]};
    Vec3 p[4], n[4];
    for (int k = 0; k < 4; k++) p[k] = m->pos[v[k]], n[k] = r->normal[v[k]];
    *now = triangle_fitness((Vec3[3]){p[0], p[1], p[2]}, (Vec3[3]){n[0], n[1], n[2]});
    fitness_worsen(now, triangle_fitness((Vec3[3]){p[1], p[0], p[3]}, (Vec3[3]){n[1], n[0], n[3]}));
    *then = triangle_fitness((Vec3[3]){p[3], p[2], p[0]}, (Vec3[3]){n[3], n[2], n[0]});
    fitness_worsen(then, triangle_fitness((Vec3[3]){p[2], p[3], p[1]}, (Vec3[3]){n[2], n[3], n[1]}));
    *length = v_dist(p[2], p[3]);
}

/* Does the other diagonal keep the two triangles as close to the surface? */
static bool stays_close(const Remesh *r, int h, const Limits *limits)
{
    const Mesh *m = r->mesh;
    int g = m->opp[h];
    Vec3 a = m->pos[he_from(m, h)], b = m->pos[he_to(m, h)], c = m->pos[m->corner[he_prev(h)]], d = m->pos[m->corner[he_prev(g)]];
    double then = real_max(triangle_deviation(r->field, (Vec3[3]){d, c, a}), triangle_deviation(r->field, (Vec3[3]){c, d, b}));
    if (then <= limits->deviation_vox) return true;
    return then <= real_max(triangle_deviation(r->field, (Vec3[3]){a, b, c}), triangle_deviation(r->field, (Vec3[3]){b, a, d}));
}

static bool touches_zone(const Remesh *r, int h)
{
    const Mesh *m = r->mesh;
    int across[2] = {m->corner[he_prev(h)], m->corner[he_prev(m->opp[h])]};
    return remesh_in_zone(r, he_from(m, h)) || remesh_in_zone(r, he_to(m, h)) || remesh_in_zone(r, across[0]) || remesh_in_zone(r, across[1]);
}

int remesh_flip(Remesh *r, double gain) { return remesh_flip_within(r, gain, &LIMITS_EDIT); }

/* Edges that gain are found for all at once, and again only beside an edge that was flipped since. */
typedef struct FlipJob {
    const Remesh *r;
    double gain;
    double *quality;  /* [ntri] or -1 */
    uint8_t *look;    /* [ntri] an edge of it may gain */
} FlipJob;

static void quality_block(void *ctx, int begin, int end)
{
    FlipJob *job = ctx;
    for (int i = begin; i < end; i++) {
        int t = remesh_scope_tri(job->r, i);
        if (!tri_is_dead(job->r->mesh, t)) job->quality[t] = find_quality(job->r->mesh, t);
    }
}

/* Each edge is its lower half-edge's triangle's. */
static bool is_candidate(const FlipJob *job, int h)
{
    const Mesh *m = job->r->mesh;
    return h < m->opp[h] && touches_zone(job->r, h) && gains(m, h, job->gain, job->quality);
}

static void look_block(void *ctx, int begin, int end)
{
    FlipJob *job = ctx;
    for (int i = begin; i < end; i++) {
        int t = remesh_scope_tri(job->r, i);
        job->look[t] = !tri_is_dead(job->r->mesh, t) && (is_candidate(job, 3 * t) || is_candidate(job, 3 * t + 1) || is_candidate(job, 3 * t + 2));
    }
}

static bool try_flip(Remesh *r, int h, const Limits *limits)
{
    Mesh *m = r->mesh;
    Fitness now, then;
    double length;
    compare_diagonals(r, h, &now, &then, &length);
    if (length > limits->longest * r->edge) return false;
    if (then.facing < real_min(limits->facing, now.facing) || !mesh_can_flip(m, h) || !stays_close(r, h, limits)) return false;
    mesh_flip_edge(m, h);
    return true;
}

/* At a triangle that is another one now, and its neighbours. */
static void look_again(FlipJob *job, int t)
{
    const Mesh *m = job->r->mesh;
    job->quality[t] = find_quality(m, t);
    job->look[t] = 1;
    for (int k = 0; k < 3; k++) job->look[m->opp[3 * t + k] / 3] = 1;
}

int remesh_flip_within(Remesh *r, double gain, const Limits *limits)
{
    const Mesh *m = r->mesh;
    int flips = 0, n = remesh_scope_size(r);
    FlipJob job = {r, gain, NEW(double, m->ntri), NEW(uint8_t, m->ntri)};
    for (int t = 0; r->scope && t < m->ntri; t++) job.quality[t] = -1; /* flips may reach beyond the scope */
    parallel_for(n, GRAIN, quality_block, &job);
    parallel_for(n, GRAIN, look_block, &job);
    for (int i = 0; i < 3 * n; i++) {
        int h = remesh_scope_half(r, i);
        if (!job.look[h / 3] || !is_candidate(&job, h) || !try_flip(r, h, limits)) continue;
        look_again(&job, h / 3);
        look_again(&job, m->opp[h] / 3);
        flips++;
    }
    mem_free(job.quality);
    mem_free(job.look);
    return flips;
}

static uint64_t key_of(const Mesh *m, int a, int b) { return key_pair(int_min(m->id[a], m->id[b]), int_max(m->id[a], m->id[b])); }

int remesh_flip_towards(Remesh *r, const Map *wanted)
{
    Mesh *m = r->mesh;
    int flips = 0;
    for (int i = 0; i < 3 * remesh_scope_size(r); i++) {
        int h = remesh_scope_half(r, i);
        if (tri_is_dead(m, h / 3) || h > m->opp[h] || !touches_zone(r, h)) continue;
        int c = m->corner[he_prev(h)], d = m->corner[he_prev(m->opp[h])];
        if (map_get(wanted, key_of(m, c, d)) == NONE || map_get(wanted, key_of(m, he_from(m, h), he_to(m, h))) != NONE) continue;
        Fitness now, then;
        double length;
        compare_diagonals(r, h, &now, &then, &length);
        if (then.quality < now.quality - WANTED_LOSS || then.facing < real_min(LIMITS_EDIT.facing, now.facing)) continue;
        if (!mesh_can_flip(m, h) || !stays_close(r, h, &LIMITS_TIDY)) continue;
        mesh_flip_edge(m, h);
        flips++;
    }
    return flips;
}
