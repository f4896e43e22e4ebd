#include "refine/refine.h"

#include "base/thread.h"

#include <string.h>

/* --- limits -------------------------------------------------------------------------------------------------------- */

#define HYSTERESIS 0.7        /* a marked edge stays marked above this share of a limit */
#define ANGLE_SHORTEST_VOX 0.9 /* edges below this are not cut for their normals' sake: the samples hold no finer detail, */
#define DEVIATION_SHORTEST_VOX 0.4 /* nor below this for the distance's */
#define LAND_REACH 1.0        /* a midpoint lands at most this far away, in lengths of its edge */
#define FACING_MIN 0.1        /* mean cosine of a piece's normal to the surface's; a triangle is not cut into less */
#define QUALITY_MIN 0.03      /* |2 area| / (sum of squared edges) of a piece; 0.29 is equilateral */
#define ENDS_APART 0.2        /* a midpoint lands no nearer to its edge's ends than this share of the edge */

enum { GRAIN = 1024 };

/* One pass's view of the mesh: its edges. */
typedef struct Pass {
    RefinedMesh *m;
    const Field *field;
    const Refine *memory;
    const Homes *homes;
    double cos_limit, cos_kept, dev_limit, dev_kept; /* for fresh marks, and for those of last frame */
    int number;             /* of the pass, from 0 */
    int nedge;
    int32_t (*ends)[2];     /* [nedge] */
    int32_t (*side)[2];     /* [nedge] the two triangles */
    int32_t *edge_of;       /* [3*ntri] */
    uint8_t *marked;        /* [nedge] */
    Vec3 *mid_pos, *mid_normal; /* [nedge] where a marked edge's midpoint lands */
    int32_t *mid;           /* [nedge] new vertex or NONE */
    Vec3 *tri_normal;       /* [ntri] */
    uint8_t *state;         /* [ntri] TRI_... */
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

/* Edges numbered by their lower vertex, then by first appearance: half-edges go into buckets by lower vertex, where an
 * edge's second half finds its first. */
static void find_edges(Pass *p)
{
    RefinedMesh *m = p->m;
    int nhalf = 3 * m->ntri;
    int32_t *start = NEW0(int32_t, m->nvert + 2), *bucket = NEW(int32_t, nhalf);
    for (int h = 0; h < nhalf; h++) start[int_min(m->tri[h], m->tri[h % 3 == 2 ? h - 2 : h + 1]) + 2]++;
    for (int v = 0; v < m->nvert; v++) start[v + 2] += start[v + 1];
    for (int h = 0; h < nhalf; h++) bucket[start[int_min(m->tri[h], m->tri[h % 3 == 2 ? h - 2 : h + 1]) + 1]++] = h;
    p->edge_of = NEW(int32_t, nhalf);
    p->ends = mem_alloc((size_t)nhalf / 2, sizeof *p->ends);
    p->side = mem_alloc((size_t)nhalf / 2, sizeof *p->side);
    for (int v = 0; v < m->nvert; v++) {
        int first = p->nedge;
        for (int i = start[v]; i < start[v + 1]; i++) {
            int h = bucket[i], a = m->tri[h], b = m->tri[h % 3 == 2 ? h - 2 : h + 1], top = int_max(a, b), e = first;
            while (e < p->nedge && p->ends[e][1] != top) e++;
            p->edge_of[h] = e;
            p->side[e][e < p->nedge] = h / 3;
            if (e < p->nedge) continue;
            p->ends[e][0] = v;
            p->ends[e][1] = top;
            p->nedge++;
        }
    }
    ASSERT(2 * p->nedge == nhalf);
    mem_free(start);
    mem_free(bucket);
    p->marked = NEW0(uint8_t, p->nedge);
    p->mid_pos = NEW(Vec3, p->nedge);
    p->mid_normal = NEW(Vec3, p->nedge);
    p->mid = NEW(int32_t, p->nedge);
    p->state = NEW0(uint8_t, m->ntri);
}

static uint64_t key_of_edge(const RefinedMesh *m, int a, int b) { return key_pair(int_min(m->id[a], m->id[b]), int_max(m->id[a], m->id[b])); }

/* The angle between the centroids' normals asks for the others; between the two limits it holds what was marked before. */
enum { MARK_SELF = 1, MARK_OTHERS = 2, MARK_OTHERS_KEPT = 4, MARK_KEPT = 8, BATCH = 64 };

/* The midpoints' distance from the surface, to first order, against a limit in world units an edge. */
static void mark_far(Pass *p, int n, const int *edge, const double *limit)
{
    Vec3 mid[BATCH], g[BATCH];
    double F[BATCH];
    for (int i = 0; i < n; i++) mid[i] = v_mid(p->m->pos[p->ends[edge[i]][0]], p->m->pos[p->ends[edge[i]][1]]);
    field_sample(p->field, n, mid, F, g);
    for (int i = 0; i < n; i++)
        if (F[i] * F[i] > limit[i] * limit[i] * v_len2(g[i])) p->marked[edge[i]] |= MARK_SELF;
}

static void mark_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    const RefinedMesh *m = p->m;
    const double voxel = p->field->voxel;
    int n = 0, edge[BATCH];
    double limit[BATCH];
    for (int e = begin; e < end; e++) {
        int a = p->ends[e][0], b = p->ends[e][1];
        int was = map_get(&p->memory->pass, key_of_edge(m, a, b));
        bool kept = was != NONE && was <= p->number; /* a mark comes back no earlier than it came: passes would differ */
        double cos_limit = kept ? p->cos_kept : p->cos_limit, dev = (kept ? p->dev_kept : p->dev_limit) * voxel;
        double length = v_dist(m->pos[a], m->pos[b]) / voxel;
        double bend = v_dot(p->tri_normal[p->side[e][0]], p->tri_normal[p->side[e][1]]);
        if (kept) p->marked[e] |= MARK_KEPT;
        if (bend < p->cos_kept) p->marked[e] |= bend < p->cos_limit ? MARK_OTHERS : MARK_OTHERS_KEPT;
        if (length >= ANGLE_SHORTEST_VOX && v_dot(m->normal[a], m->normal[b]) < cos_limit) p->marked[e] |= MARK_SELF;
        else if (length >= DEVIATION_SHORTEST_VOX && dev > 0) edge[n] = e, limit[n++] = dev;
        if (n < BATCH && e + 1 < end) continue;
        mark_far(p, n, edge, limit);
        n = 0;
    }
}

