/* relax.c: one step of the elastic skin on the surface. */
#include "track/track_priv.h"

#include "base/thread.h"

enum { GRAIN = 512 };
#define FLAT_COS 0.97    /* 14 degrees; a feature turns by 40 */
#define STEP_MAX 0.3     /* a vertex moves at most this far in a step, in edges wanted */
#define CALM_FIRST 0.025 /* what has less unrest than this sits a frame's first step out, where the field moves it, */
#define CALM 0.05        /* and than this the others, */
#define ALL_EVERY 3      /* but for every third */

typedef struct TriJob {
    const Remesh *r;
    const uint8_t *held; /* [nvert] */
    Vec3 *normal;      /* [ntri] the field's at the centroids */
    uint8_t *inverted; /* [ntri] */
} TriJob;

/* A triangle that faces as the field does at its corners, all nearly alike, holds no feature and is not inverted: the corners'
 * mean normal serves for the centroid's. */
static bool is_flat(const Remesh *r, int t, Vec3 *normal)
{
    const int32_t *c = r->mesh->corner + 3 * t;
    Vec3 n = v_unit(v_area2(r->mesh->pos[c[0]], r->mesh->pos[c[1]], r->mesh->pos[c[2]]));
    double least = 1;
    for (int k = 0; k < 3; k++) least = real_min(least, v_dot(n, r->normal[c[k]]));
    if (least < FLAT_COS) return false;
    *normal = v_unit(v_add(v_add(r->normal[c[0]], r->normal[c[1]]), r->normal[c[2]]));
    return true;
}

static void tri_block(void *ctx, int begin, int end)
{
    TriJob *job = ctx;
    const Mesh *m = job->r->mesh;
    for (int t = begin; t < end; t++) {
        const int32_t *v = m->corner + 3 * t;
        if (job->held[v[0]] && job->held[v[1]] && job->held[v[2]]) continue; /* no element */
        Vec3 a = m->pos[v[0]], b = m->pos[v[1]], c = m->pos[v[2]];
        Vec3 centroid = v_scale(v_add(v_add(a, b), c), 1.0 / 3);
        if (is_flat(job->r, t, &job->normal[t])) continue; /* job->inverted starts at 0 */
        field_normals(job->r->field, 1, &centroid, &job->normal[t]);
        job->inverted[t] = field_triangle_inverted(job->r->field, a, b, c);
    }
}

/* Frozen vertices, and in most steps those that are calm: one step brings most of the skin as near to rest as all would, the others are
 * for where it is stretched, cut or sewn. What the field does not move is to come to rest: its first step is never sat out. */
static uint8_t *find_held(const Track *tr, int step)
{
    uint8_t *held = NEW(uint8_t, tr->mesh.nvert);
    for (int v = 0; v < tr->mesh.nvert; v++) {
        double calm = step == 0 ? (tr->moved[v] ? CALM_FIRST : 0) : step % ALL_EVERY > 0 ? CALM : 0;
        held[v] = tr->frozen[v] || tr->unrest[v] < calm;
    }
    return held;
}

uint8_t *track_relax(Track *tr, Remesh *r, int step, FrameStat *stat)
{
    Mesh *m = &tr->mesh;
    uint8_t *held = find_held(tr, step);
    TriJob job = {r, held, NEW(Vec3, m->ntri), NEW0(uint8_t, m->ntri)};
    Vec3 *dx = NEW(Vec3, m->nvert);
    parallel_for(m->ntri, GRAIN, tri_block, &job);
    MechanicsProblem prob = {.nvert = m->nvert, .ntri = m->ntri, .pos = m->pos, .tri = m->corner, .normal = r->normal,
                             .tri_normal = job.normal, .inverted = job.inverted, .frozen = held};
    CgStat cg = mechanics_step(&tr->mech, &tr->set.mech, &prob, dx);
    stat->relax_steps++;
    stat->cg_iterations += cg.iterations;
    stat->cg_residual = cg.residual;
    for (int v = 0; v < m->nvert; v++) {
        double l = v_len(dx[v]), limit = STEP_MAX * tr->edge;
        if (!held[v]) tr->unrest[v] = (float)(l / tr->edge);
        dx[v] = v_axpy(m->pos[v], l > limit ? limit / l : 1, dx[v]);
    }
    remesh_move(r, dx, held);
    remesh_remember_lengths(m, step > 0 ? held : NULL);
    mem_free(dx);
    mem_free(job.normal);
    mem_free(job.inverted);
    return held;
}
