/* motion.c: where the vertices of a mesh are in another frame. */
#include "base/hash.h"
#include "render/render_priv.h"

#include <string.h>

#define BY_IDENTITY 1.0f
#define BY_VELOCITY 0.5f

static bool is_counted(const TriMesh *m)
{
    for (int v = 0; v < m->nvert; v++)
        if (m->id[v] != v) return false;
    return true;
}

/* Files without identities are read with indices in their place: they mean something only while the triangles stay the same. */
static bool has_common_identities(const TriMesh *a, const TriMesh *b)
{
    return trimesh_is_same_run(a, b) || !is_counted(a) || !is_counted(b);
}

static void match(const TriMesh *m, const TriMesh *other, Motion *out)
{
    Map at;
    map_init(&at, other->nvert);
    for (int v = 0; v < other->nvert; v++) map_put(&at, (uint32_t)other->id[v], v);
    for (int v = 0; v < m->nvert; v++) {
        int there = map_get(&at, (uint32_t)m->id[v]);
        if (there == NONE) continue;
        memcpy(out->place + 3 * (size_t)v, other->pos + 3 * (size_t)there, 3 * sizeof *out->place);
        out->known[v] = BY_IDENTITY;
    }
    map_free(&at);
}

Motion motion_find(const TriMesh *m, const RenderOther *other)
{
    Motion out = {NEW(float, 3 * (size_t)m->nvert), NEW0(float, m->nvert)};
    memcpy(out.place, m->pos, 3 * (size_t)m->nvert * sizeof *out.place);
    if (other->mesh && has_common_identities(m, other->mesh)) match(m, other->mesh, &out);
    for (int v = 0; m->velocity && v < m->nvert; v++) {
        if (out.known[v] > 0) continue;
        for (size_t i = 3 * (size_t)v; i < 3 * (size_t)v + 3; i++)
            out.place[i] = (float)((double)m->pos[i] + other->time_s * (double)m->velocity[i]);
        out.known[v] = BY_VELOCITY;
    }
    return out;
}

void motion_free(Motion *motion)
{
    mem_free(motion->place);
    mem_free(motion->known);
    *motion = (Motion){0};
}
