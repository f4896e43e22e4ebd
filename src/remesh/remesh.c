/* remesh.c: guards and single guarded edits. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

#include <stdlib.h>
#include <string.h>

enum { GRAIN = 512, EDGE_GRAIN = 2048, LAND_BATCH = 64 };

const Limits LIMITS_EDIT = {0.65, 0.25, 0.2, 1.45};
const Limits LIMITS_MOVE = {0.3, 0.15, 0.3, 0};
const Limits LIMITS_TIDY = {0.4, 0.25, 0.35, 1.7};

/* --- guards ------------------------------------------------------------------------------------------------------ */

double triangle_deviation(const Field *f, const Vec3 p[3])
{
    return real_min(field_distance_vox(f, v_scale(v_add(v_add(p[0], p[1]), p[2]), 1.0 / 3)), DEVIATION_FAR_VOX);
}

Fitness triangle_fitness(const Vec3 p[3], const Vec3 n[3])
{
    Vec3 a = v_area2(p[0], p[1], p[2]);
    double area2 = v_len(a), sum = v_len2(v_sub(p[1], p[0])) + v_len2(v_sub(p[2], p[1])) + v_len2(v_sub(p[0], p[2]));
    if (!(area2 > 0)) return (Fitness){-1, 0};
    Vec3 s = v_add(v_add(n[0], n[1]), n[2]);
    return (Fitness){v_dot(a, s) / (3 * area2), 3.4641016151377544 * area2 / sum};
}

void fitness_worsen(Fitness *f, Fitness by)
{
    f->facing = real_min(f->facing, by.facing);
    f->quality = real_min(f->quality, by.quality);
}

Vec3 remesh_place_around(Vec3 p, Vec3 n, int i, double step, double edge)
{
    static const double COS[8] = {1, 0.7071067811865476, 0, -0.7071067811865476, -1, -0.7071067811865476, 0, 0.7071067811865476};
    Vec3 side = fabs(n.x) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0), u = v_unit(v_cross(n, side)), w = v_cross(n, u);
    double radius = step * (1 + i / 8) * edge;
    return v_axpy(v_axpy(p, radius * COS[i & 7], u), radius * COS[(i + 6) & 7], w);
}

Vec3 remesh_normal_at(const Remesh *r, Vec3 p)
{
    Vec3 n;
    field_normals(r->field, 1, &p, &n);
    return n;
}

/* --- the column of normals --------------------------------------------------------------------------------------- */

void remesh_make_room(Remesh *r)
{
    if (r->mesh->nvert <= r->cap) return;
    r->cap = mem_capacity(r->cap, r->mesh->nvert);
    RESIZE(r->normal, r->cap);
    if (r->homes.is_home) RESIZE(r->home, r->cap);
    if (r->zone) RESIZE(r->zone, r->cap);
}

void remesh_land_points(const Remesh *r, int n, const int32_t *v, Vec3 *p, double reach, Vec3 *normal, bool *landed)
{
    for (int begin = 0; begin < n; begin += LAND_BATCH) {
        Vec3 q[LAND_BATCH], at[LAND_BATCH];
        uint8_t status[LAND_BATCH];
        int m = int_min(LAND_BATCH, n - begin);
        memcpy(q, p + begin, (size_t)m * sizeof *q);
        field_land_each(r->field, m, q, reach, at, status);
        for (int i = 0; i < m; i++) {
            int home = r->home ? r->home[v[begin + i]] : NONE;
            landed[begin + i] = status[i] == LANDED && (home == NONE || r->homes.is_home(r->homes.ctx, home, q[i]));
            if (!landed[begin + i]) continue;
            p[begin + i] = q[i];
            normal[begin + i] = at[i];
        }
    }
}

bool remesh_land_point(const Remesh *r, int v, Vec3 *p, double reach, Vec3 *normal)
{
    int32_t vert = v;
    bool landed;
    remesh_land_points(r, 1, &vert, p, reach, normal, &landed);
    return landed;
}

static void mark_corners(const Mesh *m, int t, uint8_t *mark)
{
    for (int k = 0; k < 3; k++) mark[m->corner[3 * t + k]] = 1;
}

