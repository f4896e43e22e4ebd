/* mark.c: which edges are to be cut. */
#include "refine/refine_priv.h"

#include "base/thread.h"

typedef struct NormalJob {
    const Field *field;
    const RefinedMesh *m;
    Vec3 *out;
} NormalJob;

static void vertex_normals(void *ctx, int begin, int end)
{
    NormalJob *job = ctx;
    field_normals(job->field, end - begin, job->m->pos + begin, job->out + begin);
}

static void centroid_normals(void *ctx, int begin, int end)
{
    NormalJob *job = ctx;
    const RefinedMesh *m = job->m;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->tri + 3 * t;
        Vec3 p = v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
        field_normals(job->field, 1, &p, job->out + t);
    }
}

/* The angle between the centroids' normals asks for the others; between the two limits it holds what was marked before. */
enum { MARK_SELF = 1, MARK_OTHERS = 2, MARK_OTHERS_KEPT = 4, MARK_KEPT = 8 };

/* The midpoints' distance from the surface, to first order, against a limit in world units an edge. */
static void mark_far(Pass *p, int n, const int *edge, const double *limit)
{
    Vec3 mid[BATCH], g[BATCH];
    double F[BATCH];
    for (int i = 0; i < n; i++) mid[i] = v_mid(p->m->pos[p->ends[edge[i]][0]], p->m->pos[p->ends[edge[i]][1]]);
    field_sample(p->field, n, mid, F, g);
    for (int i = 0; i < n; i++)
        if (F[i] * F[i] > limit[i] * limit[i] * v_len2(g[i])) p->marked[edge[i]] |= MARK_SELF;
}

/* Does the normal turn by more than alpha_r along edge e? */
static bool is_bent(const Pass *p, int e, bool kept)
{
    const RefinedMesh *m = p->m;
    if (p->turn) return real_max(p->turn[e][0], p->turn[e][1]) > (kept ? p->turn_kept : p->turn_limit);
    return v_dot(m->normal[p->ends[e][0]], m->normal[p->ends[e][1]]) < (kept ? p->cos_kept : p->cos_limit);
}

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    const RefinedMesh *m = p->m;
    const double voxel = p->field->voxel;
    int n = 0, edge[BATCH];
    double limit[BATCH];
    for (int e = begin; e < end; e++) {
        int a = p->ends[e][0], b = p->ends[e][1];
        int was = map_get(&p->memory->pass, key_of_edge(m, a, b));
        bool kept = was != NONE && was <= p->number; /* a mark comes back no earlier than it came: passes would differ */
        double dev = (kept ? p->dev_kept : p->dev_limit) * voxel;
        double length = v_dist(m->pos[a], m->pos[b]) / voxel;
        double bend = p->tri_normal ? v_dot(p->tri_normal[p->side[e][0]], p->tri_normal[p->side[e][1]]) : 1;
        if (kept) p->marked[e] |= MARK_KEPT;
        if (bend < p->cos_kept) p->marked[e] |= bend < p->cos_limit ? MARK_OTHERS : MARK_OTHERS_KEPT;
        if (m->flat[a] || m->flat[b]) length = 0; /* what could not follow the surface is not worth more */
        if (length >= ANGLE_SHORTEST_VOX && is_bent(p, e, kept)) p->marked[e] |= MARK_SELF;
        else if (length >= DEVIATION_SHORTEST_VOX && dev > 0) edge[n] = e, limit[n++] = dev;
        if (n < BATCH && e + 1 < end) continue;
        mark_far(p, n, edge, limit);
        n = 0;
    }
}

/* GI'07 figure 7b: where two neighbours' normals differ, the other edges of both are to be cut. */
static int settle_marks(Pass *p)
{
    const RefinedMesh *m = p->m;
    const double shortest = ANGLE_SHORTEST_VOX * p->field->voxel;
    uint8_t *cut = NEW0(uint8_t, p->nedge);
    int n = 0;
    for (int e = 0; e < p->nedge; e++) {
        if (p->marked[e] & MARK_SELF) cut[e] = 1;
        if (!(p->marked[e] & (MARK_OTHERS | MARK_OTHERS_KEPT))) continue;
        for (int s = 0; s < 2; s++)
            for (int k = 0; k < 3; k++) {
                int o = p->edge_of[3 * p->side[e][s] + k];
                if (!(p->marked[e] & MARK_OTHERS) && !(p->marked[o] & MARK_KEPT)) continue;
                if (o != e && v_dist(m->pos[p->ends[o][0]], m->pos[p->ends[o][1]]) >= shortest) cut[o] = 1;
            }
    }
    for (int e = 0; e < p->nedge; e++) n += p->marked[e] = cut[e];
    mem_free(cut);
    return n;
}

void pass_find_normals(Pass *p)
{
    parallel_for(p->m->nvert, GRAIN, vertex_normals, &(NormalJob){p->field, p->m, p->m->normal});
}

static void find_tri_normals(Pass *p)
{
    p->tri_normal = NEW(Vec3, p->m->ntri);
    parallel_for(p->m->ntri, GRAIN, centroid_normals, &(NormalJob){p->field, p->m, p->tri_normal});
}

int pass_mark(Pass *p)
{
    if (p->set->by == REFINE_BY_HESSIAN) pass_find_turns(p);
    else find_tri_normals(p);
    parallel_for(p->nedge, GRAIN, mark_block, p);
    return settle_marks(p);
}