/* GI'07 figure 7b: where two neighbours' normals differ, the other edges of both are to be cut. */
static int settle_marks(Pass *p)
{
    const RefinedMesh *m = p->m;
    const double shortest = ANGLE_SHORTEST_VOX * p->field->voxel;
    uint8_t *cut = NEW0(uint8_t, p->nedge);
    int n = 0;
    for (int e = 0; e < p->nedge; e++) {
        if (p->marked[e] & MARK_SELF) cut[e] = 1;
        if (!(p->marked[e] & (MARK_OTHERS | MARK_OTHERS_KEPT))) continue;
        for (int s = 0; s < 2; s++)
            for (int k = 0; k < 3; k++) {
                int o = p->edge_of[3 * p->side[e][s] + k];
                if (!(p->marked[e] & MARK_OTHERS) && !(p->marked[o] & MARK_KEPT)) continue;
                if (o != e && v_dist(m->pos[p->ends[o][0]], m->pos[p->ends[o][1]]) >= shortest) cut[o] = 1;
            }
    }
    for (int e = 0; e < p->nedge; e++) n += p->marked[e] = cut[e];
    mem_free(cut);
    return n;
}

/* --- landing the midpoints ----------------------------------------------------------------------------------------------- */

/* Is q on the component that vertex v belongs to? */
static bool is_home(const Pass *p, int v, Vec3 q)
{
    if (!p->homes) return true;
    while (p->m->ends[v][0] != NONE) v = p->m->ends[v][0];
    int32_t home = p->homes->of[v];
    return home == NONE || p->homes->is_home(p->homes->ctx, home, q);
}

/* Is q a fit place for the midpoint of edge e? */
static bool accept_landing(Pass *p, int e, Vec3 q)
{
    const RefinedMesh *m = p->m;
    int a = p->ends[e][0], b = p->ends[e][1];
    double apart = ENDS_APART * v_dist(m->pos[a], m->pos[b]);
    Vec3 n;
    q = v_round32(q);
    if (real_min(v_dist(q, m->pos[a]), v_dist(q, m->pos[b])) < apart) return false;
    field_normals(p->field, 1, &q, &n);
    if (v_dot(n, v_add(m->normal[a], m->normal[b])) <= 0 || !is_home(p, a, q)) return false; /* another sheet */
    p->mid_pos[e] = q;
    p->mid_normal[e] = n;
    return true;
}

