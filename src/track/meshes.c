/* meshes.c: the tracked meshes as files take them. */
#include "track/track_priv.h"

#include "base/thread.h"

#include <string.h>

enum { REST_COLUMNS = 4, GRAIN = 1024 };

/* One of the twins, whichever. */
typedef struct Twin {
    int nvert, ntri;
    const Vec3 *pos;
    const Vec3 *normal;
    const int32_t *id, *tri, *parent;
} Twin;

/* What closes the surface lies beyond the active bounding box. */
static bool is_beyond_border(const Field *f, const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    Vec3 p = affine_to_index(&f->xform, v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3));
    for (int a = 0; a < 3; a++)
        if (v_get(p, a) < f->lo[a] || v_get(p, a) > f->hi[a]) return true;
    return false;
}

/* Triangles around a vertex from half-edge h on, until one that is gone. */
static int fan_size(const Mesh *m, int h, const uint8_t *gone)
{
    int n = 0;
    for (; !gone[h / 3]; h = he_around(m, h)) n++;
    return n;
}

/* Where the cut leaves a vertex more than one fan of triangles, only the largest stays. Returns whether it had. */
static bool drop_lesser_fans(const Mesh *m, int v, uint8_t *gone)
{
    int fans = 0, largest = NONE, most = 0, h = m->out[v];
    do {
        int next = he_around(m, h), n = gone[h / 3] ? fan_size(m, next, gone) : 0;
        fans += n > 0;
        if (n > most) largest = next, most = n;
        h = next;
    } while (h != m->out[v]);
    if (fans < 2) return false;
    h = largest;
    for (int k = 0; k < most; k++) h = he_around(m, h);
    for (; h != largest; h = he_around(m, h)) gone[h / 3] = 1;
    return true;
}

/* The mechanical triangles that are left out; to be freed. What remains is a manifold with a border. */
static uint8_t *find_gone(const Track *tr, bool open_border)
{
    const Mesh *m = &tr->mesh;
    uint8_t *gone = NEW0(uint8_t, m->ntri);
    if (!open_border) return gone;
    for (int t = 0; t < m->ntri; t++) gone[t] = is_beyond_border(tr->field, m, t);
    for (bool more = true; more;) {
        more = false;
        for (int v = 0; v < m->nvert; v++) more = drop_lesser_fans(m, v, gone) || more;
    }
    return gone;
}

/* New numbers for the triangles and vertices kept; NONE for the others. */
static void choose_kept(const Twin *w, const uint8_t *gone, int32_t *tri_to, int32_t *vert_to, int count[2])
{
    int nvert = 0, ntri = 0;
    for (int v = 0; v < w->nvert; v++) vert_to[v] = NONE;
    for (int t = 0; t < w->ntri; t++) {
        tri_to[t] = gone[w->parent ? w->parent[t] : t] ? NONE : ntri++;
        for (int k = 0; k < 3 && tri_to[t] != NONE; k++) vert_to[w->tri[3 * t + k]] = 0;
    }
    for (int v = 0; v < w->nvert; v++)
        if (vert_to[v] != NONE) vert_to[v] = nvert++;
    count[0] = nvert;
    count[1] = ntri;
}

typedef struct ColumnJob {
    const Track *tr;
    const Twin *w;
    const int32_t *vert_to;
    TriMesh *out;
} ColumnJob;

static void put3(float *to, Vec3 v)
{
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
}

static void column_block(void *ctx, int begin, int end)
{
    ColumnJob *job = ctx;
    for (int v = begin; v < end; v++) {
        int to = job->vert_to[v];
        if (to == NONE) continue;
        Vec3 n = job->w->normal[v];
        put3(job->out->pos + 3 * to, job->w->pos[v]);
        put3(job->out->normal + 3 * to, n);
        if (job->out->velocity) {
            const Grid *velocity = job->tr->velocity;
            put3(job->out->velocity + 3 * to, velocity ? grid_vector(velocity, job->w->pos[v]) : track_motion(job->tr, job->w->id[v], job->w->pos[v], n));
        }
        job->out->id[to] = job->w->id[v];
    }
}

