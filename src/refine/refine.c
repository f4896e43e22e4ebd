#include "refine/refine.h"

#include "base/thread.h"

#include <string.h>

/* --- limits -------------------------------------------------------------------------------------------------------- */

#define HYSTERESIS 0.7       /* a marked edge stays marked above this share of a limit */
#define EDGE_SHORTEST_VOX 0.3 /* edges below this are not marked: the samples hold no finer detail */
#define LAND_REACH 0.5       /* a midpoint lands at most this far away, in lengths of its edge */
#define FACING_MIN 0.2       /* mean cosine of a cut triangle's normal to the surface's; below it midpoints go back */

enum { GRAIN = 1024, SEND_BACK_ROUNDS = 8 };

/* One pass's view of the mesh: its edges. */
typedef struct Pass {
    RefinedMesh *m;
    const Field *field;
    const Refine *memory;
    double cos_limit, cos_kept, dev_limit, dev_kept; /* for fresh marks, and for those of last frame */
    Map edge_at;
    int nedge, capedge;
    int32_t (*ends)[2];     /* [nedge] */
    int32_t (*side)[2];     /* [nedge] the two triangles */
    int32_t *edge_of;       /* [3*ntri] */
    uint8_t *marked;        /* [nedge] */
    int32_t *mid;           /* [nedge] new vertex or NONE */
    Vec3 *tri_normal;       /* [ntri] */
} Pass;

/* --- columns --------------------------------------------------------------------------------------------------------- */

static int add_vert(RefinedMesh *m, Vec3 p, Vec3 n, int32_t id, int a, int b)
{
    if (m->nvert == m->capvert) {
        m->capvert = int_max(1024, 2 * m->capvert);
        RESIZE(m->pos, m->capvert);
        RESIZE(m->normal, m->capvert);
        RESIZE(m->id, m->capvert);
        RESIZE(m->ends, m->capvert);
    }
    m->pos[m->nvert] = p;
    m->normal[m->nvert] = n;
    m->id[m->nvert] = id;
    m->ends[m->nvert][0] = a;
    m->ends[m->nvert][1] = b;
    return m->nvert++;
}

typedef struct Tris {
    int n, cap;
    int32_t *tri, *parent;
} Tris;

static void add_tri(Tris *t, int a, int b, int c, int parent)
{
    if (t->n == t->cap) {
        t->cap = int_max(1024, 2 * t->cap);
        RESIZE(t->tri, 3 * (size_t)t->cap);
        RESIZE(t->parent, t->cap);
    }
    int32_t *q = t->tri + 3 * t->n;
    q[0] = a, q[1] = b, q[2] = c;
    t->parent[t->n++] = parent;
}

static void copy_mechanical(RefinedMesh *m, const Mesh *mech)
{
    m->nvert = 0;
    for (int v = 0; v < mech->nvert; v++) add_vert(m, v_round32(mech->pos[v]), vec3(0, 0, 0), mech->id[v], NONE, NONE);
    Tris t = {.cap = m->captri, .tri = m->tri, .parent = m->parent};
    for (int k = 0; k < mech->ntri; k++) add_tri(&t, mech->corner[3 * k], mech->corner[3 * k + 1], mech->corner[3 * k + 2], k);
    m->ntri = t.n, m->captri = t.cap, m->tri = t.tri, m->parent = t.parent;
}

/* --- normals in parallel ----------------------------------------------------------------------------------------------- */

typedef struct NormalJob {
    const Field *field;
    const RefinedMesh *m;
    int first;     /* vertices from here on */
    Vec3 *out;
} NormalJob;

static void vertex_normals(void *ctx, int begin, int end)
{
    NormalJob *job = ctx;
    field_normals(job->field, end - begin, job->m->pos + job->first + begin, job->out + job->first + begin);
}

static void centroid_normals(void *ctx, int begin, int end)
{
    NormalJob *job = ctx;
    const RefinedMesh *m = job->m;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->tri + 3 * t;
        Vec3 p = v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
        field_normals(job->field, 1, &p, job->out + t);
    }
}

/* --- marking ----------------------------------------------------------------------------------------------------------- */