/* Newton's landing; where that goes astray, straight along the ends' mean normal. */
static bool land_midpoint(Pass *p, int e)
{
    const RefinedMesh *m = p->m;
    int a = p->ends[e][0], b = p->ends[e][1];
    Vec3 mid = v_mid(m->pos[a], m->pos[b]), q = mid, n = v_unit(v_add(m->normal[a], m->normal[b]));
    double reach = LAND_REACH * v_dist(m->pos[a], m->pos[b]);
    if (field_project(p->field, 1, &q, reach, NULL) == 0 && accept_landing(p, e, q)) return true;
    q = mid;
    bool inside = field_value(p->field, mid, NULL, NULL) > 0;
    return field_cast(p->field, &q, inside ? n : v_scale(n, -1), reach) && accept_landing(p, e, q);
}

/* Marks whose midpoint finds no surface, another component's, or another sheet are taken back. */
static void land_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int e = begin; e < end; e++)
        if (p->marked[e]) p->marked[e] = land_midpoint(p, e);
}

/* --- patterns ------------------------------------------------------------------------------------------------------------ */

enum { TRI_CHECK = 1, TRI_BAD = 2, TRI_OTHER_DIAGONAL = 4 };

/* The triangles that take a triangle's place: corners 0 1 2, midpoints 3 (of 0-1), 4 (of 1-2), 5 (of 2-0). Marks are bits
 * 1, 2, 4 of these edges; two marks leave a choice of diagonal. Returns how many. */
static int pattern(int marks, bool other_diagonal, uint8_t out[4][3])
{
    static const uint8_t ONE[2][3] = {{0, 3, 2}, {3, 1, 2}};
    static const uint8_t TWO[2][3][3] = {{{3, 1, 4}, {0, 3, 4}, {0, 4, 2}}, {{3, 1, 4}, {0, 3, 2}, {3, 4, 2}}};
    static const uint8_t ALL[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    static const uint8_t TURN[8] = {0, 0, 1, 0, 2, 2, 1, 0}; /* turns that bring the marks to edge 0, or to edges 0 and 1 */
    int n = marks == 0 ? 1 : marks == 7 ? 4 : marks == 1 || marks == 2 || marks == 4 ? 2 : 3, turn = TURN[marks];
    if (n == 1) {
        out[0][0] = 0, out[0][1] = 1, out[0][2] = 2;
        return 1;
    }
    const uint8_t(*from)[3] = n == 2 ? ONE : n == 3 ? TWO[other_diagonal] : ALL;
    for (int t = 0; t < n; t++)
        for (int k = 0; k < 3; k++) out[t][k] = (uint8_t)(from[t][k] < 3 ? (from[t][k] + turn) % 3 : 3 + (from[t][k] - 3 + turn) % 3);
    return n;
}

static int marks_of(const Pass *p, int t)
{
    int marks = 0;
    for (int k = 0; k < 3; k++) marks |= (p->marked[p->edge_of[3 * t + k]] != 0) << k;
    return marks;
}

/* Faults of a triangle, as bits: a whole that has one lets its pieces have it too. */
enum { TURNED = 1, NEEDLE = 2, INVERTED = 4 };

static int faults_of(const Field *f, const Vec3 q[3], const Vec3 n[3])
{
    Vec3 a = v_area2(q[0], q[1], q[2]);
    double area2 = v_len(a), sum = v_len2(v_sub(q[1], q[0])) + v_len2(v_sub(q[2], q[1])) + v_len2(v_sub(q[0], q[2]));
    int faults = v_dot(a, v_add(v_add(n[0], n[1]), n[2])) < 3 * FACING_MIN * area2 ? TURNED : 0;
    if (area2 < QUALITY_MIN * sum) faults |= NEEDLE;
    if (!(area2 > 0) || field_triangle_inverted(f, q[0], q[1], q[2])) faults |= INVERTED;
    return faults;
}

/* A triangle's corners and landed midpoints. */
static void six_points(const Pass *p, int t, Vec3 pos[6], Vec3 normal[6])
{
    for (int k = 0; k < 3; k++) {
        int v = p->m->tri[3 * t + k], e = p->edge_of[3 * t + k];
        pos[k] = p->m->pos[v], normal[k] = p->m->normal[v];
        pos[3 + k] = p->mid_pos[e], normal[3 + k] = p->mid_normal[e];
    }
}

static int faults_of_pattern(const Field *f, int marks, bool other, const Vec3 pos[6], const Vec3 normal[6])
{
    uint8_t part[4][3];
    int n = pattern(marks, other, part), faults = 0;
    for (int i = 0; i < n; i++) {
        const uint8_t *c = part[i];
        faults |= faults_of(f, (Vec3[3]){pos[c[0]], pos[c[1]], pos[c[2]]}, (Vec3[3]){normal[c[0]], normal[c[1]], normal[c[2]]});
    }
    return faults;
}

/* Of the two diagonals the one between the more alike normals lies along the lesser curvature (GI'07 section 3). */
static bool prefers_other_diagonal(int marks, const Vec3 normal[6])
{
    int turn = marks == 6 ? 1 : marks == 5 ? 2 : 0; /* diagonals: corner 0 - midpoint 4, midpoint 3 - corner 2 */
    return v_dot(normal[turn], normal[3 + (1 + turn) % 3]) < v_dot(normal[3 + turn], normal[(2 + turn) % 3]);
}

static void check_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        int marks = marks_of(p, t);
        if (!(p->state[t] & TRI_CHECK)) continue;
        p->state[t] = 0;
        if (marks == 0) continue;
        Vec3 pos[6], normal[6];
        six_points(p, t, pos, normal);
        bool other = prefers_other_diagonal(marks, normal), two = marks == 3 || marks == 5 || marks == 6;
        int faults = faults_of_pattern(p->field, marks, other, pos, normal);
        if (faults) {
            int allowed = faults_of(p->field, pos, normal) & ~INVERTED;
            if (two && !(faults_of_pattern(p->field, marks, !other, pos, normal) & ~allowed)) other = !other;
            else if (faults & ~allowed) p->state[t] |= TRI_BAD;
        }
        if (other) p->state[t] |= TRI_OTHER_DIAGONAL;
    }
}