/* The triangles of look[mesh->ntri]. */
static void set_scope(Remesh *r, const uint8_t *look)
{
    r->nscope = 0;
    r->scope_end = r->mesh->ntri;
    RESIZE(r->scope, r->scope_end);
    for (int t = 0; t < r->scope_end; t++)
        if (look[t]) r->scope[r->nscope++] = t;
}

static void find_scope(Remesh *r)
{
    const Mesh *m = r->mesh;
    uint8_t *near = NEW0(uint8_t, m->nvert), *look = NEW(uint8_t, m->ntri);
    for (int t = 0; t < m->ntri; t++)
        if (!tri_is_dead(m, t) && remesh_touches_zone(r, t)) mark_corners(m, t, near);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        look[t] = !tri_is_dead(m, t) && (near[c[0]] || near[c[1]] || near[c[2]]);
    }
    set_scope(r, look);
    mem_free(near);
    mem_free(look);
}

void remesh_narrow(Remesh *r, const uint8_t *held)
{
    const Mesh *m = r->mesh;
    uint8_t *look = NEW0(uint8_t, m->ntri);
    ASSERT(!r->zone);
    for (int v = 0; v < m->nvert; v++) {
        if (held[v] || vert_is_dead(m, v)) continue;
        int h = m->out[v];
        do look[h / 3] = look[m->opp[he_next(h)] / 3] = 1;
        while ((h = he_around(m, h)) != m->out[v]);
    }
    set_scope(r, look);
    mem_free(look);
}

static void widen(Remesh *r)
{
    mem_free(r->scope);
    r->scope = NULL;
}

void remesh_compact(Remesh *r, int32_t *vert_to)
{
    int n = r->mesh->nvert;
    int32_t *to = vert_to ? vert_to : NEW(int32_t, n);
    mesh_compact(r->mesh, to);
    for (int v = 0; v < n; v++) {
        if (to[v] == NONE) continue;
        r->normal[to[v]] = r->normal[v];
        if (r->home) r->home[to[v]] = r->home[v];
        if (r->zone) r->zone[to[v]] = r->zone[v];
    }
    if (!vert_to) mem_free(to);
    if (r->zone) find_scope(r);
    else widen(r);
}

typedef struct NormalJob {
    Remesh *r;
    const uint8_t *wanted;
} NormalJob;

static void normals_block(void *ctx, int begin, int end)
{
    NormalJob *job = ctx;
    Remesh *r = job->r;
    for (int v = begin; v < end; v++)
        if (!vert_is_dead(r->mesh, v) && (!job->wanted || job->wanted[v])) r->normal[v] = remesh_normal_at(r, r->mesh->pos[v]);
}

static void set_up(Remesh *r, Mesh *mesh, const Field *field, double edge, const Homes *homes)
{
    *r = (Remesh){.mesh = mesh, .field = field, .edge = edge};
    if (homes) r->homes = *homes;
    remesh_make_room(r);
    if (homes) memcpy(r->home, homes->of, (size_t)mesh->nvert * sizeof *r->home);
}

void remesh_begin(Remesh *r, Mesh *mesh, const Field *field, double edge, const Homes *homes)
{
    set_up(r, mesh, field, edge, homes);
    parallel_for(mesh->nvert, GRAIN, normals_block, &(NormalJob){r, NULL});
}

void remesh_begin_confined(Remesh *r, Mesh *mesh, const Field *field, double edge, const Homes *homes, int first)
{
    set_up(r, mesh, field, edge, homes);
    r->zone = NEW(uint8_t, r->cap);
    for (int v = 0; v < mesh->nvert; v++) r->zone[v] = v < first ? ZONE_FIXED : ZONE_FRESH;
    for (int h = 0; h < 3 * mesh->ntri; h++)
        if (!tri_is_dead(mesh, h / 3) && he_from(mesh, h) < first && he_to(mesh, h) >= first) r->zone[he_from(mesh, h)] = ZONE_MOVES;
    find_scope(r);
    uint8_t *wanted = NEW0(uint8_t, mesh->nvert);
    for (int i = 0; i < r->nscope; i++) mark_corners(mesh, r->scope[i], wanted);
    memset(r->normal, 0, (size_t)mesh->nvert * sizeof *r->normal);
    parallel_for(mesh->nvert, GRAIN, normals_block, &(NormalJob){r, wanted});
    mem_free(wanted);
}