static void find_edges(Pass *p)
{
    RefinedMesh *m = p->m;
    map_init(&p->edge_at, 2 * m->ntri);
    p->edge_of = NEW(int32_t, 3 * (size_t)m->ntri);
    for (int h = 0; h < 3 * m->ntri; h++) {
        int a = m->tri[h], b = m->tri[h % 3 == 2 ? h - 2 : h + 1];
        int e = map_put(&p->edge_at, key_pair(int_min(a, b), int_max(a, b)), p->nedge);
        p->edge_of[h] = e;
        if (e < p->nedge) {
            p->side[e][1] = h / 3;
            continue;
        }
        if (p->nedge == p->capedge) {
            p->capedge = int_max(1024, 2 * p->capedge);
            RESIZE(p->ends, p->capedge);
            RESIZE(p->side, p->capedge);
        }
        p->ends[e][0] = int_min(a, b);
        p->ends[e][1] = int_max(a, b);
        p->side[e][0] = p->side[e][1] = h / 3;
        p->nedge++;
    }
    p->marked = NEW0(uint8_t, p->nedge);
    p->mid = NEW(int32_t, p->nedge);
}

static uint64_t key_of_edge(const RefinedMesh *m, int a, int b) { return key_pair(int_min(m->id[a], m->id[b]), int_max(m->id[a], m->id[b])); }

enum { MARK_SELF = 1, MARK_OTHERS = 2 };

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    const RefinedMesh *m = p->m;
    const double voxel = p->field->voxel, shortest2 = EDGE_SHORTEST_VOX * EDGE_SHORTEST_VOX * voxel * voxel;
    for (int e = begin; e < end; e++) {
        int a = p->ends[e][0], b = p->ends[e][1];
        bool kept = map_get(&p->memory->marked, key_of_edge(m, a, b)) != NONE;
        double cos_limit = kept ? p->cos_kept : p->cos_limit, dev = (kept ? p->dev_kept : p->dev_limit) * voxel;
        if (v_dot(p->tri_normal[p->side[e][0]], p->tri_normal[p->side[e][1]]) < cos_limit) p->marked[e] |= MARK_OTHERS;
        if (v_len2(v_sub(m->pos[a], m->pos[b])) < shortest2) continue;
        if (v_dot(m->normal[a], m->normal[b]) < cos_limit) p->marked[e] |= MARK_SELF;
        else if (dev > 0) {
            double F;
            Vec3 mid = v_mid(m->pos[a], m->pos[b]), g;
            field_sample(p->field, 1, &mid, &F, &g);
            if (F * F > dev * dev * v_len2(g)) p->marked[e] |= MARK_SELF;
        }
    }
}

/* GI'07 figure 7b: where two neighbours' normals differ, the other edges of both are to be cut. */
static int settle_marks(Pass *p)
{
    const RefinedMesh *m = p->m;
    const double shortest = EDGE_SHORTEST_VOX * p->field->voxel;
    uint8_t *cut = NEW0(uint8_t, p->nedge);
    int n = 0;
    for (int e = 0; e < p->nedge; e++) {
        if (p->marked[e] & MARK_SELF) cut[e] = 1;
        if (!(p->marked[e] & MARK_OTHERS)) continue;
        for (int s = 0; s < 2; s++)
            for (int k = 0; k < 3; k++) {
                int o = p->edge_of[3 * p->side[e][s] + k];
                if (o != e && v_dist(m->pos[p->ends[o][0]], m->pos[p->ends[o][1]]) >= shortest) cut[o] = 1;
            }
    }
    for (int e = 0; e < p->nedge; e++) n += p->marked[e] = cut[e];
    mem_free(cut);
    return n;
}

/* --- cutting ----------------------------------------------------------------------------------------------------------- */

static void add_midpoints(Pass *p, Map *marked_now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    for (int e = 0; e < p->nedge; e++) {
        p->mid[e] = NONE;
        if (!p->marked[e]) continue;
        int a = p->ends[e][0], b = p->ends[e][1];
        uint64_t key = key_of_edge(m, a, b);
        int32_t id = map_get(&p->memory->marked, key);
        if (id == NONE) id = (*next_id)++;
        map_put(marked_now, key, id);
        p->mid[e] = add_vert(m, v_mid(m->pos[a], m->pos[b]), v_unit(v_add(m->normal[a], m->normal[b])), id, a, b);
    }
}

typedef struct LandJob {
    const Field *field;
    RefinedMesh *m;
    int first;
    uint8_t *flat; /* [nvert - first] stays on its edge */
} LandJob;

