#include "cli/turn.h"

#include <string.h>

void turn_vectors(const Turn *t, double scale, int n, float *v)
{
    for (float *end = v + 3 * (size_t)n; v != end; v += 3) {
        double x = (double)v[0], y = (double)v[1], z = (double)v[2];
        v[0] = (float)(scale * x);
        v[1] = (float)(scale * (t->up == UP_Y ? z : t->up == UP_Z ? 0 - z : y));
        v[2] = (float)(scale * (t->up == UP_Y ? 0 - y : t->up == UP_Z ? y : z));
    }
}

static float *turned_column(const Turn *t, double scale, int n, const float *v)
{
    if (!v) return NULL;
    float *own = NEW(float, 3 * (size_t)n);
    memcpy(own, v, 3 * (size_t)n * sizeof *own);
    turn_vectors(t, scale, n, own);
    return own;
}

TriMesh turn_mesh(const Turn *t, const TriMesh *m)
{
    TriMesh out = *m;
    out.pos = turned_column(t, t->scale, m->nvert, m->pos);
    out.normal = turned_column(t, 1, m->nvert, m->normal);
    out.velocity = turned_column(t, t->scale, m->nvert, m->velocity);
    return out;
}

void turn_free(TriMesh *turned)
{
    mem_free(turned->pos);
    mem_free(turned->normal);
    mem_free(turned->velocity);
    *turned = (TriMesh){0};
}