void remesh_end(Remesh *r)
{
    mem_free(r->zone);
    mem_free(r->scope);
    mem_free(r->normal);
    mem_free(r->home);
    *r = (Remesh){0};
}

typedef struct LandJob {
    Remesh *r;
    const uint8_t *moved;
    double reach;
} LandJob;

static void land_block(void *ctx, int begin, int end)
{
    LandJob *job = ctx;
    Remesh *r = job->r;
    Mesh *m = r->mesh;
    int32_t vert[GRAIN] = {0};
    Vec3 p[GRAIN], normal[GRAIN];
    bool landed[GRAIN];
    int n = 0;
    for (int v = begin; v < end; v++) {
        if (vert_is_dead(m, v) || (job->moved && !job->moved[v])) continue;
        vert[n] = v;
        p[n++] = m->pos[v];
    }
    remesh_land_points(r, n, vert, p, job->reach, normal, landed);
    for (int i = 0; i < n; i++) {
        m->pos[vert[i]] = p[i];
        r->normal[vert[i]] = landed[i] ? normal[i] : remesh_normal_at(r, p[i]);
    }
}

void remesh_land(Remesh *r, const uint8_t *moved, double reach)
{
    parallel_for(r->mesh->nvert, GRAIN, land_block, &(LandJob){r, moved, reach});
}

typedef struct RememberJob {
    Mesh *mesh;
    const uint8_t *held;
} RememberJob;

static void remember_block(void *ctx, int begin, int end)
{
    const RememberJob *job = ctx;
    Mesh *m = job->mesh;
    for (int h = 3 * begin; h < 3 * end; h++)
        if (!tri_is_dead(m, h / 3) && !(job->held && job->held[he_from(m, h)] && job->held[he_to(m, h)])) m->length[h] = (float)mesh_edge_length(m, h);
}

void remesh_remember_lengths(Mesh *m, const uint8_t *held) { parallel_for(m->ntri, EDGE_GRAIN, remember_block, &(RememberJob){m, held}); }

/* --- edges in order ---------------------------------------------------------------------------------------------- */

void remesh_sort_edges(int n, EdgeEnds *e, bool descending)
{
    EdgeEnds *from = e, *to = mem_alloc((size_t)n, sizeof *to), *spare = to;
    const double sign = descending ? -1 : 1;
    for (int run = 1; run < n; run *= 2) {
        for (int lo = 0; lo < n; lo += 2 * run) {
            int mid = int_min(lo + run, n), hi = int_min(mid + run, n), a = lo, b = mid;
            for (int i = lo; i < hi; i++) to[i] = b == hi || (a < mid && sign * from[a].length <= sign * from[b].length) ? from[a++] : from[b++];
        }
        EdgeEnds *t = from;
        from = to;
        to = t;
    }
    if (from != e) memcpy(e, from, (size_t)n * sizeof *e);
    mem_free(spare);
}

typedef struct EdgeList {
    EdgeEnds *edge;
    int n, cap;
} EdgeList;

typedef struct EdgeJob {
    const Remesh *r;
    const EdgeChoice *choice;
    EdgeList *list; /* a block */
} EdgeJob;

static void edge_block(void *ctx, int begin, int end)
{
    const EdgeJob *job = ctx;
    const Remesh *r = job->r;
    const Mesh *m = r->mesh;
    const EdgeChoice *c = job->choice;
    EdgeList *list = &job->list[begin / EDGE_GRAIN];
    const double most2 = c->hi * c->hi * (1 + 1e-12), least2 = c->lo > 0 ? c->lo * c->lo * (1 - 1e-12) : -1; /* surely not between lo and hi */
    for (int i = begin; i < end; i++) {
        int t = remesh_scope_tri(r, i);
        for (int h = 3 * t; h < 3 * t + 3 && !tri_is_dead(m, t); h++) {
            int a = he_from(m, h), b = he_to(m, h);
            if (h > m->opp[h] || !(remesh_in_zone(r, a) || remesh_in_zone(r, b))) continue;
            double l2 = v_len2(v_sub(m->pos[a], m->pos[b]));
            if (l2 < least2 || l2 > most2) continue;
            double l = mesh_edge_length(m, h);
            if (!(l > c->lo && l < c->hi) || (c->test && !c->test(m, h, l, c->ctx))) continue;
            RESERVE(list->edge, list->cap, list->n + 1);
            list->edge[list->n++] = (EdgeEnds){l, h, a, b};
        }
    }
}

