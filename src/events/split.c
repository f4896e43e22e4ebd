/* split.c: RR-6128 4.2. Quasi-critical points are clustered by distance (single linkage), so that several splits in a frame each
 * get a plane of their own. */
#include "base/hash.h"
#include "base/sets.h"
#include "base/thread.h"
#include "events/events_priv.h"

#include <stdlib.h>

enum { GRAIN = 1024, NORMALS_MOST = 128, RING_MOST = 400 };
#define REACH_EDGES 1.0     /* a midpoint lands at most this far away, in lengths of its edge */
#define CLUSTER_EDGES 1.0   /* points nearer than this to one another belong to one place, in mechanical edges */
#define PI 3.14159265358979323846

/* --- detection ------------------------------------------------------------------------------------------------------------ */

typedef struct Search {
    const RefinedMesh *fine;
    const Field *field;
    double cos_limit, deviation;
    uint8_t *critical;  /* [3*ntri] */
} Search;

/* Would refinement cut an edge of these ends and this midpoint? */
static bool is_wanted(const Search *s, Vec3 na, Vec3 nb, Vec3 mid)
{
    if (v_dot(na, nb) < s->cos_limit) return true;
    double F = field_value(s->field, mid, NULL, NULL);
    return F * F > s->deviation * s->deviation * v_len2(field_gradient(s->field, mid));
}

static void search_block(void *ctx, int begin, int end)
{
    Search *s = ctx;
    const RefinedMesh *m = s->fine;
    for (int h = begin; h < end; h++) {
        int a = m->tri[h], b = m->tri[he_next(h)];
        if (a > b) continue; /* the other half of the edge */
        Vec3 mid = v_mid(m->pos[a], m->pos[b]);
        if (!is_wanted(s, m->normal[a], m->normal[b], mid)) continue;
        double reach = REACH_EDGES * v_dist(m->pos[a], m->pos[b]);
        s->critical[h] = !events_can_land(s->field, mid, v_add(m->normal[a], m->normal[b]), reach);
    }
}

int events_quasi_critical(const RefinedMesh *fine, const Field *field, const EventRules *rules, QuasiCritical **found)
{
    int nhalf = 3 * fine->ntri, n = 0;
    Search s = {fine, field, cos(rules->angle_deg * PI / 180), rules->deviation_vox * field->voxel, NEW0(uint8_t, nhalf)};
    if (!(rules->deviation_vox > 0)) s.deviation = INFINITY;
    parallel_for(nhalf, GRAIN, search_block, &s);
    for (int h = 0; h < nhalf; h++) n += s.critical[h];
    *found = NEW(QuasiCritical, n);
    n = 0;
    for (int h = 0; h < nhalf; h++)
        if (s.critical[h]) (*found)[n++] = (QuasiCritical){v_mid(fine->pos[fine->tri[h]], fine->pos[fine->tri[he_next(h)]]), fine->parent[h / 3]};
    mem_free(s.critical);
    return n;
}

/* --- clusters: single linkage in a hashed grid of cells of the linking distance ---------------------------------------- */

static uint64_t cell_of(Vec3 p, double cell, int dx, int dy, int dz)
{
    const double most = 1e6;
    return key_coord((int)real_clamp(floor(p.x / cell), -most, most) + dx, (int)real_clamp(floor(p.y / cell), -most, most) + dy,
                     (int)real_clamp(floor(p.z / cell), -most, most) + dz);
}

static void join_cell(const QuasiCritical *q, int i, int first, const int32_t *next, double near, int32_t *up)
{
    for (int j = first; j != NONE; j = next[j]) {
        if (j == i || v_len2(v_sub(q[i].p, q[j].p)) > near * near) continue;
        int a = set_root(up, i), b = set_root(up, j);
        up[int_max(a, b)] = int_min(a, b);
    }
}

