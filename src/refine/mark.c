/* mark.c: which edges are to be cut. */
#include "refine/refine_priv.h"

#include "base/thread.h"

static void vertex_normals(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    field_normals(p->field, end - begin, p->m->pos + begin, p->m->normal + begin);
}

static void batch_normals(Pass *p, int n, const int *tri)
{
    const RefinedMesh *m = p->m;
    Vec3 at[BATCH], normal[BATCH];
    for (int i = 0; i < n; i++) at[i] = refined_centroid(m, tri[i]);
    if (n > 0) field_normals(p->field, n, at, normal);
    for (int i = 0; i < n; i++) p->tri_normal[tri[i]] = normal[i];
}

static void centroid_normals(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int n = 0, tri[BATCH];
    for (int t = begin; t < end; t++) {
        int o = p->before ? p->before->kept_tri[t] : NONE;
        if (o != NONE) p->tri_normal[t] = p->before->tri_normal[o];
        else tri[n++] = t;
        if (n < BATCH) continue;
        batch_normals(p, n, tri);
        n = 0;
    }
    batch_normals(p, n, tri);
}

/* The angle between the centroids' normals asks for the others; between the two limits it holds what was marked before. */
enum { MARK_OTHERS = 1, MARK_OTHERS_KEPT = 2, MARK_KEPT = 4 };

/* The midpoints' distance from the surface, and against a limit in world units an edge. */
static void measure_batch(Pass *p, int n, const int *edge, const double *limit)
{
    Vec3 mid[BATCH], g[BATCH];
    double F[BATCH];
    for (int i = 0; i < n; i++) mid[i] = v_mid(p->m->pos[p->ends[edge[i]][0]], p->m->pos[p->ends[edge[i]][1]]);
    if (n > 0) field_sample(p->field, n, mid, F, g);
    for (int i = 0; i < n; i++) {
        p->far_vox[edge[i]] = far_vox(p->field, F[i], g[i]);
        p->self[edge[i]] = F[i] * F[i] > limit[i] * limit[i] * v_len2(g[i]);
    }
}

/* Does the normal turn by more than alpha_r along edge e? */
static bool is_bent(const Pass *p, int e, bool kept)
{
    const RefinedMesh *m = p->m;
    if (p->turn) return real_max(p->turn[e][0], p->turn[e][1]) > (kept ? p->turn_kept : p->turn_limit);
    return v_dot(m->normal[p->ends[e][0]], m->normal[p->ends[e][1]]) < (kept ? p->cos_kept : p->cos_limit);
}

/* Was edge e marked by last frame's pass of this number, or before? A mark comes back no earlier than it came: passes would differ. */
static bool is_kept(const Pass *p, int e, int number) { return p->was[e] != NONE && p->memory->mark[p->was[e]].pass <= number; }

/* Nothing that its own mark depends on has changed since the pass before; the turns are those of its triangles. */
static bool is_settled(const Pass *p, int e)
{
    return p->from[e] != NONE && !p->turn && is_kept(p, e, p->number) == is_kept(p, e, p->number - 1);
}

/* Marks edge e for its normals' sake; or returns the limit that its midpoint is to be held against, in world units, 0: none. */
static double mark_bent(Pass *p, int e)
{
    const RefinedMesh *m = p->m;
    int a = p->ends[e][0], b = p->ends[e][1];
    bool kept = is_kept(p, e, p->number);
    double length = v_dist(m->pos[a], m->pos[b]) / p->field->voxel;
    if (m->flat[a] || m->flat[b]) length = 0; /* what could not follow the surface is not worth more */
    p->self[e] = length >= ANGLE_SHORTEST_VOX && is_bent(p, e, kept);
    if (p->self[e] || length < DEVIATION_SHORTEST_VOX) return 0;
    return (kept ? p->dev_kept : p->dev_limit) * p->field->voxel;
}

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int n = 0, edge[BATCH];
    double limit[BATCH];
    for (int e = begin; e < end; e++) {
        double bend = p->tri_normal ? v_dot(p->tri_normal[p->side[e][0]], p->tri_normal[p->side[e][1]]) : 1;
        if (is_kept(p, e, p->number)) p->marked[e] |= MARK_KEPT;
        if (bend < p->cos_kept) p->marked[e] |= bend < p->cos_limit ? MARK_OTHERS : MARK_OTHERS_KEPT;
        if (is_settled(p, e)) p->self[e] = p->before->self[p->from[e]];
        else if ((limit[n] = mark_bent(p, e)) > 0) edge[n++] = e;
        if (n < BATCH) continue;
        measure_batch(p, n, edge, limit);
        n = 0;
    }
    measure_batch(p, n, edge, limit);
}

/* GI'07 figure 7b: where two neighbours' normals differ, the other edges of both are to be cut. */
static int settle_marks(Pass *p)
{
    const RefinedMesh *m = p->m;
    const double shortest = ANGLE_SHORTEST_VOX * p->field->voxel;
    uint8_t *cut = NEW0(uint8_t, p->nedge);
    int n = 0;
    for (int e = 0; e < p->nedge; e++) {
        if (p->self[e]) cut[e] = 1;
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

void pass_find_normals(Pass *p) { parallel_for(p->m->nvert, GRAIN, vertex_normals, p); }

static void find_tri_normals(Pass *p)
{
    p->tri_normal = NEW(Vec3, p->m->ntri);
    parallel_for(p->m->ntri, GRAIN, centroid_normals, p);
}

int pass_mark(Pass *p)
{
    if (p->set->by == REFINE_BY_HESSIAN) pass_find_turns(p);
    else find_tri_normals(p);
    parallel_for(p->nedge, GRAIN, mark_block, p);
    return settle_marks(p);
}
