/* move.c: guarded moves: all vertices at once, then those that did harm go back. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

#include <string.h>

enum { GRAIN = 512 };
#define REACH 0.6 /* a landing is at most this far from its target, in edges wanted */

enum { LOOK, FINE, HARMED };

typedef struct MoveJob {
    Remesh *r;
    const Vec3 *target, *old_pos;
    const Vec3 *old_normal;
    const uint8_t *frozen;
    uint8_t *stays;    /* [nvert] */
    uint8_t *state;    /* [ntri] */
} MoveJob;

static bool may_move(const MoveJob *job, int v) { return !(job->frozen && job->frozen[v]) && remesh_in_zone(job->r, v); }

static void move_block(void *ctx, int begin, int end)
{
    MoveJob *job = ctx;
    Remesh *r = job->r;
    int32_t vert[GRAIN] = {0};
    Vec3 p[GRAIN], normal[GRAIN];
    bool landed[GRAIN];
    int n = 0;
    for (int v = begin; v < end; v++) {
        if (vert_is_dead(r->mesh, v) || !may_move(job, v)) continue;
        vert[n] = v;
        p[n++] = job->target[v];
    }
    remesh_land_points(r, n, vert, p, REACH * r->edge, normal, landed);
    for (int i = 0; i < n; i++) {
        int v = vert[i];
        job->stays[v] = !landed[i] || v_dot(normal[i], job->old_normal[v]) <= 0; /* another sheet */
        if (job->stays[v]) continue;
        r->mesh->pos[v] = p[i];
        r->normal[v] = normal[i];
    }
}

static void corners_of(const Mesh *m, int t, const Vec3 *column, Vec3 out[3])
{
    for (int k = 0; k < 3; k++) out[k] = column[m->corner[3 * t + k]];
}

static bool is_harmed(const MoveJob *job, int t)
{
    const Remesh *r = job->r;
    Vec3 p[3], n[3], old_p[3], old_n[3];
    corners_of(r->mesh, t, r->mesh->pos, p);
    corners_of(r->mesh, t, r->normal, n);
    Fitness after = triangle_fitness(p, n);
    double far = after.facing >= FACING_SURE ? 0 : triangle_deviation(r->field, p);
    if (fitness_allows(fitness_best(), after, &LIMITS_MOVE) && far <= LIMITS_MOVE.deviation_vox) return false;
    corners_of(r->mesh, t, job->old_pos, old_p);
    corners_of(r->mesh, t, job->old_normal, old_n);
    if (!fitness_allows(triangle_fitness(old_p, old_n), after, &LIMITS_MOVE)) return true;
    return far > LIMITS_MOVE.deviation_vox && far > triangle_deviation(r->field, old_p);
}

static void judge_block(void *ctx, int begin, int end)
{
    MoveJob *job = ctx;
    for (int t = begin; t < end; t++)
        if (job->state[t] == LOOK) job->state[t] = !tri_is_dead(job->r->mesh, t) && is_harmed(job, t) ? HARMED : FINE;
}

static void look_around(MoveJob *job, int v)
{
    const Mesh *m = job->r->mesh;
    int h = m->out[v];
    do
        if (job->state[h / 3] == FINE) job->state[h / 3] = LOOK;
    while ((h = he_around(m, h)) != m->out[v]);
}

/* Takes the corners of harmed triangles back; their rings are to be looked at again. False when there was none. */
static bool take_back(MoveJob *job)
{
    Mesh *m = job->r->mesh;
    bool any = false;
    for (int t = 0; t < m->ntri; t++) {
        if (job->state[t] != HARMED) continue;
        job->state[t] = FINE;
        for (int k = 0; k < 3; k++) {
            int v = m->corner[3 * t + k];
            if (job->stays[v] || !may_move(job, v)) continue;
            job->stays[v] = 1;
            m->pos[v] = job->old_pos[v];
            job->r->normal[v] = job->old_normal[v];
            look_around(job, v);
            any = true;
        }
    }
    return any;
}

int remesh_move(Remesh *r, const Vec3 *target, const uint8_t *frozen)
{
    Mesh *m = r->mesh;
    Vec3 *pos = NEW(Vec3, m->nvert), *normal = NEW(Vec3, m->nvert);
    MoveJob job = {r, target, pos, normal, frozen, NEW0(uint8_t, m->nvert), NEW(uint8_t, m->ntri)};
    for (int v = 0; v < m->nvert; v++) pos[v] = m->pos[v], normal[v] = r->normal[v];
    memset(job.state, FINE, (size_t)m->ntri);
    for (int i = 0; i < remesh_scope_size(r); i++) {
        int t = remesh_scope_tri(r, i);
        const int32_t *c = m->corner + 3 * t;
        if (!tri_is_dead(m, t) && (may_move(&job, c[0]) || may_move(&job, c[1]) || may_move(&job, c[2]))) job.state[t] = LOOK;
    }
    parallel_for(m->nvert, GRAIN, move_block, &job);
    /* each round takes at least one vertex back, and old triangles are as good as they were: it ends by itself */
    for (bool again = true; again;) {
        parallel_for(m->ntri, GRAIN, judge_block, &job);
        again = take_back(&job);
    }
    int stayed = 0;
    for (int v = 0; v < m->nvert; v++) stayed += job.stays[v];
    mem_free(pos);
    mem_free(normal);
    mem_free(job.stays);
    mem_free(job.state);
    return stayed;
}

typedef struct SmoothJob {
    const Remesh *r;
    Vec3 *target;
} SmoothJob;

static void smooth_block(void *ctx, int begin, int end)
{
    SmoothJob *job = ctx;
    const Mesh *m = job->r->mesh;
    for (int v = begin; v < end; v++) {
        if (vert_is_dead(m, v) || !remesh_in_zone(job->r, v)) continue;
        Vec3 sum = vec3(0, 0, 0), p = m->pos[v], n = job->r->normal[v];
        double weight = 0;
        int h = m->out[v];
        do { /* triangles' centroids weighted by their area even out sizes better than the neighbours alone */
            const int32_t *c = m->corner + h - h % 3;
            double w = v_len(v_area2(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]));
            sum = v_axpy(sum, w / 3, v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]));
            weight += w;
        } while ((h = he_around(m, h)) != m->out[v]);
        Vec3 d = weight > 0 ? v_sub(v_scale(sum, 1 / weight), p) : vec3(0, 0, 0);
        job->target[v] = v_add(p, v_axpy(d, -v_dot(d, n), n));
    }
}

void remesh_smooth(Remesh *r, int steps)
{
    Vec3 *target = NEW(Vec3, r->mesh->nvert);
    for (int k = 0; k < steps; k++) {
        parallel_for(r->mesh->nvert, GRAIN, smooth_block, &(SmoothJob){r, target});
        remesh_move(r, target, NULL);
    }
    mem_free(target);
}