int remesh_find_edges(const Remesh *r, const EdgeChoice *choice, EdgeEnds **edges)
{
    int ntri = remesh_scope_size(r), blocks = (ntri + EDGE_GRAIN - 1) / EDGE_GRAIN, n = 0;
    EdgeList *list = NEW0(EdgeList, blocks);
    parallel_for(ntri, EDGE_GRAIN, edge_block, &(EdgeJob){r, choice, list});
    for (int b = 0; b < blocks; b++) n += list[b].n;
    EdgeEnds *all = NEW(EdgeEnds, n);
    n = 0;
    for (int b = 0; b < blocks; b++) {
        if (list[b].n) memcpy(all + n, list[b].edge, (size_t)list[b].n * sizeof *all);
        n += list[b].n;
        mem_free(list[b].edge);
    }
    mem_free(list);
    *edges = all;
    return n;
}

int remesh_edges_by_length(const Remesh *r, const EdgeChoice *choice, bool descending, EdgeEnds **edges)
{
    int n = remesh_find_edges(r, choice, edges);
    remesh_sort_edges(n, *edges, descending);
    return n;
}

int remesh_find_edge(const Mesh *m, const EdgeEnds *e)
{
    if (m->corner[e->h] == e->from && he_to(m, e->h) == e->to) return e->h;
    if (vert_is_dead(m, e->from) || vert_is_dead(m, e->to)) return NONE;
    return mesh_find_edge(m, e->from, e->to);
}

/* --- split and collapse ------------------------------------------------------------------------------------------ */

void remesh_split(Remesh *r, int h)
{
    Mesh *m = r->mesh;
    int a = he_from(m, h), b = he_to(m, h);
    Vec3 p = v_mid(m->pos[a], m->pos[b]), n = v_unit(v_add(r->normal[a], r->normal[b])), q = p, nq;
    /* the landing may find another sheet: believe it only where the normal goes on */
    if (remesh_land_point(r, a, &q, 0.5 * v_dist(m->pos[a], m->pos[b]), &nq) && v_dot(nq, n) > 0) p = q, n = nq;
    int v = mesh_split_edge(m, h, p, mesh_fresh_id(m));
    remesh_make_room(r);
    r->normal[v] = n;
    if (r->home) r->home[v] = r->home[a];
    if (r->zone) r->zone[v] = ZONE_FRESH;
}

/* Of the triangles around v that hold w not, with v at p, normal n. Stops below `least`, where that is given. */
static bool ring_fitness(const Remesh *r, int v, int w, Vec3 p, Vec3 n, const Fitness *least, Fitness *worst)
{
    const Mesh *m = r->mesh;
    int h = m->out[v];
    do {
        int b = he_to(m, h), c = m->corner[he_prev(h)];
        if (b == w || c == w) continue;
        fitness_worsen(worst, triangle_fitness((Vec3[3]){p, m->pos[b], m->pos[c]}, (Vec3[3]){n, r->normal[b], r->normal[c]}));
        if (least && (worst->facing < least->facing || worst->quality < least->quality)) return false;
    } while ((h = he_around(m, h)) != m->out[v]);
    return true;
}

/* No edge of the same ring is overlong and grows. */
static bool ring_is_short(const Remesh *r, int v, int w, Vec3 p, const Limits *limits, double *longest2)
{
    const Mesh *m = r->mesh;
    double longest = limits->longest * r->edge;
    int h = m->out[v];
    do {
        int b = he_to(m, h);
        if (b == w) continue;
        double l2 = v_len2(v_sub(m->pos[b], p));
        if (l2 > longest * longest && l2 > v_len2(v_sub(m->pos[b], m->pos[v]))) return false;
        *longest2 = real_max(*longest2, l2);
    } while ((h = he_around(m, h)) != m->out[v]);
    return true;
}

