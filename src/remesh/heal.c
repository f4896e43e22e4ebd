/* heal.c: inverted triangles (GI'07 2.6) that forces did not turn back. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

enum { ROUNDS_MAX = 6, GRAIN = 512 };
#define OFF_SURFACE_VOX 0.02 /* to first order: a vertex farther from the surface did not land */

static bool inverted_with(const Remesh *r, int t, int v, Vec3 p)
{
    const Mesh *m = r->mesh;
    Vec3 q[3];
    for (int k = 0; k < 3; k++) q[k] = m->corner[3 * t + k] == v ? p : m->pos[m->corner[3 * t + k]];
    if (!(v_len2(v_area2(q[0], q[1], q[2])) > 0)) return true;
    return field_triangle_inverted(r->field, q[0], q[1], q[2]);
}

/* Inverted triangles around v if it stood at p; those that hold `without` do not count. */
static int count_ring(const Remesh *r, int v, Vec3 p, int without)
{
    const Mesh *m = r->mesh;
    int n = 0, h = m->out[v];
    do {
        if (he_to(m, h) == without || m->corner[he_prev(h)] == without) continue;
        n += inverted_with(r, h / 3, v, p);
    } while ((h = he_around(m, h)) != m->out[v]);
    return n;
}

static bool heal_by_flip(Remesh *r, int t)
{
    Mesh *m = r->mesh;
    for (int k = 0; k < 3; k++) {
        int h = 3 * t + k, g = m->opp[h];
        if (!mesh_can_flip(m, h)) continue;
        Vec3 a = m->pos[he_from(m, h)], b = m->pos[he_to(m, h)], c = m->pos[m->corner[he_prev(h)]], d = m->pos[m->corner[he_prev(g)]];
        if (!(v_len2(v_area2(d, c, a)) > 0) || !(v_len2(v_area2(c, d, b)) > 0)) continue;
        if (field_triangle_inverted(r->field, d, c, a) || field_triangle_inverted(r->field, c, d, b)) continue;
        mesh_flip_edge(m, h);
        return true;
    }
    return false;
}

static bool heal_by_collapse(Remesh *r, int t)
{
    Mesh *m = r->mesh;
    for (int k = 0; k < 3; k++) {
        int h = 3 * t + k, a = he_from(m, h), b = he_to(m, h);
        if (!remesh_can_collapse(m, h)) continue;
        Vec3 mid = v_mid(m->pos[a], m->pos[b]), n;
        remesh_land_point(r, a, &mid, 0.5 * r->edge, &n);
        Vec3 place[3] = {mid, m->pos[a], m->pos[b]};
        for (int i = 0; i < 3; i++) {
            if (count_ring(r, a, place[i], b) || count_ring(r, b, place[i], a)) continue;
            mesh_collapse_edge(m, h, place[i]);
            r->normal[a] = remesh_normal_at(r, place[i]);
            return true;
        }
    }
    return false;
}

static bool try_place(Remesh *r, int v, Vec3 p, int before)
{
    Vec3 n;
    if (!remesh_land_point(r, v, &p, 0.6 * r->edge, &n) || count_ring(r, v, p, NONE) >= before) return false;
    r->mesh->pos[v] = p;
    r->normal[v] = n;
    return true;
}

/* Towards the neighbours' mean; failing that, anywhere in the tangent plane around that leaves fewer triangles inverted. */
static bool heal_by_move(Remesh *r, int t)
{
    Mesh *m = r->mesh;
    for (int k = 0; k < 3; k++) {
        int v = m->corner[3 * t + k], before = count_ring(r, v, m->pos[v], NONE);
        Vec3 mean = mesh_ring_mean(m, v);
        for (int i = 0; i < 3; i++)
            if (try_place(r, v, v_mix(m->pos[v], mean, 1 - 0.35 * i), before)) return true;
    }
    for (int k = 0; k < 3; k++) {
        int v = m->corner[3 * t + k], before = count_ring(r, v, m->pos[v], NONE);
        Vec3 mean = mesh_ring_mean(m, v), n = r->normal[v];
        for (int i = 0; i < 24; i++)
            if (try_place(r, v, remesh_place_around(mean, n, i, 0.2, r->edge), before)) return true;
    }
    return false;
}

static bool is_held(const Remesh *r, int v, const uint8_t *frozen) { return (frozen && frozen[v]) || !remesh_in_zone(r, v); }

static bool is_frozen(const Remesh *r, int t, const uint8_t *frozen)
{
    const int32_t *c = r->mesh->corner + 3 * t;
    return is_held(r, c[0], frozen) && is_held(r, c[1], frozen) && is_held(r, c[2], frozen);
}

