/* refined.c: the columns of a refined mesh. */
#include "refine/refine_priv.h"

int refined_add_vert(RefinedMesh *m, Vec3 p, Vec3 n, int32_t id, int a, int b)
{
    if (m->nvert == m->capvert) {
        m->capvert = int_max(1024, 2 * m->capvert);
        RESIZE(m->pos, m->capvert);
        RESIZE(m->normal, m->capvert);
        RESIZE(m->id, m->capvert);
        RESIZE(m->ends, m->capvert);
    }
    m->pos[m->nvert] = p;
    m->normal[m->nvert] = n;
    m->id[m->nvert] = id;
    m->ends[m->nvert][0] = a;
    m->ends[m->nvert][1] = b;
    return m->nvert++;
}

void refined_add_tri(Tris *t, int a, int b, int c, int parent)
{
    if (t->n == t->cap) {
        t->cap = int_max(1024, 2 * t->cap);
        RESIZE(t->tri, 3 * (size_t)t->cap);
        RESIZE(t->parent, t->cap);
    }
    int32_t *q = t->tri + 3 * t->n;
    q[0] = a, q[1] = b, q[2] = c;
    t->parent[t->n++] = parent;
}

void refined_copy(RefinedMesh *m, const Mesh *mech)
{
    m->nvert = 0;
    for (int v = 0; v < mech->nvert; v++) refined_add_vert(m, v_round32(mech->pos[v]), vec3(0, 0, 0), mech->id[v], NONE, NONE);
    Tris t = {.cap = m->captri, .tri = m->tri, .parent = m->parent};
    for (int k = 0; k < mech->ntri; k++) refined_add_tri(&t, mech->corner[3 * k], mech->corner[3 * k + 1], mech->corner[3 * k + 2], k);
    m->ntri = t.n, m->captri = t.cap, m->tri = t.tri, m->parent = t.parent;
}

void refined_free(RefinedMesh *m)
{
    mem_free(m->pos);
    mem_free(m->normal);
    mem_free(m->id);
    mem_free(m->ends);
    mem_free(m->tri);
    mem_free(m->parent);
    *m = (RefinedMesh){0};
}
