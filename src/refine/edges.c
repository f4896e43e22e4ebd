/* edges.c: the mesh that the passes work on, with its edges. */
#include "refine/refine_priv.h"

void pass_reserve(Pass *p, int tris, int edges)
{
    if (p->ntri + tris > p->captri) {
        int n = p->captri = p->ntri + tris;
        RESIZE(p->tri, 3 * (size_t)n);
        RESIZE(p->edge_of, 3 * (size_t)n);
        RESIZE(p->parent, n);
        RESIZE(p->after, n);
        RESIZE(p->way, n);
        RESIZE(p->green, n);
        RESIZE(p->state, n);
        RESIZE(p->asks, 3 * (size_t)n);
        if (p->set->by == REFINE_BY_NORMALS) {
            RESIZE(p->open, n);
            RESIZE(p->tri_normal, n);
        }
    }
    if (p->nedge + edges > p->capedge) {
        int n = p->capedge = p->nedge + edges;
        RESIZE(p->half, n);
        RESIZE(p->was, n);
        RESIZE(p->note, n);
        RESIZE(p->marked, n);
        RESIZE(p->mid_state, n);
        RESIZE(p->mid, n);
        if (p->set->by == REFINE_BY_HESSIAN) RESIZE(p->turn, n);
    }
}

static void add_edge(Pass *p, int h, int opp)
{
    int e = p->nedge++, s = p->tri[h] > p->tri[opp];
    p->half[e][s] = h;
    p->half[e][!s] = opp;
    p->edge_of[h] = p->edge_of[opp] = e;
    p->note[e] = EDGE_UNKNOWN;
    p->mid_state[e] = MID_NONE;
}

void pass_begin(Pass *p, const Mesh *mech)
{
    int cuts = p->memory->nmark + p->memory->nmark / 8; /* there are about as many as in the last frame */
    pass_reserve(p, mech->ntri + 2 * cuts, 3 * (mech->ntri / 2 + cuts));
    for (int h = 0; h < 3 * mech->ntri; h++) p->tri[h] = mech->corner[h];
    for (int h = 0; h < 3 * mech->ntri; h++)
        if (h < mech->opp[h]) add_edge(p, h, mech->opp[h]);
    ASSERT(2 * p->nedge == 3 * mech->ntri);
    for (int t = 0; t < mech->ntri; t++) {
        p->parent[t] = t;
        p->after[t] = NONE;
        p->way[t] = 0;
        p->green[t] = 0;
        p->state[t] = TRI_NEW;
    }
    p->ntri = mech->ntri;
}

void pass_free(Pass *p)
{
    mem_free(p->tri);
    mem_free(p->edge_of);
    mem_free(p->parent);
    mem_free(p->after);
    mem_free(p->way);
    mem_free(p->green);
    mem_free(p->state);
    mem_free(p->asks);
    mem_free(p->open);
    mem_free(p->tri_normal);
    mem_free(p->half);
    mem_free(p->was);
    mem_free(p->note);
    mem_free(p->marked);
    mem_free(p->mid_state);
    mem_free(p->mid);
    mem_free(p->turn);
    mem_free(p->midpoint);
    mem_free(p->list);
    mem_free(p->whole);
    mem_free(p->marks);
}
