/* mark.c: which edges are to be cut. */
#include "refine/refine_priv.h"

#include "base/thread.h"

static void vertex_normals(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    field_normals(p->field, end - begin, p->m->pos + begin, p->m->normal + begin);
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

static bool is_stirred(const EdgeNote *note) { return note->stirred[0] | note->stirred[1]; }

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
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    bool is_new = (a >= p->first_vert && p->m->id[a] >= p->first_id) || (b >= p->first_vert && p->m->id[b] >= p->first_id);
    int was = p->was[e] = is_new ? NONE : refine_find(p->memory, p->m->id[a], p->m->id[b]);
    p->note[e].kept = was != NONE ? (uint8_t)int_min(p->memory->mark[was].pass, KEPT_NEVER) : KEPT_NEVER;
}

static void measure_edges(Pass *p, int nedge, const int *edge)
{
    int n = 0, batch[BATCH];
    double limit[BATCH];
    for (int i = 0; i < nedge; i++) {
        limit[n] = mark_bent(p, edge[i]);
        if (limit[n] > 0) batch[n++] = edge[i];
        if (n < BATCH) continue;
        measure_batch(p, n, batch, limit);
        n = 0;
    }
    measure_batch(p, n, batch, limit);
}

/* What an edge's own mark depends on changes when it is cut, when last frame's mark of it comes to count, and, the turns being
 * those of its triangles, by the Hessian with these. */
static void look_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int nfresh = 0, nagain = 0, fresh[GRAIN], again[GRAIN];
    for (int e = begin; e < end; e++) {
        fresh[nfresh] = e;
        nfresh += p->note[e].flags & EDGE_FRESH;
    }
    for (int i = 0; i < nfresh; i++) find_last_mark(p, fresh[i]);
    for (int e = begin; e < end; e++) {
        EdgeNote *note = &p->note[e];
        again[nagain] = e;
        nagain += (note->flags & EDGE_FRESH) | (note->kept == p->number) | (p->turn && is_stirred(note));
        note->flags &= (uint8_t)~EDGE_FRESH;
    }
    measure_edges(p, nagain, again);
}

/* GI'07 figure 7b: where the normals at the centroids of two neighbours differ, the other edges of both are to be cut. Only where there
 * are others that may be and are not yet: open ones. These never grow more but in new triangles. */
static bool is_open(const EdgeNote *note) { return (note->flags & (EDGE_LONG | EDGE_SELF)) == EDGE_LONG; }

/* Does anything hang on how much the surface bends over edge e? */
static bool is_bend_wanted(const Pass *p, int e)
{
    int own = is_open(&p->note[e]);
    return p->open[edge_side(p, e, 0)] > own || p->open[edge_side(p, e, 1)] > own;
}

static void open_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        if (!(p->state[t] & TRI_NEW)) continue;
        p->open[t] = 0;
        for (int k = 0; k < 3; k++) p->open[t] += is_open(&p->note[p->edge_of[3 * t + k]]);
    }
}

static bool is_normal_wanted(const Pass *p, int t)
{
    for (int k = 0; k < 3; k++) {
        int e = p->edge_of[3 * t + k];
        if (is_stirred(&p->note[e]) && is_bend_wanted(p, e)) return true;
    }
    return false;
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
        if ((p->state[t] & TRI_NORMAL) || !is_normal_wanted(p, t)) continue;
        p->state[t] |= TRI_NORMAL;
        tri[n++] = t;
        if (n < BATCH) continue;
        batch_normals(p, n, tri);
        n = 0;
    }
    batch_normals(p, n, tri);
}

/* The angle between the two normals asks for the others; between the two limits it holds what was marked before. */
static void compare_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int e = begin; e < end; e++) {
        EdgeNote *note = &p->note[e];
        if (!is_stirred(note)) continue;
        double bend = is_bend_wanted(p, e) ? v_dot(p->tri_normal[edge_side(p, e, 0)], p->tri_normal[edge_side(p, e, 1)]) : 1;
        p->asks[p->half[e][0]] = p->asks[p->half[e][1]] = bend >= p->cos_kept ? ASKS_NONE : bend < p->cos_limit ? ASKS_ALL : ASKS_KEPT;
    }
}

static void ask_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        const uint8_t *asks = p->asks + 3 * t;
        const int32_t *v = p->tri + 3 * t, *e = p->edge_of + 3 * t;
        bool any = asks[0] | asks[1] | asks[2];
        if (any || (p->state[t] & TRI_ASKS))
            for (int k = 0; k < 3; k++) p->note[e[k]].asked[v[k] > v[(k + 1) % 3]] = (uint8_t)int_max(asks[(k + 1) % 3], asks[(k + 2) % 3]);
        p->state[t] = (uint8_t)((p->state[t] & TRI_NORMAL) | (any ? TRI_ASKS : 0));
    }
}

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int e = begin; e < end; e++) {
        EdgeNote *note = &p->note[e];
        bool asked = int_max(note->asked[0], note->asked[1]) >= (is_kept(p, e) ? ASKS_KEPT : ASKS_ALL);
        p->marked[e] = (note->flags & EDGE_SELF) || (is_open(note) && asked);
        note->stirred[0] = note->stirred[1] = 0;
    }
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
    const bool by_normals = p->set->by == REFINE_BY_NORMALS;
    if (!by_normals) pass_find_turns(p);
    parallel_for(p->nedge, GRAIN, look_block, p);
    if (by_normals) {
        parallel_for(p->ntri, GRAIN, open_block, p);
        parallel_for(p->ntri, GRAIN, centroid_normals, p);
        parallel_for(p->nedge, GRAIN, compare_block, p);
        parallel_for(p->ntri, GRAIN, ask_block, p);
    }
    parallel_for(p->nedge, GRAIN, mark_block, p);
    pass_list_marked(p);
    return p->nlist;
}
