/* cut.c: marked edges get their midpoints, triangles give way to their pieces. */
#include "refine/refine_priv.h"

static int add_midpoints(Pass *p, Refine *now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    int first = m->nvert;
    for (int e = 0; e < p->nedge; e++) {
        p->mid[e] = NONE;
        if (!p->marked[e]) continue;
        int a = p->ends[e][0], b = p->ends[e][1];
        uint64_t key = key_of_edge(m, a, b);
        int32_t id = map_get(&p->memory->marked, key);
        if (id == NONE) id = (*next_id)++;
        map_put(&now->marked, key, id);
        map_put(&now->pass, key, p->number);
        p->mid[e] = refined_add_vert(m, p->mid_pos[e], p->mid_normal[e], id, a, b);
    }
    return m->nvert - first;
}

static void cut_triangles(Pass *p)
{
    RefinedMesh *m = p->m;
    Tris out = {0};
    for (int t = 0; t < m->ntri; t++) {
        uint8_t part[4][3];
        int32_t v[6];
        for (int k = 0; k < 3; k++) {
            v[k] = m->tri[3 * t + k];
            v[3 + k] = p->mid[p->edge_of[3 * t + k]];
        }
        int n = pieces_pattern(pass_marks_of(p, t), (p->state[t] & TRI_OTHER_DIAGONAL) != 0, part);
        for (int i = 0; i < n; i++) refined_add_tri(&out, v[part[i][0]], v[part[i][1]], v[part[i][2]], m->parent[t]);
    }
    mem_free(m->tri);
    mem_free(m->parent);
    m->ntri = out.n, m->captri = out.cap, m->tri = out.tri, m->parent = out.parent;
}

int pass_cut(Pass *p, Refine *now, int32_t *next_id)
{
    int added = add_midpoints(p, now, next_id);
    cut_triangles(p);
    return added;
}
