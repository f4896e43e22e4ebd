#include "track/track_priv.h"

#include <math.h>

void census_take(Census *c, const Mesh *m)
{
    *c = (Census){.n = m->nvert, .id = NEW(int32_t, m->nvert), .comp = NEW(int32_t, m->nvert)};
    c->ncomp = mesh_components(m, NULL, c->comp);
    c->remade = NEW0(uint8_t, c->ncomp);
    for (int v = 0; v < m->nvert; v++) c->id[v] = m->id[v];
}

static void index_ids(Map *at, const Mesh *m)
{
    map_init(at, m->nvert);
    for (int v = 0; v < m->nvert; v++)
        if (!vert_is_dead(m, v)) map_put(at, (uint64_t)m->id[v], v);
}

void census_mark_remade(Census *c, const Mesh *m, const int32_t *tri_comp, const uint8_t *mesh_bad)
{
    Map at;
    index_ids(&at, m);
    for (int i = 0; i < c->n; i++) {
        int v = map_get(&at, (uint64_t)c->id[i]);
        if (v != NONE && mesh_bad[tri_comp[m->out[v] / 3]]) c->remade[c->comp[i]] = 1;
    }
    map_free(&at);
}

double census_share_kept(const Census *c, const Mesh *m)
{
    Map at;
    int total = 0, kept = 0;
    index_ids(&at, m);
    for (int i = 0; i < c->n; i++) {
        if (c->remade[c->comp[i]]) continue;
        total++;
        kept += map_get(&at, (uint64_t)c->id[i]) != NONE;
    }
    map_free(&at);
    return total ? (double)kept / total : NAN;
}

void census_free(Census *c)
{
    mem_free(c->id);
    mem_free(c->comp);
    mem_free(c->remade);
    *c = (Census){0};
}
