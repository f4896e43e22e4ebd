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
    Vec3 at[BATCH], normal[BATCH];
    for (int i = 0; i < n; i++) at[i] = refined_centroid(p->m, p->tri + 3 * tri[i]);
    if (n > 0) field_normals(p->field, n, at, normal);
    for (int i = 0; i < n; i++) p->tri_normal[tri[i]] = normal[i];
}

static void centroid_normals(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int n = 0, tri[BATCH];
    for (int t = begin; t < end; t++) {
        if (p->state[t] != TRI_NEW) continue;
        tri[n++] = t;
        if (n < BATCH) continue;
        batch_normals(p, n, tri);
        n = 0;
    }
    batch_normals(p, n, tri);
}

/* The midpoints' distance from the surface against a limit in world units an edge. */
static void measure_batch(Pass *p, int n, const int *edge, const double *limit)
{
    Vec3 mid[BATCH], g[BATCH];
    double F[BATCH];
    for (int i = 0; i < n; i++) mid[i] = v_mid(p->m->pos[edge_end(p, edge[i], 0)], p->m->pos[edge_end(p, edge[i], 1)]);
    if (n > 0) field_sample(p->field, n, mid, F, g);
    for (int i = 0; i < n; i++)
        if (F[i] * F[i] > limit[i] * limit[i] * v_len2(g[i])) p->note[edge[i]].flags |= EDGE_SELF;
}

/* Does the normal turn by more than alpha_r along edge e, from a to b? */
static bool is_bent(const Pass *p, int e, int a, int b, bool kept)
{
    const RefinedMesh *m = p->m;
    if (p->turn) return real_max(p->turn[e][0], p->turn[e][1]) > (kept ? p->turn_kept : p->turn_limit);
    return v_dot(m->normal[a], m->normal[b]) < (kept ? p->cos_kept : p->cos_limit);
}

/* Was edge e marked by last frame's pass of this number, or before? A mark comes back no earlier than it came: passes would differ. */
static bool is_kept(const Pass *p, int e) { return p->note[e].kept <= p->number; }

/* Marks edge e for its normals' sake; or returns the limit that its midpoint is to be held against, in world units, 0: none. */
static double mark_bent(Pass *p, int e)
{
    const RefinedMesh *m = p->m;
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    bool kept = is_kept(p, e);
    double apart = v_dist(m->pos[a], m->pos[b]), length = apart / p->field->voxel;
    p->note[e].flags &= (uint8_t)~(EDGE_SELF | EDGE_LONG);
    if (apart >= ANGLE_SHORTEST_VOX * p->field->voxel) p->note[e].flags |= EDGE_LONG;
    if (m->flat[a] || m->flat[b]) length = 0; /* what could not follow the surface is not worth more */
    if (length >= ANGLE_SHORTEST_VOX && is_bent(p, e, a, b, kept)) {
        p->note[e].flags |= EDGE_SELF;
        return 0;
    }
    return length < DEVIATION_SHORTEST_VOX ? 0 : (kept ? p->dev_kept : p->dev_limit) * p->field->voxel;
}

static void find_last_mark(Pass *p, int e)
{
    int was = p->was[e] = refine_find(p->memory, p->m->id[edge_end(p, e, 0)], p->m->id[edge_end(p, e, 1)]);
    p->note[e].kept = was != NONE ? (uint8_t)int_min(p->memory->mark[was].pass, KEPT_NEVER) : KEPT_NEVER;
    p->note[e].flags &= (uint8_t)~EDGE_FRESH;
}

/* The angle between the centroids' normals asks for the others; between the two limits it holds what was marked before. */
enum { ASKS_NONE, ASKS_KEPT, ASKS_ALL };

static void compare_sides(Pass *p, int e)
{
    double bend = p->tri_normal ? v_dot(p->tri_normal[edge_side(p, e, 0)], p->tri_normal[edge_side(p, e, 1)]) : 1;
    p->asks[p->half[e][0]] = p->asks[p->half[e][1]] = bend >= p->cos_kept ? ASKS_NONE : bend < p->cos_limit ? ASKS_ALL : ASKS_KEPT;
}

/* What an edge's own mark depends on changes when it is cut, when last frame's mark of it comes to count, and, the turns being
 * those of its triangles, by the Hessian with these. */
static void look_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int n = 0, edge[BATCH];
    double limit[BATCH];
    for (int e = begin; e < end; e++) {
        EdgeNote *note = &p->note[e];
        bool stirred = note->stirred[0] | note->stirred[1], again = (note->flags & EDGE_FRESH) || (p->turn && stirred);
        if (note->flags & EDGE_FRESH) find_last_mark(p, e);
        if (stirred) compare_sides(p, e);
        note->stirred[0] = note->stirred[1] = 0;
        if ((again || note->kept == p->number) && (limit[n] = mark_bent(p, e)) > 0) edge[n++] = e;
        if (n < BATCH) continue;
        measure_batch(p, n, edge, limit);
        n = 0;
    }
    measure_batch(p, n, edge, limit);
}

/* GI'07 figure 7b: where two neighbours' normals differ, the other edges of both are to be cut. */
static bool is_asked_for(const Pass *p, int e)
{
    int least = is_kept(p, e) ? ASKS_KEPT : ASKS_ALL;
    for (int s = 0; s < 2; s++) {
        int h = p->half[e][s];
        if (int_max(p->asks[he_next(h)], p->asks[he_prev(h)]) >= least) return true;
    }
    return false;
}

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int e = begin; e < end; e++) {
        int flags = p->note[e].flags;
        p->marked[e] = (flags & EDGE_SELF) || ((flags & EDGE_LONG) && is_asked_for(p, e));
    }
}

static void forget_new_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) p->state[t] = 0;
}

void pass_find_normals(Pass *p) { parallel_for(p->m->nvert, GRAIN, vertex_normals, p); }

void pass_list_marked(Pass *p)
{
    p->nlist = 0;
    RESERVE(p->list, p->caplist, p->nedge);
    for (int e = 0; e < p->nedge; e++)
        if (p->marked[e]) p->list[p->nlist++] = e;
}

int pass_mark(Pass *p)
{
    if (p->set->by == REFINE_BY_HESSIAN) pass_find_turns(p);
    else parallel_for(p->ntri, GRAIN, centroid_normals, p);
    parallel_for(p->ntri, GRAIN, forget_new_block, p);
    parallel_for(p->nedge, GRAIN, look_block, p);
    parallel_for(p->nedge, GRAIN, mark_block, p);
    pass_list_marked(p);
    return p->nlist;
}
