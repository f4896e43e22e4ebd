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

/* Is q a fit place for the midpoint of edge e? */
static bool accept_landing(Pass *p, int e, Vec3 q)
{
    const RefinedMesh *m = p->m;
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    double apart = ENDS_APART * v_dist(m->pos[a], m->pos[b]);
    Vec3 n;
    q = v_round32(q);
    if (real_min(v_dist(q, m->pos[a]), v_dist(q, m->pos[b])) < apart) return false;
    field_normals(p->field, 1, &q, &n);
    if (v_dot(n, v_add(m->normal[a], m->normal[b])) <= 0 || !is_home(p, a, q)) return false; /* another sheet */
    p->midpoint[p->mid[e]] = (Midpoint){q, n};
    return true;
}

/* Newton's landing; where that goes astray, straight along the ends' mean normal. */
static bool land_midpoint(Pass *p, int e)
{
    const RefinedMesh *m = p->m;
    int a = edge_end(p, e, 0), b = edge_end(p, e, 1);
    Vec3 mid = v_mid(m->pos[a], m->pos[b]), q = mid, n = v_unit(v_add(m->normal[a], m->normal[b]));
    double reach = LAND_REACH * v_dist(m->pos[a], m->pos[b]);
    if (field_project(p->field, 1, &q, reach, NULL) == 0 && accept_landing(p, e, q)) return true;
    q = mid;
    bool inside = field_value(p->field, mid, NULL, NULL) > 0;
    return field_cast(p->field, &q, inside ? n : v_scale(n, -1), reach) && accept_landing(p, e, q);
}

static void land_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int i = begin; i < end; i++) {
        int e = p->list[i];
        if (p->mid_state[e] == MID_NONE) p->mid_state[e] = land_midpoint(p, e) ? MID_LANDED : MID_LOST;
    }
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
