/* cut.c: marked edges get their midpoints, triangles give way to their pieces. */
#include "refine/refine_priv.h"

static int add_midpoints(Pass *p, Refine *now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    int first = m->nvert;
    for (int e = 0; e < p->nedge; e++) {
        p->mid[e] = NONE;
        if (!p->marked[e]) continue;
        int a = m->id[p->ends[e][0]], b = m->id[p->ends[e][1]], id;
        if (p->was[e] != NONE) id = p->memory->mark[p->was[e]].id;
        else id = *next_id, *next_id += MESH_ID_STEP;
        refine_note(now, (RefineMark){int_min(a, b), int_max(a, b), id, p->number});
        p->mid[e] = refined_add_vert(m, p->mid_pos[e], p->mid_normal[e], id, p->ends[e], p->mid_state[e] == MID_FLAT);
    }
    return m->nvert - first;
}

/* What the pieces from number `at` on have of the whole that they replace. */
static void note_kept(Pass *p, const Whole *w, int marks, const Pieces *q, int at)
{
    for (int i = 0; i < q->n; i++) {
        p->kept_tri[at + i] = marks ? NONE : w->first + i;
        for (int k = 0; k < 3; k++) {
            int c = q->corner[i][k], d = q->corner[i][(k + 1) % 3], *side = &p->kept_side[3 * (at + i) + k];
            if (!marks) *side = p->edge_of[3 * (w->first + i) + k];
            else *side = w->ntri == 1 && c < 3 && d < 3 ? p->edge_of[3 * w->first + c] : NONE;
        }
    }
}

static void cut_triangles(Pass *p, int added)
{
    RefinedMesh *m = p->m;
    Tris out = {0};
    int after = m->ntri + 2 * added; /* whatever the pieces: V - E + F stays */
    p->kept_tri = NEW(int32_t, after);
    p->kept_side = NEW(int32_t, 3 * after);
    for (int t = 0; t < m->ntri;) {
        Whole w = whole_of(p, t);
        int marks = whole_marks(p, &w);
        Pieces q = whole_pieces(p, &w, marks, (p->state[t] & TRI_OTHER_DIAGONAL) != 0);
        ASSERT(w.first == t && out.n + q.n <= after);
        note_kept(p, &w, marks, &q, out.n);
        int32_t v[WHOLE_POINTS];
        for (int i = 0; i < WHOLE_POINTS; i++) v[i] = w.edge[i] != NONE ? p->mid[w.edge[i]] : w.vert[i];
        for (int i = 0; i < q.n; i++)
            refined_add_tri(&out, (const int32_t[3]){v[q.corner[i][0]], v[q.corner[i][1]], v[q.corner[i][2]]}, m->parent[t], q.green[i]);
        t += w.ntri;
    }
    ASSERT(out.n == after);
    mem_free(m->tri);
    mem_free(m->parent);
    mem_free(m->green);
    m->ntri = out.n, m->captri = out.cap, m->tri = out.tri, m->parent = out.parent, m->green = out.green;
}

int pass_cut(Pass *p, Refine *now, int32_t *next_id)
{
    int added = add_midpoints(p, now, next_id);
    cut_triangles(p, added);
    return added;
}
