/* refined.c: the columns of a refined mesh. */
#include "refine/refine_priv.h"

void refined_reserve_verts(RefinedMesh *m, int nvert)
{
    if (nvert <= m->capvert) return;
    m->capvert = int_max(nvert, m->capvert + m->capvert / 2);
    RESIZE(m->pos, m->capvert);
    RESIZE(m->normal, m->capvert);
    RESIZE(m->id, m->capvert);
    RESIZE(m->ends, m->capvert);
    RESIZE(m->flat, m->capvert);
}

void refined_reserve_tris(RefinedMesh *m, int ntri)
{
    if (ntri <= m->captri) return;
    m->captri = int_max(ntri, m->captri + m->captri / 2);
    RESIZE(m->tri, 3 * (size_t)m->captri);
    RESIZE(m->parent, m->captri);
    RESIZE(m->green, m->captri);
}

void refined_copy(RefinedMesh *m, const Mesh *mech)
{
    refined_reserve_verts(m, mech->nvert);
    refined_reserve_tris(m, mech->ntri);
    m->nvert = mech->nvert;
    m->ntri = mech->ntri;
    for (int v = 0; v < m->nvert; v++) {
        m->pos[v] = v_round32(mech->pos[v]);
        m->id[v] = mech->id[v];
        m->ends[v][0] = m->ends[v][1] = NONE;
        m->flat[v] = 0;
    }
    for (int t = 0; t < m->ntri; t++) {
        for (int k = 0; k < 3; k++) m->tri[3 * t + k] = mech->corner[3 * t + k];
        m->parent[t] = t;
        m->green[t] = 0;
    }
}

void refined_free(RefinedMesh *m)
{
    mem_free(m->pos);
    mem_free(m->normal);
    mem_free(m->id);
    mem_free(m->ends);
    mem_free(m->flat);
    mem_free(m->tri);
    mem_free(m->parent);
    mem_free(m->green);
    *m = (RefinedMesh){0};
}
