/* Mesh edits driven by bytes: three for each, what it is and where. After each the mesh is a closed manifold still, and its
 * Euler characteristic what the edit makes of it. */
#include "fuzz.h"

#include "mesh/surgery.h"

enum { TRIANGLES_MAX = 400, REGION_MAX = 60 };

static void add_octahedron(Mesh *m, double x)
{
    static const int32_t tri[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    const Vec3 pos[6] = {{x + 1, 0, 0}, {x - 1, 0, 0}, {x, 1, 0}, {x, -1, 0}, {x, 0, 1}, {x, 0, -1}};
    mesh_append(m, 6, pos, NULL, 8, tri);
}

static int euler(const Mesh *m)
{
    return m->nvert - m->deadvert - (m->ntri - m->deadtri) / 2;
}

/* The half-edge that a number means, of the living. */
static int pick(const Mesh *m, unsigned number)
{
    int h = (int)(number % (unsigned)(3 * m->ntri));
    while (tri_is_dead(m, h / 3)) h = (h + 1) % (3 * m->ntri);
    return h;
}

static Vec3 middle(const Mesh *m, int h) { return v_mid(m->pos[he_from(m, h)], m->pos[he_to(m, h)]); }

static void split(Mesh *m, int h)
{
    if (m->ntri - m->deadtri < TRIANGLES_MAX) mesh_split_edge(m, h, middle(m, h), m->next_id++);
}

static void collapse(Mesh *m, int h)
{
    if (mesh_can_collapse(m, h)) mesh_collapse_edge(m, h, middle(m, h));
}

static void flip(Mesh *m, int h)
{
    if (mesh_can_flip(m, h)) mesh_flip_edge(m, h);
}

/* Whether nothing of a component is left beside the region, or a border is too short for a fan. */
static bool can_cap(const Region *r, const Borders *b)
{
    int before = mesh_components(r->mesh, NULL, NULL);
    if (b->n == 0 || before == 0) return false;
    for (int i = 0; i < b->n; i++)
        if (border_length(b, i) < 3) return false;
    return true;
}

/* Cuts the triangles around a few places out and closes each border by a fan. */
static void cut_and_cap(Mesh *m, int h, unsigned more)
{
    Region r;
    Borders b = {0};
    region_init(&r, m);
    region_add(&r, h / 3);
    for (unsigned i = 0; i < more % 3; i++) region_grow(&r);
    if (more & 4) region_add(&r, pick(m, more * 37) / 3);
    if (region_unpinch(&r, REGION_MAX)) {
        if (more & 8) region_fill_islands(&r, REGION_MAX);
        region_borders(&r, &b);
        if (can_cap(&r, &b)) {
            Vec3 centre[REGION_MAX * 3];
            for (int i = 0; i < b.n; i++) centre[i] = border_centre(m, &b, i);
            mesh_erase(m, &r);
            for (int i = 0; i < b.n; i++) mesh_cap(m, border_length(&b, i), border_halves(&b, i), centre[i], m->next_id++);
        }
    }
    borders_free(&b);
    region_free(&r);
}

/* Sews the rings around two vertices together where that makes no double edge: a handle, or two components into one. */
static void weld(Mesh *m, int h, unsigned other)
{
    int v = he_from(m, h), w = he_from(m, pick(m, other * 53));
    int n = mesh_valence(m, v);
    int32_t matched[64];
    Region r;
    Borders b = {0};
    if (v == w || n > 64 || n != mesh_valence(m, w)) return;
    region_init(&r, m);
    for (int k = 0, g = m->out[v]; k < n; k++, g = he_around(m, g)) region_add(&r, g / 3);
    for (int k = 0, g = m->out[w]; k < n; k++, g = he_around(m, g)) {
        if (region_has(&r, g / 3)) goto done; /* the rings share a triangle */
        region_add(&r, g / 3);
    }
    int before = r.n;
    if (!region_unpinch(&r, REGION_MAX) || r.n != before) goto done;
    region_borders(&r, &b);
    if (b.n != 2 || border_length(&b, 0) != n || border_length(&b, 1) != n) goto done;
    for (int i = 0; i < n; i++) matched[i] = border_halves(&b, 1)[((int)other + n - i) % n];
    if (!mesh_can_weld(m, n, border_halves(&b, 0), matched)) goto done;
    int was = euler(m);
    mesh_erase(m, &r);
    mesh_weld(m, n, border_halves(&b, 0), matched);
    if (euler(m) != was - 2) abort();
done:
    borders_free(&b);
    region_free(&r);
}

static void check(const Mesh *m)
{
    const char *wrong = mesh_check(m);
    if (!wrong) return;
    fprintf(stderr, "%s\n", wrong);
    abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    Mesh m;
    mesh_init(&m);
    add_octahedron(&m, 0);
    add_octahedron(&m, 5);
    for (size_t i = 0; i + 3 <= size && m.ntri > m.deadtri; i += 3) {
        int h = pick(&m, data[i + 1] * 256u + data[i + 2]), was = euler(&m);
        switch (data[i] % 8) {
        case 0:
        case 1: split(&m, h); break;
        case 2: collapse(&m, h); break;
        case 3:
        case 4: flip(&m, h); break;
        case 5: cut_and_cap(&m, h, data[i] / 8); break;
        case 6: weld(&m, h, data[i] / 8); break;
        default: mesh_compact(&m, NULL); break;
        }
        check(&m);
        if ((data[i] % 8 < 5 || data[i] % 8 == 7) && euler(&m) != was) abort();
    }
    mesh_free(&m);
    return 0;
}
