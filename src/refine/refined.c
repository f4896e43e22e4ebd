/* refined.c: the columns of a refined mesh. */
#include "refine/refine_priv.h"

int refined_add_vert(RefinedMesh *m, Vec3 p, Vec3 n, int32_t id, const int32_t ends[2], bool flat)
{
    if (m->nvert == m->capvert) {
        m->capvert = int_max(1024, 2 * m->capvert);
        RESIZE(m->pos, m->capvert);
        RESIZE(m->normal, m->capvert);
        RESIZE(m->id, m->capvert);
        RESIZE(m->ends, m->capvert);
        RESIZE(m->flat, m->capvert);
    }
    m->pos[m->nvert] = p;
    m->normal[m->nvert] = n;
    m->id[m->nvert] = id;
    m->ends[m->nvert][0] = ends[0];
    m->ends[m->nvert][1] = ends[1];
    m->flat[m->nvert] = flat;
    return m->nvert++;
}

void refined_add_tri(Tris *t, const int32_t corner[3], int parent, uint8_t green)
{
    if (t->n == t->cap) {
        t->cap = int_max(1024, 2 * t->cap);
        RESIZE(t->tri, 3 * (size_t)t->cap);
        RESIZE(t->parent, t->cap);
        RESIZE(t->green, t->cap);
    }
    int32_t *q = t->tri + 3 * t->n;
    for (int k = 0; k < 3; k++) q[k] = corner[k];
    t->green[t->n] = green;
    t->parent[t->n++] = parent;
}

void refined_copy(RefinedMesh *m, const Mesh *mech)
{
    const int32_t none[2] = {NONE, NONE};
    m->nvert = 0;
    for (int v = 0; v < mech->nvert; v++) refined_add_vert(m, v_round32(mech->pos[v]), vec3(0, 0, 0), mech->id[v], none, false);
    Tris t = {.cap = m->captri, .tri = m->tri, .parent = m->parent, .green = m->green};
    for (int k = 0; k < mech->ntri; k++) refined_add_tri(&t, mech->corner + 3 * k, k, 0);
    m->ntri = t.n, m->captri = t.cap, m->tri = t.tri, m->parent = t.parent, m->green = t.green;
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