static void copy_twin(const Track *tr, const Twin *w, const int32_t *tri_to, const int32_t *vert_to, const int count[2], const int32_t *parent_to, TriMesh *out)
{
    trimesh_init(out, count[0], count[1], tr->velocity != NULL || tr->set.own_motion, w->parent != NULL);
    parallel_for(w->nvert, GRAIN, column_block, &(ColumnJob){tr, w, vert_to, out});
    for (int t = 0; t < w->ntri; t++) {
        if (tri_to[t] == NONE) continue;
        for (int k = 0; k < 3; k++) out->tri[3 * tri_to[t] + k] = vert_to[w->tri[3 * t + k]];
        if (w->parent) out->parent[tri_to[t]] = parent_to[w->parent[t]];
    }
}

/* As attributes rest_x, rest_y, rest_z and rest_frame. */
static void add_rest(const RestPlace *at, int nvert, const int32_t *vert_to, TriMesh *out)
{
    static const char *const name[REST_COLUMNS] = {"rest_x", "rest_y", "rest_z", "rest_frame"};
    out->nattr = REST_COLUMNS;
    out->attr = NEW(float *, REST_COLUMNS);
    out->attr_name = NEW(char *, REST_COLUMNS);
    for (int k = 0; k < REST_COLUMNS; k++) {
        out->attr[k] = NEW(float, out->nvert);
        out->attr_name[k] = mem_text(name[k]);
        for (int v = 0; v < nvert; v++)
            if (vert_to[v] != NONE) out->attr[k][vert_to[v]] = k < 3 ? (float)v_get(at[v].pos, k) : (float)at[v].frame;
    }
}

void track_meshes(const Track *tr, bool open_border, TriMesh *mechanical, TriMesh *geometric)
{
    const Mesh *m = &tr->mesh;
    const RefinedMesh *f = &tr->fine;
    Twin mech = {m->nvert, m->ntri, m->pos, f->normal, m->id, m->corner, NULL}; /* its vertices are the first of the other's */
    Twin fine = {f->nvert, f->ntri, f->pos, f->normal, f->id, f->tri, f->parent};
    int32_t *parent_to = NEW(int32_t, m->ntri), *tri_to = NEW(int32_t, f->ntri), *vert_to = NEW(int32_t, int_max(m->nvert, f->nvert));
    int count[2];
    uint8_t *gone = find_gone(tr, open_border);
    choose_kept(&mech, gone, parent_to, vert_to, count);
    if (mechanical) copy_twin(tr, &mech, parent_to, vert_to, count, NULL, mechanical);
    if (mechanical && tr->set.rest) add_rest(tr->rest.at, m->nvert, vert_to, mechanical);
    if (geometric) {
        choose_kept(&fine, gone, tri_to, vert_to, count);
        copy_twin(tr, &fine, tri_to, vert_to, count, parent_to, geometric);
        RestPlace *at = NEW(RestPlace, tr->set.rest ? f->nvert : 0);
        if (tr->set.rest) rest_refined(tr, at);
        if (tr->set.rest) add_rest(at, f->nvert, vert_to, geometric);
        mem_free(at);
    }
    mem_free(gone);
    mem_free(parent_to);
    mem_free(tri_to);
    mem_free(vert_to);
}

typedef struct CarryJob {
    const Track *tr;
    const TriMesh *last;
    const Vec3 *p;
    const uint8_t *lost;
    float *pos, *normal;
} CarryJob;

static void carry_block(void *ctx, int begin, int end)
{
    CarryJob *job = ctx;
    for (int v = begin; v < end; v++) {
        if (job->lost[v]) { /* held where it was */
            memcpy(job->pos + 3 * v, job->last->pos + 3 * v, 3 * sizeof(float));
            memcpy(job->normal + 3 * v, job->last->normal + 3 * v, 3 * sizeof(float));
            continue;
        }
        Vec3 n;
        field_normals(job->tr->field, 1, &job->p[v], &n);
        put3(job->pos + 3 * v, job->p[v]);
        put3(job->normal + 3 * v, n);
    }
}

void track_carry(const Track *tr, const TriMesh *last, float *pos, float *normal)
{
    Vec3 *p = NEW(Vec3, last->nvert);
    uint8_t *lost = NEW0(uint8_t, last->nvert);
    int substeps;
    for (int v = 0; v < last->nvert; v++) p[v] = vec3(last->pos[3 * v], last->pos[3 * v + 1], last->pos[3 * v + 2]);
    if (tr->field->nbrick) track_predict(tr, last->nvert, p, lost, &substeps);
    else memset(lost, 1, (size_t)last->nvert);
    parallel_for(last->nvert, GRAIN, carry_block, &(CarryJob){tr, last, p, lost, pos, normal});
    mem_free(p);
    mem_free(lost);
}