/* cluster[n]: the lowest point of each one's cluster. */
static void find_clusters(int n, const QuasiCritical *q, double near, int32_t *cluster)
{
    Map cell;
    int32_t *head = NEW(int32_t, n), *next = NEW(int32_t, n);
    int ncell = 0;
    map_init(&cell, n);
    for (int i = 0; i < n; i++) {
        int c = map_put(&cell, cell_of(q[i].p, near, 0, 0, 0), ncell);
        next[i] = c == ncell ? NONE : head[c];
        if (c == ncell) ncell++;
        head[c] = i;
        cluster[i] = i;
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 27; k++) {
            int c = map_get(&cell, cell_of(q[i].p, near, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
            if (c != NONE) join_cell(q, i, head[c], next, near, cluster);
        }
    for (int i = 0; i < n; i++) cluster[i] = set_root(cluster, i);
    mem_free(head);
    mem_free(next);
    map_free(&cell);
}

/* --- the splitting plane (algorithm 2) ------------------------------------------------------------------------------------ */

typedef struct Plane {
    Vec3 p, n;
} Plane;

/* Of a cluster's points q[0 .. n). tri[m]: their triangles, each once. */
static Plane splitting_plane(const Mesh *mesh, int n, const QuasiCritical *q, int m, const int32_t *tri)
{
    Plane plane = {{0, 0, 0}, {0, 0, 0}};
    Vec3 normal[NORMALS_MOST];
    for (int i = 0; i < n; i++) plane.p = v_axpy(plane.p, 1.0 / n, q[i].p);
    m = int_min(m, NORMALS_MOST);
    for (int i = 0; i < m; i++) normal[i] = mesh_tri_area2(mesh, tri[i]);
    for (int i = 0; i < m; i++)
        for (int j = i + 1; j < m; j++) {
            Vec3 nij = v_unit(v_cross(normal[i], normal[j]));
            plane.n = v_axpy(plane.n, v_dot(plane.n, nij) < 0 ? -1 : 1, nij);
        }
    plane.n = v_unit(plane.n);
    return plane;
}

/* --- the ring -------------------------------------------------------------------------------------------------------------- */

static bool is_above(const Mesh *m, const Plane *p, int v) { return v_dot(v_sub(m->pos[v], p->p), p->n) > 0; }

/* A half-edge of triangle t that leads from below the plane to above it, or NONE: the plane does not cut t. */
static int upward_edge(const Mesh *m, const Plane *p, int t)
{
    for (int h = 3 * t; h < 3 * t + 3; h++)
        if (!is_above(m, p, he_from(m, h)) && is_above(m, p, he_to(m, h))) return h;
    return NONE;
}

static Vec3 crossing(const Mesh *m, const Plane *p, int h)
{
    Vec3 a = m->pos[he_from(m, h)], b = m->pos[he_to(m, h)];
    double da = v_dot(v_sub(a, p->p), p->n), db = v_dot(v_sub(b, p->p), p->n);
    return v_mix(a, b, da / (da - db));
}

/* Each cut triangle is entered by its downward edge and left by its upward one: the walk comes back to where it began.
 * rim[RING_MOST]: where the plane cuts those edges. Returns how many; 0: no ring. */
static int find_ring(Surgeon *s, const Plane *p, int t, Vec3 *rim)
{
    int first = tri_is_dead(s->mesh, t) ? NONE : upward_edge(s->mesh, p, t), h = first, n = 0;
    region_clear(&s->region);
    if (first == NONE) return 0;
    do {
        region_add(&s->region, h / 3);
        rim[n++] = crossing(s->mesh, p, h);
        h = upward_edge(s->mesh, p, s->mesh->opp[h] / 3);
        ASSERT(h != NONE);
    } while (h != first && n < RING_MOST);
    return h == first ? n : 0;
}

/* Both sides of the ring are closed, if what it reached around is gone. A tip that the ring cuts off with no triangle left is
 * given up: what became of it is a component to be born. */
static bool try_ring(Surgeon *s, int n, const Vec3 *rim)
{
    const Borders *b = &s->borders;
    Vec3 centre = {0, 0, 0};
    for (int i = 0; i < n; i++) centre = v_axpy(centre, 1.0 / n, rim[i]);
    if ((surgeon_disc_inside(s, n, rim) < 0.5) != surgeon_looks_outward(s, centre)) return false;
    if (!surgeon_prepare(s) || b->npiece != 1 || b->n < 1 || b->n > 3) return false;
    for (int i = 0; i < b->n; i++)
        if (border_length(b, i) < 3) return false;
    surgeon_cap_all(s);
    return true;
}

static int compare_ints(const void *pa, const void *pb)
{
    int32_t a = *(const int32_t *)pa, b = *(const int32_t *)pb;
    return (a > b) - (a < b);
}

/* The live triangles of a cluster's points, each once. */
static int list_triangles(const Mesh *m, int n, const QuasiCritical *q, int32_t *tri)
{
    int k = 0, unique = 0;
    for (int i = 0; i < n; i++)
        if (!tri_is_dead(m, q[i].tri)) tri[k++] = q[i].tri;
    qsort(tri, (size_t)k, sizeof *tri, compare_ints);
    for (int i = 0; i < k; i++)
        if (i == 0 || tri[i] != tri[unique - 1]) tri[unique++] = tri[i];
    return unique;
}

static bool split_cluster(Surgeon *s, int n, const QuasiCritical *q)
{
    int32_t *tri = NEW(int32_t, n);
    int m = list_triangles(s->mesh, n, q, tri);
    Plane plane = splitting_plane(s->mesh, n, q, m, tri);
    Vec3 *rim = NEW(Vec3, RING_MOST);
    bool done = false;
    for (int i = 0; i < m && !done; i++) {
        int count = find_ring(s, &plane, tri[i], rim);
        done = count && try_ring(s, count, rim);
    }
    mem_free(rim);
    mem_free(tri);
    return done;
}

int events_split(Mesh *mesh, const RefinedMesh *fine, const Field *field, const EventRules *rules, ChangeList *events)
{
    QuasiCritical *q;
    int n = events_quasi_critical(fine, field, rules, &q), done = 0;
    int32_t *cluster = NEW(int32_t, n);
    QuasiCritical *of = NEW(QuasiCritical, n);
    Surgeon s;
    surgeon_init(&s, mesh, field, rules, events);
    find_clusters(n, q, CLUSTER_EDGES * rules->edge, cluster);
    for (int i = 0; i < n; i++) {
        int count = 0;
        if (cluster[i] != i) continue;
        for (int j = i; j < n; j++)
            if (cluster[j] == i) of[count++] = q[j];
        if (count >= rules->min_split) done += split_cluster(&s, count, of);
    }
    surgeon_free(&s);
    mem_free(cluster);
    mem_free(of);
    mem_free(q);
    return done;
}
