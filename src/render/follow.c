/* follow.c: where the vertices of a mesh are in another frame. */
#include "base/hash.h"
#include "render/render_priv.h"

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

static Vec3 carried(const TriMesh *m, int v, double time_s) { return v_axpy(vertex_at(m->pos, v), time_s, vertex_at(m->velocity, v)); }

/* The skin slides over the fluid for its triangles' sake. So a known velocity says how far along the surface, and the vertex of
 * that identity where the surface is. */
static Vec3 followed(const TriMesh *m, int v, const RenderOther *other, int there)
{
    Vec3 place = vertex_at(other->mesh->pos, there), n = v_unit(vertex_at(other->mesh->normal, there));
    if (!m->velocity || !(v_len2(n) > 0)) return place;
    Vec3 on = carried(m, v, other->time_s);
    return v_axpy(on, v_dot(v_sub(place, on), n), n);
}

Motion motion_find(const TriMesh *m, const RenderOther *other)
{
    Motion out = {NEW(float, 3 * (size_t)m->nvert), NEW0(float, m->nvert)};
    bool matched = other->mesh && has_common_identities(m, other->mesh);
    Map at = {0};
    map_init(&at, matched ? other->mesh->nvert : 0);
    for (int v = 0; matched && v < other->mesh->nvert; v++) map_put(&at, (uint32_t)other->mesh->id[v], v);
    for (int v = 0; v < m->nvert; v++) {
        int there = matched ? map_get(&at, (uint32_t)m->id[v]) : NONE;
        out.known[v] = there != NONE ? BY_IDENTITY : m->velocity ? BY_VELOCITY : 0;
        Vec3 place = there != NONE ? followed(m, v, other, there) : m->velocity ? carried(m, v, other->time_s) : vertex_at(m->pos, v);
        for (int a = 0; a < 3; a++) out.place[3 * (size_t)v + (size_t)a] = (float)v_get(place, a);
    }
    map_free(&at);
    return out;
}

void motion_free(Motion *motion)
{
    mem_free(motion->place);
    mem_free(motion->known);
    *motion = (Motion){0};
}
