#include "base/hash.h"
#include "render/render_priv.h"

#include <math.h>
#include <string.h>

/* --- normals, objects ------------------------------------------------------------------------------------ */

static void put_vec3(float *to, Vec3 v)
{
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
}

/* Of the triangles around each vertex, by their areas; in their order. */
static Vec3 *area_normals(const TriMesh *m)
{
    Vec3 *sum = NEW0(Vec3, m->nvert);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->tri + 3 * (size_t)t;
        Vec3 n = v_area2(vertex_at(m->pos, c[0]), vertex_at(m->pos, c[1]), vertex_at(m->pos, c[2]));
        for (int k = 0; k < 3; k++) sum[c[k]] = v_add(sum[c[k]], n);
    }
    return sum;
}

/* A gradient is no guide beside a wall that cuts the field off, and along an edge: it may be turned away from all triangles there. */
float *surface_normals(const TriMesh *m)
{
    const double agree = 0.85; /* cosine */
    float *normal = NEW(float, 3 * (size_t)m->nvert);
    Vec3 *by_area = area_normals(m);
    for (int v = 0; v < m->nvert; v++) {
        Vec3 n = v_unit(vertex_at(m->normal, v)), around = v_unit(by_area[v]);
        put_vec3(normal + 3 * (size_t)v, v_dot(n, around) >= agree ? n : around);
    }
    mem_free(by_area);
    return normal;
}

uint32_t *surface_objects(const TriMesh *m)
{
    int32_t *part = NEW(int32_t, m->nvert);
    int n = trimesh_components(m, part);
    uint32_t *least = NEW(uint32_t, n), *object = NEW(uint32_t, m->nvert);
    for (int p = 0; p < n; p++) least[p] = PICTURE_NOBODY;
    for (int v = 0; v < m->nvert; v++)
        if ((uint32_t)m->id[v] < least[part[v]]) least[part[v]] = (uint32_t)m->id[v];
    for (int v = 0; v < m->nvert; v++) object[v] = least[part[v]];
    mem_free(part);
    mem_free(least);
    return object;
}

/* --- edges ----------------------------------------------------------------------------------------------- */

/* An edge is no parent's where the triangles on both its sides have the same one. */
static void leave_out_inner_edges(const TriMesh *m, uint8_t *drawn)
{
    Map side; /* of an edge as one triangle runs along it: that triangle */
    map_init(&side, 3 * m->ntri);
    for (int pass = 0; pass < 2; pass++)
        for (int t = 0; t < m->ntri; t++)
            for (int k = 0; k < 3; k++) {
                int a = m->tri[3 * (size_t)t + (size_t)k], b = m->tri[3 * (size_t)t + (size_t)((k + 1) % 3)];
                if (pass == 0) {
                    map_put(&side, key_pair(a, b), t);
                    continue;
                }
                int across = map_get(&side, key_pair(b, a));
                if (across != NONE && m->parent[across] == m->parent[t]) drawn[t] &= (uint8_t)~(1u << k);
            }
    map_free(&side);
}

uint8_t *surface_wire(const TriMesh *m, RenderWire wire)
{
    if (wire == WIRE_NONE || (wire == WIRE_PARENTS && !m->parent)) return NULL;
    uint8_t *drawn = NEW(uint8_t, m->ntri);
    memset(drawn, 7, (size_t)m->ntri);
    if (wire == WIRE_PARENTS) leave_out_inner_edges(m, drawn);
    return drawn;
}

/* --- rest positions -------------------------------------------------------------------------------------- */

static const float *column_named(const TriMesh *m, const char *name)
{
    for (int a = 0; a < m->nattr; a++)
        if (strcmp(m->attr_name[a], name) == 0) return m->attr[a];
    return NULL;
}

RestColumns surface_rest(const TriMesh *m)
{
    RestColumns r = {{column_named(m, "rest_x"), column_named(m, "rest_y"), column_named(m, "rest_z")}, column_named(m, "rest_frame")};
    if (!r.place[1] || !r.place[2]) r.place[0] = NULL;
    return r;
}

bool render_can_reach(const TriMesh *m)
{
    for (size_t i = 0; i < 3 * (size_t)m->nvert; i++)
        if (!(fabs((double)m->pos[i]) <= RENDER_REACH)) return false;
    return true;
}

bool render_has_rest(const TriMesh *m) { return surface_rest(m).place[0] != NULL; }

/* Places of different frames do not mix: where the corners are of several, the nearest one's is carried on. */
Vec3 rest_at(const RestColumns *r, const TriMesh *m, const Spot *s)
{
    const int32_t *c = s->corner;
    int near = c[spot_nearest(s)];
    if (r->frame && (r->frame[c[0]] != r->frame[c[1]] || r->frame[c[0]] != r->frame[c[2]])) {
        Vec3 rest = vec3(r->place[0][near], r->place[1][near], r->place[2][near]);
        return v_add(rest, v_sub(spot_blend(s, m->pos), vertex_at(m->pos, near)));
    }
    Vec3 rest = vec3(0, 0, 0);
    for (int k = 0; k < 3; k++) rest = v_axpy(rest, s->weight[k], vec3(r->place[0][c[k]], r->place[1][c[k]], r->place[2][c[k]]));
    return rest;
}
