#include "mesh/trimesh.h"

#include <string.h>

void trimesh_init(TriMesh *m, int nvert, int ntri, bool with_velocity, bool with_parent)
{
    ASSERT(nvert >= 0 && ntri >= 0);
    size_t v = (size_t)nvert, t = (size_t)ntri;
    *m = (TriMesh){.nvert = nvert, .ntri = ntri};
    m->pos = NEW(float, 3 * v);
    m->normal = NEW(float, 3 * v);
    m->velocity = with_velocity ? NEW(float, 3 * v) : NULL;
    m->id = NEW(int32_t, v);
    m->tri = NEW(int32_t, 3 * t);
    m->parent = with_parent ? NEW(int32_t, t) : NULL;
}

void trimesh_free(TriMesh *m)
{
    for (int a = 0; a < m->nattr; a++) {
        mem_free(m->attr_name[a]);
        mem_free(m->attr[a]);
    }
    mem_free(m->attr_name);
    mem_free(m->attr);
    mem_free(m->pos);
    mem_free(m->normal);
    mem_free(m->velocity);
    mem_free(m->id);
    mem_free(m->tri);
    mem_free(m->parent);
    *m = (TriMesh){0};
}

bool trimesh_is_same_run(const TriMesh *a, const TriMesh *b)
{
    return a->nvert == b->nvert && a->ntri == b->ntri &&
           memcmp(a->tri, b->tri, 3 * (size_t)a->ntri * sizeof *a->tri) == 0 &&
           memcmp(a->id, b->id, (size_t)a->nvert * sizeof *a->id) == 0;
}