/* The worst of the same triangles, or the first found above `most`. */
static double ring_deviation(const Remesh *r, int v, int w, Vec3 p, double most)
{
    const Mesh *m = r->mesh;
    double worst = 0;
    int h = m->out[v];
    do {
        int b = he_to(m, h), c = m->corner[he_prev(h)];
        if (b != w && c != w) worst = real_max(worst, triangle_deviation(r->field, (Vec3[3]){p, m->pos[b], m->pos[c]}));
    } while (worst <= most && (h = he_around(m, h)) != m->out[v]);
    return worst;
}

static bool deviates_less(const Remesh *r, int a, int b, Vec3 p, double most)
{
    return ring_deviation(r, a, b, p, most) <= most && ring_deviation(r, b, a, p, most) <= most;
}

/* Does a collapse of a and b at p keep the triangles where they are, on the surface? Where their normals turn by so little that
 * none can bulge as far, certainly. */
static bool stays_close(const Remesh *r, int a, int b, Vec3 p, double longest2, double facing, const Limits *limits)
{
    const Mesh *m = r->mesh;
    double voxel = DEVIATION_EDGE_VOX * r->field->voxel, most = limits->deviation_vox * r->field->voxel;
    if (longest2 < voxel * voxel || 0.25 * longest2 * (1 - facing) < most * most) return true;
    if (deviates_less(r, a, b, p, limits->deviation_vox)) return true;
    double before = real_max(ring_deviation(r, a, b, m->pos[a], DEVIATION_FAR_VOX), ring_deviation(r, b, a, m->pos[b], DEVIATION_FAR_VOX));
    return before > limits->deviation_vox && deviates_less(r, a, b, p, before);
}

/* Of the triangles that a collapse of a and b changes, with them at these places. False: below `least` (may be NULL), and *worst is not all. */
static bool collapse_fitness(const Remesh *r, int a, int b, const Vec3 p[2], const Vec3 n[2], const Fitness *least, Fitness *worst)
{
    *worst = fitness_best();
    return ring_fitness(r, a, b, p[0], n[0], least, worst) && ring_fitness(r, b, a, p[1], n[1], least, worst);
}

bool remesh_can_collapse(const Mesh *m, int h)
{
    int c = m->corner[he_prev(h)], d = m->corner[he_prev(m->opp[h])];
    return (mesh_valence(m, c) > 4 || mesh_valence(m, d) > 4) && mesh_can_collapse(m, h);
}

bool remesh_try_collapse(Remesh *r, int h, const Limits *limits)
{
    Mesh *m = r->mesh;
    int a = he_from(m, h), b = he_to(m, h);
    if (m->id[a] > m->id[b]) { /* the older identity stays */
        h = m->opp[h];
        a = he_from(m, h), b = he_to(m, h);
    }
    if ((r->zone && r->zone[b] < ZONE_FRESH) || !remesh_can_collapse(m, h)) return false;
    Vec3 place[3] = {v_mid(m->pos[a], m->pos[b]), m->pos[a], m->pos[b]};
    Vec3 normal[3] = {v_unit(v_add(r->normal[a], r->normal[b])), r->normal[a], r->normal[b]};
    bool fixed = !remesh_in_zone(r, a); /* then the place is its own */
    bool compared = false;
    Fitness least = {limits->facing, limits->quality}, before, after; /* least: lower where it was worse before, asked for only then */
    for (int k = fixed ? 1 : 0; k < (fixed ? 2 : 3); k++) {
        double longest2 = 0;
        if (!ring_is_short(r, a, b, place[k], limits, &longest2) || !ring_is_short(r, b, a, place[k], limits, &longest2)) continue;
        Vec3 p[2] = {place[k], place[k]}, n[2] = {normal[k], normal[k]};
        if (!collapse_fitness(r, a, b, p, n, &least, &after)) {
            if (compared) continue;
            collapse_fitness(r, a, b, place + 1, normal + 1, NULL, &before);
            least = (Fitness){real_min(limits->facing, before.facing), real_min(limits->quality, before.quality)};
            compared = true;
            if (!collapse_fitness(r, a, b, p, n, &least, &after)) continue;
        }
        if (!stays_close(r, a, b, place[k], longest2, after.facing, limits)) continue;
        mesh_collapse_edge(m, h, place[k]);
        r->normal[a] = normal[k];
        return true;
    }
    return false;
}