/* Marks that would turn a piece against the surface are taken back, until no piece is worse than its whole. */
static void withdraw_marks(Pass *p)
{
    int n = p->m->ntri;
    for (int t = 0; t < n; t++) p->state[t] = TRI_CHECK;
    for (bool again = true; again;) {
        parallel_for(n, GRAIN, check_block, p);
        again = false;
        for (int t = 0; t < n; t++) {
            if (!(p->state[t] & TRI_BAD)) continue;
            for (int k = 0; k < 3; k++) {
                int e = p->edge_of[3 * t + k];
                if (!p->marked[e]) continue;
                p->marked[e] = 0;
                again = true;
                p->state[p->side[e][0]] |= TRI_CHECK;
                p->state[p->side[e][1]] |= TRI_CHECK;
            }
        }
    }
}

/* --- cutting ---------------------------------------------------------------------------------------------------------------- */

static int add_midpoints(Pass *p, Refine *now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    int first = m->nvert;
    for (int e = 0; e < p->nedge; e++) {
        p->mid[e] = NONE;
        if (!p->marked[e]) continue;
        int a = p->ends[e][0], b = p->ends[e][1];
        uint64_t key = key_of_edge(m, a, b);
        int32_t id = map_get(&p->memory->marked, key);
        if (id == NONE) id = (*next_id)++;
        map_put(&now->marked, key, id);
        map_put(&now->pass, key, p->number);
        p->mid[e] = add_vert(m, p->mid_pos[e], p->mid_normal[e], id, a, b);
    }
    return m->nvert - first;
}

static void cut_triangles(Pass *p)
{
    RefinedMesh *m = p->m;
    Tris out = {0};
    for (int t = 0; t < m->ntri; t++) {
        uint8_t part[4][3];
        int32_t v[6];
        for (int k = 0; k < 3; k++) {
            v[k] = m->tri[3 * t + k];
            v[3 + k] = p->mid[p->edge_of[3 * t + k]];
        }
        int n = pattern(marks_of(p, t), (p->state[t] & TRI_OTHER_DIAGONAL) != 0, part);
        for (int i = 0; i < n; i++) add_tri(&out, v[part[i][0]], v[part[i][1]], v[part[i][2]], m->parent[t]);
    }
    mem_free(m->tri);
    mem_free(m->parent);
    m->ntri = out.n, m->captri = out.cap, m->tri = out.tri, m->parent = out.parent;
}

/* --- passes ------------------------------------------------------------------------------------------------------------------ */

static void pass_free(Pass *p)
{
    mem_free(p->ends);
    mem_free(p->side);
    mem_free(p->edge_of);
    mem_free(p->marked);
    mem_free(p->mid_pos);
    mem_free(p->mid_normal);
    mem_free(p->mid);
    mem_free(p->tri_normal);
    mem_free(p->state);
}

