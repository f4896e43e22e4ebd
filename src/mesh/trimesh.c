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

static int32_t root_of(int32_t *up, int32_t v)
{
    while (up[v] != v) v = up[v] = up[up[v]];
    return v;
}

int trimesh_components(const TriMesh *m, int32_t *comp)
{
    int n = 0;
    for (int v = 0; v < m->nvert; v++) comp[v] = v;
    for (int h = 0; h < 3 * m->ntri; h++) {
        int32_t a = root_of(comp, m->tri[h]), b = root_of(comp, m->tri[h - h % 3]);
        comp[int_max(a, b)] = int_min(a, b);
    }
    for (int v = 0; v < m->nvert; v++) comp[v] = root_of(comp, v);
    for (int v = 0; v < m->nvert; v++) comp[v] = comp[v] == v ? n++ : comp[comp[v]]; /* a root comes before the rest of its part */
    return n;
}

void trimesh_store(TriMesh *m, Store *s)
{
    uint8_t velocity = m->velocity != NULL, parent = m->parent != NULL;
    STORE(s, m->nvert);
    STORE(s, m->ntri);
    STORE(s, velocity);
    STORE(s, parent);
    STORE_ARRAY(s, m->pos, 3 * (int64_t)m->nvert);
    STORE_ARRAY(s, m->normal, 3 * (int64_t)m->nvert);
    if (velocity) STORE_ARRAY(s, m->velocity, 3 * (int64_t)m->nvert);
    STORE_ARRAY(s, m->id, m->nvert);
    STORE_ARRAY(s, m->tri, 3 * (int64_t)m->ntri);
    if (parent) STORE_ARRAY(s, m->parent, m->ntri);
    STORE(s, m->nattr);
    if (s->reading) {
        store_expect(s, m->nattr >= 0 && (size_t)m->nattr <= s->n - s->at);
        if (s->bad) m->nattr = 0;
        m->attr = NEW0(float *, m->nattr);
        m->attr_name = NEW0(char *, m->nattr);
    }
    for (int a = 0; a < m->nattr; a++) {
        store_text(s, &m->attr_name[a]);
        STORE_ARRAY(s, m->attr[a], m->nvert);
        store_expect(s, m->attr_name[a]);
    }
    for (size_t i = 0; s->reading && !s->bad && i < 3 * (size_t)m->ntri; i++) store_expect(s, m->tri[i] >= 0 && m->tri[i] < m->nvert);
    if (s->bad) trimesh_free(m);
}