static bool is_inverted(const Remesh *r, int t)
{
    const Mesh *m = r->mesh;
    const int32_t *c = m->corner + 3 * t;
    if (tri_is_dead(m, t) || !remesh_touches_zone(r, t)) return false;
    Fitness f = triangle_fitness((Vec3[3]){m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]}, (Vec3[3]){r->normal[c[0]], r->normal[c[1]], r->normal[c[2]]});
    return f.facing < FACING_SURE && inverted_with(r, t, NONE, vec3(0, 0, 0));
}

/* What is wrong, looked for before any of it is put right: mostly nothing is. */
typedef struct Search {
    const Remesh *r;
    const uint8_t *frozen;
    uint8_t *wrong; /* [triangles in scope] or [nvert] */
} Search;

static void search_inverted(void *ctx, int begin, int end)
{
    Search *s = ctx;
    for (int i = begin; i < end; i++) s->wrong[i] = is_inverted(s->r, remesh_scope_tri(s->r, i));
}

int remesh_heal(Remesh *r, const uint8_t *frozen, int *found)
{
    const int n = remesh_scope_size(r); /* healing makes no new triangles */
    uint8_t *wrong = NEW(uint8_t, n);
    int left = 0;
    for (int round = 0; round < ROUNDS_MAX; round++) {
        int seen = 0, healed = 0;
        parallel_for(n, GRAIN, search_inverted, &(Search){r, frozen, wrong});
        for (int i = 0; i < n; i++) {
            int t = remesh_scope_tri(r, i);
            if (!wrong[i] || !is_inverted(r, t)) continue;
            seen++;
            if (is_frozen(r, t, frozen)) continue;
            healed += heal_by_flip(r, t) || heal_by_move(r, t) || heal_by_collapse(r, t);
        }
        if (round == 0) *found = seen;
        left = seen;
        if (!seen || !healed) break;
    }
    mem_free(wrong);
    return left;
}

/* --- strays ------------------------------------------------------------------------------------------------------ */

static bool is_astray(const Remesh *r, int v)
{
    if (field_distance_vox(r->field, r->mesh->pos[v]) > OFF_SURFACE_VOX) return true;
    return r->home[v] != NONE && !r->homes.is_home(r->homes.ctx, r->home[v], r->mesh->pos[v]);
}

/* The neighbours' mean, then places ever nearer to each neighbour. */
static bool move_home(Remesh *r, int v)
{
    Mesh *m = r->mesh;
    Vec3 mean = mesh_ring_mean(m, v);
    int h = m->out[v], before = count_ring(r, v, m->pos[v], NONE);
    for (int i = 0; i < 4; i++)
        do {
            Vec3 p = i == 0 ? mean : v_mix(m->pos[he_to(m, h)], mean, 0.75 - 0.2 * i), n;
            if (!remesh_land_point(r, v, &p, r->edge, &n) || count_ring(r, v, p, NONE) > before) continue;
            m->pos[v] = p;
            r->normal[v] = n;
            return true;
        } while ((h = he_around(m, h)) != m->out[v] && i > 0);
    return false;
}

static bool collapse_home(Remesh *r, int v)
{
    Mesh *m = r->mesh;
    int h = m->out[v];
    do {
        int b = he_to(m, h);
        if (!remesh_can_collapse(m, h) || is_astray(r, b)) continue;
        Vec3 p = m->pos[b];
        if (count_ring(r, v, p, b)) continue;
        mesh_collapse_edge(m, m->opp[h], p);
        return true;
    } while ((h = he_around(m, h)) != m->out[v]);
    return false;
}

static void search_astray(void *ctx, int begin, int end)
{
    Search *s = ctx;
    for (int v = begin; v < end; v++) s->wrong[v] = !vert_is_dead(s->r->mesh, v) && !is_held(s->r, v, s->frozen) && is_astray(s->r, v);
}

int remesh_rehome(Remesh *r, const uint8_t *frozen)
{
    if (!r->home) return 0;
    Mesh *m = r->mesh;
    const int nvert = m->nvert;
    uint8_t *wrong = NEW(uint8_t, nvert);
    int left = 0;
    parallel_for(nvert, GRAIN, search_astray, &(Search){r, frozen, wrong});
    for (int v = 0; v < nvert; v++) {
        if (!wrong[v] || vert_is_dead(m, v)) continue;
        Vec3 p = m->pos[v], n;
        if (remesh_land_point(r, v, &p, 0.5 * r->edge, &n) && count_ring(r, v, p, NONE) <= count_ring(r, v, m->pos[v], NONE)) {
            m->pos[v] = p;
            r->normal[v] = n;
        } else {
            left += !move_home(r, v) && !collapse_home(r, v);
        }
    }
    mem_free(wrong);
    return left;
}