static void land_block(void *ctx, int begin, int end)
{
    LandJob *job = ctx;
    RefinedMesh *m = job->m;
    for (int i = begin; i < end; i++) {
        int v = job->first + i;
        Vec3 p = m->pos[v], n;
        double reach = LAND_REACH * v_dist(m->pos[m->ends[v][0]], m->pos[m->ends[v][1]]);
        job->flat[i] = field_project(job->field, 1, &p, reach, NULL) != 0;
        if (!job->flat[i]) {
            p = v_round32(p);
            field_normals(job->field, 1, &p, &n);
            job->flat[i] = v_dot(n, m->normal[v]) <= 0; /* another sheet */
        }
        if (job->flat[i]) m->pos[v] = v_round32(m->pos[v]);
        else m->pos[v] = p, m->normal[v] = n;
    }
}

/* Of the quad's two diagonals the one between the more alike normals lies along the lesser curvature. */
static bool is_flatter(const RefinedMesh *m, int a, int b, int c, int d)
{
    return v_dot(m->normal[a], m->normal[b]) >= v_dot(m->normal[c], m->normal[d]);
}

static void cut_triangle(const Pass *p, int t, Tris *out)
{
    const RefinedMesh *m = p->m;
    int v[3], w[3], n = 0, parent = m->parent[t];
    for (int k = 0; k < 3; k++) {
        v[k] = m->tri[3 * t + k];
        w[k] = p->mid[p->edge_of[3 * t + k]]; /* on the edge v[k] -> v[k+1] */
        n += w[k] != NONE;
    }
    int k = 0; /* turn the triangle: one mark on edge 0; or the unmarked edge is edge 2 */
    while (n == 1 && w[k] == NONE) k++;
    while (n == 2 && w[(k + 2) % 3] != NONE) k++;
    int a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3], ab = w[k], bc = w[(k + 1) % 3], ca = w[(k + 2) % 3];
    if (n == 0) {
        add_tri(out, a, b, c, parent);
    } else if (n == 1) {
        add_tri(out, a, ab, c, parent);
        add_tri(out, ab, b, c, parent);
    } else if (n == 2) {
        add_tri(out, ab, b, bc, parent);
        if (is_flatter(m, a, bc, ab, c)) {
            add_tri(out, a, ab, bc, parent);
            add_tri(out, a, bc, c, parent);
        } else {
            add_tri(out, a, ab, c, parent);
            add_tri(out, ab, bc, c, parent);
        }
    } else {
        add_tri(out, a, ab, ca, parent);
        add_tri(out, ab, b, bc, parent);
        add_tri(out, ca, bc, c, parent);
        add_tri(out, ab, bc, ca, parent);
    }
}

/* --- sending midpoints back ------------------------------------------------------------------------------------------------ */

