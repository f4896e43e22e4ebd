/* land.c: marked edges' midpoints, on the surface. */
#include "refine/refine_priv.h"

#include "base/thread.h"

#define LAND_REACH 1.0        /* a midpoint lands at most this far away, in lengths of its edge */
#define ENDS_APART 0.2        /* a midpoint lands no nearer to its edge's ends than this share of the edge */

/* Is q on the component that vertex v belongs to? */
static bool is_home(const Pass *p, int v, Vec3 q)
{
    if (!p->homes) return true;
    while (p->m->ends[v][0] != NONE) v = p->m->ends[v][0];
    int32_t home = p->homes->of[v];
    return home == NONE || p->homes->is_home(p->homes->ctx, home, q);
}

/* Takes q, where the normal is n, for the midpoint of edge e, if it is fit for that. */
static bool accept_landing(Pass *p, int e, Vec3 q, Vec3 n)
{
    const RefinedMesh *m = p->m;
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    double apart = ENDS_APART * v_dist(m->pos[a], m->pos[b]);
    if (real_min(v_dist(q, m->pos[a]), v_dist(q, m->pos[b])) < apart) return false;
    if (v_dot(n, v_add(m->normal[a], m->normal[b])) <= 0 || !is_home(p, a, q)) return false; /* another sheet */
    p->midpoint[p->mid[e]] = (Midpoint){q, n};
    return true;
}

static Vec3 middle(const Pass *p, int e) { return v_mid(p->m->pos[edge_end(p, e, 0)], p->m->pos[edge_end(p, e, 1)]); }

static double reach_of(const Pass *p, int e) { return LAND_REACH * v_dist(p->m->pos[edge_end(p, e, 0)], p->m->pos[edge_end(p, e, 1)]); }

/* Straight along the ends' mean normal. */
static bool cast_midpoint(Pass *p, int e)
{
    Vec3 q = middle(p, e), out = v_unit(v_add(p->m->normal[edge_end(p, e, 0)], p->m->normal[edge_end(p, e, 1)])), n;
    bool inside = field_value(p->field, q, NULL, NULL) > 0;
    if (!field_cast(p->field, &q, inside ? out : v_scale(out, -1), reach_of(p, e))) return false;
    q = v_round32(q);
    field_normals(p->field, 1, &q, &n);
    return accept_landing(p, e, q, n);
}

/* Newton's landing, or, where that goes astray, the other. */
static void land_batch(Pass *p, int n, const int32_t *edge)
{
    Vec3 at[BATCH], normal[BATCH];
    double reach[BATCH] = {0};
    uint8_t status[BATCH];
    for (int i = 0; i < n; i++) {
        at[i] = middle(p, edge[i]);
        reach[i] = reach_of(p, edge[i]);
    }
    field_project_each(p->field, n, at, reach, status);
    for (int i = 0; i < n; i++) at[i] = v_round32(at[i]);
    field_normals(p->field, n, at, normal);
    for (int i = 0; i < n; i++) {
        bool landed = (status[i] == LANDED && accept_landing(p, edge[i], at[i], normal[i])) || cast_midpoint(p, edge[i]);
        p->mid_state[edge[i]] = landed ? MID_LANDED : MID_LOST;
    }
}

static void land_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    int32_t edge[BATCH];
    int n = 0;
    for (int i = begin; i < end; i++) {
        if (p->mid_state[p->list[i]] != MID_NONE) continue;
        edge[n++] = p->list[i];
        if (n < BATCH) continue;
        land_batch(p, n, edge);
        n = 0;
    }
    if (n > 0) land_batch(p, n, edge);
}

void pass_land(Pass *p)
{
    RESERVE(p->midpoint, p->capmidpoint, p->nmidpoint + p->nlist);
    for (int i = 0; i < p->nlist; i++)
        if (p->mid_state[p->list[i]] == MID_NONE) p->mid[p->list[i]] = p->nmidpoint++;
    parallel_for(p->nlist, LIST_GRAIN, land_block, p);
}

int pass_drop_lost(Pass *p)
{
    int n = 0;
    for (int i = 0; i < p->nlist; i++) {
        int e = p->list[i];
        p->marked[e] = p->mid_state[e] == MID_LANDED;
        if (p->marked[e]) p->list[n++] = e;
    }
    return p->nlist = n;
}

void pass_flatten(Pass *p, int e)
{
    const RefinedMesh *m = p->m;
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    Vec3 n = v_add(m->normal[a], m->normal[b]);
    p->midpoint[p->mid[e]] = (Midpoint){v_round32(v_mid(m->pos[a], m->pos[b])), v_len2(n) > 0 ? v_unit(n) : m->normal[a]};
    p->mid_state[e] = MID_FLAT;
}
