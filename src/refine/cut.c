/* cut.c: marked edges get their midpoints, triangles give way to their pieces. */
#include "refine/refine_priv.h"

static int add_midpoints(Pass *p, Refine *now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    int first = m->nvert;
    for (int e = 0; e < p->nedge; e++) {
        p->mid[e] = NONE;
        if (!p->marked[e]) continue;
        uint64_t key = key_of_edge(m, p->ends[e][0], p->ends[e][1]);
        int32_t id = map_get(&p->memory->marked, key);
        if (id == NONE) id = *next_id, *next_id += MESH_ID_STEP;
        map_put(&now->marked, key, id);
        map_put(&now->pass, key, p->number);
        p->mid[e] = refined_add_vert(m, p->mid_pos[e], p->mid_normal[e], id, p->ends[e], p->mid_state[e] == MID_FLAT);
    }
    return m->nvert - first;
}

static void cut_triangles(Pass *p)
{
    RefinedMesh *m = p->m;
    Tris out = {0};
    for (int t = 0; t < m->ntri;) {
        Whole w = whole_of(p, t);
        Pieces q = whole_pieces(p, &w, whole_marks(p, &w), (p->state[t] & TRI_OTHER_DIAGONAL) != 0);
        ASSERT(w.first == t);
        int32_t v[WHOLE_POINTS];
        for (int i = 0; i < WHOLE_POINTS; i++) v[i] = w.edge[i] != NONE ? p->mid[w.edge[i]] : w.vert[i];
        for (int i = 0; i < q.n; i++)
            refined_add_tri(&out, (const int32_t[3]){v[q.corner[i][0]], v[q.corner[i][1]], v[q.corner[i][2]]}, m->parent[t], q.green[i]);
        t += w.ntri;
    }
    mem_free(m->tri);
    mem_free(m->parent);
    mem_free(m->green);
    m->ntri = out.n, m->captri = out.cap, m->tri = out.tri, m->parent = out.parent, m->green = out.green;
}

int pass_cut(Pass *p, Refine *now, int32_t *next_id)
{
    int added = add_midpoints(p, now, next_id);
    cut_triangles(p);
    return added;
}
