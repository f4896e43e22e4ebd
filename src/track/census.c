#include "track/track_priv.h"

#include <math.h>

void census_take(Census *c, const Mesh *m)
{
    *c = (Census){m->nvert, NEW(int32_t, m->nvert)};
    for (int v = 0; v < m->nvert; v++) c->id[v] = m->id[v];
}

static void index_ids(Map *at, const Mesh *m)
{
    map_init(at, m->nvert);
    for (int v = 0; v < m->nvert; v++)
        if (!vert_is_dead(m, v)) map_put(at, (uint64_t)m->id[v], v);
}

double census_share_kept(const Census *c, const Mesh *m)
{
    Map at;
    int kept = 0;
    index_ids(&at, m);
    for (int i = 0; i < c->n; i++) {
        kept += map_get(&at, (uint64_t)c->id[i]) != NONE;
    }
    map_free(&at);
    return c->n ? (double)kept / c->n : NAN;
}

void census_free(Census *c)
{
    mem_free(c->id);
    *c = (Census){0};
}
