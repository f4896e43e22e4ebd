/* mesh_shapes.h: small closed meshes for the tests of what works on a Mesh. */
#pragma once
#include "mechanics_shapes.h"
#include "mesh/mesh.h"

/* About the z axis: nu vertices around it, nv around the tube; outward-facing. */
static inline Shape shape_torus(int nu, int nv, double R, double r)
{
    Shape s = {.nvert = nu * nv, .ntri = 2 * nu * nv};
    s.pos = NEW(Vec3, s.nvert);
    s.tri = NEW(int32_t, 3 * s.ntri);
    for (int i = 0; i < nu; i++)
        for (int j = 0; j < nv; j++) {
            double u = 2 * 3.14159265358979 * i / nu, w = 2 * 3.14159265358979 * j / nv;
            s.pos[i * nv + j] = vec3((R + r * cos(w)) * cos(u), (R + r * cos(w)) * sin(u), r * sin(w));
            int a = i * nv + j, b = (i + 1) % nu * nv + j, c = (i + 1) % nu * nv + (j + 1) % nv, d = i * nv + (j + 1) % nv;
            int quad[6] = {a, b, c, a, c, d};
            for (int k = 0; k < 6; k++) s.tri[6 * (i * nv + j) + k] = quad[k];
        }
    return s;
}

/* Appends a shape, which is given up, moved by t. */
static inline void mesh_take(Mesh *m, Shape s, Vec3 t)
{
    for (int v = 0; v < s.nvert; v++) s.pos[v] = v_add(s.pos[v], t);
    mesh_append(m, s.nvert, s.pos, NULL, s.ntri, s.tri);
    shape_free(&s);
}

/* V - E + F of one component, or of all (NONE). */
static inline int mesh_euler(const Mesh *m, int component)
{
    int32_t *tri = NEW(int32_t, m->ntri), *vert = NEW(int32_t, m->nvert);
    mesh_components(m, tri, vert);
    int chi = 0, sides = 0;
    for (int v = 0; v < m->nvert; v++) chi += vert[v] != NONE && (component == NONE || vert[v] == component);
    for (int t = 0; t < m->ntri; t++) {
        if (tri[t] == NONE || (component != NONE && tri[t] != component)) continue;
        chi++;
        sides += 3;
    }
    mem_free(tri);
    mem_free(vert);
    return chi - sides / 2;
}

static inline double mesh_volume(const Mesh *m)
{
    double sum = 0;
    for (int t = 0; t < m->ntri; t++) {
        if (tri_is_dead(m, t)) continue;
        const int32_t *c = m->corner + 3 * t;
        sum += v_dot(m->pos[c[0]], v_cross(m->pos[c[1]], m->pos[c[2]])) / 6;
    }
    return sum;
}

static inline void assert_mesh(const Mesh *m)
{
    const char *wrong = mesh_check(m);
    if (wrong) fail_msg("%s", wrong);
}

static inline int find_edge(const Mesh *m, int a, int b)
{
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!tri_is_dead(m, h / 3) && he_from(m, h) == a && he_to(m, h) == b) return h;
    return NONE;
}