static bool is_bad(const RefinedMesh *m, const Field *f, const int32_t *c)
{
    Vec3 a = v_area2(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
    double area2 = v_len(a);
    if (!(area2 > 0)) return true;
    Vec3 n = v_add(v_add(m->normal[c[0]], m->normal[c[1]]), m->normal[c[2]]);
    if (v_dot(a, n) >= 3 * FACING_MIN * area2) return false;
    return v_dot(a, n) < 0 || field_triangle_inverted(f, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
}

typedef struct BadJob {
    const RefinedMesh *m;
    const Field *field;
    const int32_t *tri;
    uint8_t *bad;
} BadJob;

static void bad_block(void *ctx, int begin, int end)
{
    BadJob *job = ctx;
    for (int t = begin; t < end; t++) job->bad[t] = is_bad(job->m, job->field, job->tri + 3 * t);
}

static bool send_back(RefinedMesh *m, int v)
{
    if (m->ends[v][0] == NONE) return false;
    Vec3 p = v_round32(v_mid(m->pos[m->ends[v][0]], m->pos[m->ends[v][1]]));
    if (v_len2(v_sub(p, m->pos[v])) == 0) return false;
    m->pos[v] = p;
    m->normal[v] = v_unit(v_add(m->normal[m->ends[v][0]], m->normal[m->ends[v][1]]));
    return true;
}

/* Midpoints of bad triangles go back to their edges, in the order of their making, so that a midpoint's ends have
 * settled before it. Triangles of flat midpoints are as good as the one they were cut from. */
static int mend_triangles(RefinedMesh *m, const Field *field, const Tris *t)
{
    int sent = 0;
    uint8_t *bad = NEW(uint8_t, t->n), *back = NEW(uint8_t, m->nvert);
    for (int round = 0; round < SEND_BACK_ROUNDS; round++) {
        parallel_for(t->n, GRAIN, bad_block, &(BadJob){m, field, t->tri, bad});
        memset(back, 0, (size_t)m->nvert);
        for (int k = 0; k < t->n; k++)
            if (bad[k]) back[t->tri[3 * k]] = back[t->tri[3 * k + 1]] = back[t->tri[3 * k + 2]] = 1;
        int changed = 0;
        for (int v = 0; v < m->nvert; v++) changed += back[v] && send_back(m, v);
        if (!changed) break;
        sent += changed;
    }
    mem_free(bad);
    mem_free(back);
    return sent;
}

/* --- passes ------------------------------------------------------------------------------------------------------------------ */

static void pass_free(Pass *p)
{
    map_free(&p->edge_at);
    mem_free(p->ends);
    mem_free(p->side);
    mem_free(p->edge_of);
    mem_free(p->marked);
    mem_free(p->mid);
    mem_free(p->tri_normal);
}

/* Returns whether anything was cut. */
static bool run_pass(Pass *p, Map *marked_now, int32_t *next_id, RefineStat *stat)
{
    RefinedMesh *m = p->m;
    find_edges(p);
    p->tri_normal = NEW(Vec3, m->ntri);
    parallel_for(m->ntri, GRAIN, centroid_normals, &(NormalJob){p->field, m, 0, p->tri_normal});
    parallel_for(p->nedge, GRAIN, mark_block, p);
    if (settle_marks(p) == 0) return false;
    int first = m->nvert;
    add_midpoints(p, marked_now, next_id);
    int n = m->nvert - first;
    uint8_t *flat = NEW(uint8_t, n);
    parallel_for(n, GRAIN, land_block, &(LandJob){p->field, m, first, flat});
    for (int i = 0; i < n; i++) stat->lost += flat[i];
    mem_free(flat);
    Tris out = {0};
    for (int t = 0; t < m->ntri; t++) cut_triangle(p, t, &out);
    stat->lost += mend_triangles(m, p->field, &out);
    mem_free(m->tri);
    mem_free(m->parent);
    m->ntri = out.n, m->captri = out.cap, m->tri = out.tri, m->parent = out.parent;
    return true;
}

static void measure(Pass *p, RefineStat *stat)
{
    const RefinedMesh *m = p->m;
    double sum = 0;
    for (int e = 0; e < p->nedge; e++) {
        double F;
        Vec3 mid = v_mid(m->pos[p->ends[e][0]], m->pos[p->ends[e][1]]), g;
        field_sample(p->field, 1, &mid, &F, &g);
        double l = v_len(g), d = l > 0 ? fabs(F) / l / p->field->voxel : 0;
        sum += d;
        stat->max_vox = real_max(stat->max_vox, d);
    }
    if (p->nedge) stat->mean_vox = sum / p->nedge;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->tri + 3 * t;
        stat->inverted += field_triangle_inverted(p->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
    }
}

RefineStat refine_build(Refine *memory, const Mesh *mech, const Field *field, const RefineSettings *set, int32_t *next_id, RefinedMesh *out)
{
    ASSERT(mech->deadvert == 0 && mech->deadtri == 0);
    const double degree = 0.017453292519943295;
    bool off = set->angle_deg >= 180;
    RefineStat stat = {0};
    copy_mechanical(out, mech);
    parallel_for(out->nvert, GRAIN, vertex_normals, &(NormalJob){field, out, 0, out->normal});
    Map now;
    map_init(&now, memory->marked.count);
    Pass shape = {.m = out, .field = field, .memory = memory, .dev_limit = set->deviation_vox, .dev_kept = HYSTERESIS * set->deviation_vox};
    shape.cos_limit = cos(set->angle_deg * degree);
    shape.cos_kept = cos(HYSTERESIS * set->angle_deg * degree);
    bool more = true;
    for (int k = 0; k < set->passes && !off && more; k++) {
        Pass p = shape;
        more = run_pass(&p, &now, next_id, &stat);
        pass_free(&p);
    }
    Pass last = shape;
    find_edges(&last);
    measure(&last, &stat);
    pass_free(&last);
    map_free(&memory->marked);
    memory->marked = now;
    return stat;
}

void refine_free(Refine *memory) { map_free(&memory->marked); }

void refined_free(RefinedMesh *m)
{
    mem_free(m->pos);
    mem_free(m->normal);
    mem_free(m->id);
    mem_free(m->ends);
    mem_free(m->tri);
    mem_free(m->parent);
    *m = (RefinedMesh){0};
}
