/* move.c: guarded moves: all vertices at once, then those that did harm go back. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

enum { GRAIN = 512, ROUNDS_MAX = 12 };
#define REACH 0.6 /* a landing is at most this far from its target, in edges wanted */

typedef struct MoveJob {
    Remesh *r;
    const Vec3 *target, *old_pos;
    const Vec3 *old_normal;
    const uint8_t *frozen;
    uint8_t *stays;    /* [nvert] */
    uint8_t *harmed;   /* [ntri] */
} MoveJob;

static void move_block(void *ctx, int begin, int end)
{
    MoveJob *job = ctx;
    Remesh *r = job->r;
    for (int v = begin; v < end; v++) {
        if (vert_is_dead(r->mesh, v) || (job->frozen && job->frozen[v])) continue;
        Vec3 p = job->target[v];
        job->stays[v] = !remesh_land_point(r, v, &p, REACH * r->edge);
        if (job->stays[v]) continue;
        Vec3 n = remesh_normal_at(r, p);
        job->stays[v] = v_dot(n, job->old_normal[v]) <= 0; /* another sheet */
        if (job->stays[v]) continue;
        r->mesh->pos[v] = p;
        r->normal[v] = n;
    }
}

static Fitness fitness_of(const Mesh *m, int t, const Vec3 *pos, const Vec3 *normal)
{
    const int32_t *c = m->corner + 3 * t;
    return triangle_fitness((Vec3[3]){pos[c[0]], pos[c[1]], pos[c[2]]}, (Vec3[3]){normal[c[0]], normal[c[1]], normal[c[2]]});
}

static void judge_block(void *ctx, int begin, int end)
{
    MoveJob *job = ctx;
    Remesh *r = job->r;
    for (int t = begin; t < end; t++) {
        job->harmed[t] = 0;
        if (tri_is_dead(r->mesh, t)) continue;
        Fitness after = fitness_of(r->mesh, t, r->mesh->pos, r->normal);
        if (after.facing >= FACING_MOVE_MIN && after.quality >= QUALITY_MOVE_MIN) continue;
        Fitness before = fitness_of(r->mesh, t, job->old_pos, job->old_normal);
        job->harmed[t] = !fitness_allows(before, after, FACING_MOVE_MIN, QUALITY_MOVE_MIN);
    }
}

/* Takes the corners of harmed triangles back. False when there was none to take back. */
static bool take_back(MoveJob *job)
{
    Mesh *m = job->r->mesh;
    bool any = false;
    for (int t = 0; t < m->ntri; t++) {
        if (!job->harmed[t]) continue;
        for (int k = 0; k < 3; k++) {
            int v = m->corner[3 * t + k];
            if (job->stays[v] || (job->frozen && job->frozen[v])) continue;
            job->stays[v] = 1;
            m->pos[v] = job->old_pos[v];
            job->r->normal[v] = job->old_normal[v];
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
    mem_free(job.harmed);
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
        if (vert_is_dead(m, v)) continue;
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