/* Returns whether anything was cut. */
static bool run_pass(Pass *p, Refine *now, int32_t *next_id, RefineStat *stat)
{
    RefinedMesh *m = p->m;
    find_edges(p);
    p->tri_normal = NEW(Vec3, m->ntri);
    parallel_for(m->ntri, GRAIN, centroid_normals, &(NormalJob){p->field, m, 0, p->tri_normal});
    parallel_for(p->nedge, GRAIN, mark_block, p);
    int wanted = settle_marks(p);
    if (wanted == 0) return false;
    parallel_for(p->nedge, GRAIN, land_block, p);
    withdraw_marks(p);
    int added = add_midpoints(p, now, next_id);
    stat->lost += wanted - added;
    cut_triangles(p);
    return added > 0;
}

/* --- figures ------------------------------------------------------------------------------------------------------------------ */

typedef struct MeasureJob {
    const Pass *p;
    double *sum, *max; /* a block */
    int *inverted;     /* a block */
} MeasureJob;

static void measure_edges(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    const Pass *p = job->p;
    double sum = 0, max = 0;
    for (int from = begin; from < end; from += BATCH) {
        Vec3 mid[BATCH], g[BATCH];
        double F[BATCH];
        int n = int_min(BATCH, end - from);
        for (int i = 0; i < n; i++) mid[i] = v_mid(p->m->pos[p->ends[from + i][0]], p->m->pos[p->ends[from + i][1]]);
        field_sample(p->field, n, mid, F, g);
        for (int i = 0; i < n; i++) {
            double l = v_len(g[i]), d = l > 0 ? fabs(F[i]) / l / p->field->voxel : 0;
            sum += d;
            max = real_max(max, d);
        }
    }
    job->sum[begin / GRAIN] = sum;
    job->max[begin / GRAIN] = max;
}

static void measure_tris(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    const RefinedMesh *m = job->p->m;
    int n = 0;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->tri + 3 * t;
        n += field_triangle_inverted(job->p->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
    }
    job->inverted[begin / GRAIN] = n;
}

static void measure(const Pass *p, RefineStat *stat)
{
    int edge_blocks = (p->nedge + GRAIN - 1) / GRAIN, tri_blocks = (p->m->ntri + GRAIN - 1) / GRAIN;
    MeasureJob job = {p, NEW(double, edge_blocks), NEW(double, edge_blocks), NEW(int, tri_blocks)};
    parallel_for(p->nedge, GRAIN, measure_edges, &job);
    parallel_for(p->m->ntri, GRAIN, measure_tris, &job);
    double sum = 0;
    for (int b = 0; b < edge_blocks; b++) {
        sum += job.sum[b];
        stat->max_vox = real_max(stat->max_vox, job.max[b]);
    }
    for (int b = 0; b < tri_blocks; b++) stat->inverted += job.inverted[b];
    if (p->nedge) stat->mean_vox = sum / p->nedge;
    mem_free(job.sum);
    mem_free(job.max);
    mem_free(job.inverted);
}

RefineStat refine_build(Refine *memory, const Mesh *mech, const Field *field, const RefineSettings *set,
                        const Homes *homes, int32_t *next_id, RefinedMesh *out)
{
    ASSERT(mech->deadvert == 0 && mech->deadtri == 0);
    const double degree = 0.017453292519943295;
    bool off = set->angle_deg >= 180;
    RefineStat stat = {0};
    copy_mechanical(out, mech);
    parallel_for(out->nvert, GRAIN, vertex_normals, &(NormalJob){field, out, 0, out->normal});
    Refine now;
    map_init(&now.marked, memory->marked.count);
    map_init(&now.pass, memory->marked.count);
    Pass shape = {.m = out, .field = field, .memory = memory, .homes = homes, .dev_limit = set->deviation_vox, .dev_kept = HYSTERESIS * set->deviation_vox};
    shape.cos_limit = cos(set->angle_deg * degree);
    shape.cos_kept = cos(HYSTERESIS * set->angle_deg * degree);
    bool more = true;
    for (int k = 0; k < set->passes && !off && more; k++) {
        Pass p = shape;
        p.number = k;
        more = run_pass(&p, &now, next_id, &stat);
        pass_free(&p);
    }
    Pass last = shape;
    find_edges(&last);
    measure(&last, &stat);
    pass_free(&last);
    refine_free(memory);
    *memory = now;
    return stat;
}

void refine_free(Refine *memory)
{
    map_free(&memory->marked);
    map_free(&memory->pass);
}

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
