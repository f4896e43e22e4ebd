/* mesh.c: building, sweeping, components and the invariant's check. */
#include "mesh/mesh_priv.h"

#include "base/thread.h"

#include <stdio.h>
#include <string.h>

enum { GRAIN = 8192 };

void mesh_init(Mesh *m) { *m = (Mesh){0}; }

void mesh_free(Mesh *m)
{
    mem_free(m->pos);
    mem_free(m->id);
    mem_free(m->out);
    mem_free(m->corner);
    mem_free(m->opp);
    mem_free(m->length);
    mem_free(m->flag);
    *m = (Mesh){0};
}

void mesh_clear(Mesh *m) { m->nvert = m->ntri = m->deadvert = m->deadtri = m->nsorted = 0; }

int32_t mesh_fresh_id(Mesh *m)
{
    int32_t id = m->next_id;
    m->next_id += MESH_ID_STEP;
    return id;
}

static void make_vert_room(Mesh *m, int n)
{
    if (n <= m->capvert) return;
    m->capvert = mem_capacity(m->capvert, n);
    RESIZE(m->pos, m->capvert);
    RESIZE(m->id, m->capvert);
    RESIZE(m->out, m->capvert);
}

static void make_tri_room(Mesh *m, int n)
{
    if (n <= m->captri) return;
    m->captri = mem_capacity(m->captri, n);
    RESIZE(m->corner, 3 * (size_t)m->captri);
    RESIZE(m->opp, 3 * (size_t)m->captri);
    RESIZE(m->length, 3 * (size_t)m->captri);
    RESIZE(m->flag, 3 * (size_t)m->captri);
}

static void copy_column(void *to, const void *from, size_t n)
{
    if (n) memcpy(to, from, n); /* a mesh without room has no columns */
}

void mesh_copy(Mesh *to, const Mesh *from)
{
    size_t nvert = (size_t)from->nvert, nhalf = 3 * (size_t)from->ntri;
    make_vert_room(to, from->nvert);
    make_tri_room(to, from->ntri);
    copy_column(to->pos, from->pos, nvert * sizeof *to->pos);
    copy_column(to->id, from->id, nvert * sizeof *to->id);
    copy_column(to->out, from->out, nvert * sizeof *to->out);
    copy_column(to->corner, from->corner, nhalf * sizeof *to->corner);
    copy_column(to->opp, from->opp, nhalf * sizeof *to->opp);
    copy_column(to->length, from->length, nhalf * sizeof *to->length);
    copy_column(to->flag, from->flag, nhalf * sizeof *to->flag);
    to->nvert = from->nvert, to->ntri = from->ntri;
    to->deadvert = from->deadvert, to->deadtri = from->deadtri;
    to->nsorted = from->nsorted;
    to->next_id = from->next_id;
}

int mesh_add_vert(Mesh *m, Vec3 p, int32_t id)
{
    make_vert_room(m, m->nvert + 1);
    m->pos[m->nvert] = p;
    m->id[m->nvert] = id;
    m->out[m->nvert] = NONE;
    return m->nvert++;
}

int mesh_add_tri(Mesh *m, int a, int b, int c)
{
    make_tri_room(m, m->ntri + 1);
    int h = 3 * m->ntri++, v[3] = {a, b, c};
    for (int k = 0; k < 3; k++) {
        m->corner[h + k] = v[k];
        m->opp[h + k] = NONE;
        m->length[h + k] = -1;
        m->flag[h + k] = 0;
    }
    return h / 3;
}

/* to[i]: the place of item i among all n sorted by key; those of the same key keep their order. end[nkey] (may be NULL): where each key's end. */
static void find_places(int n, int nkey, const int32_t *key, int32_t *to, int32_t *end)
{
    int32_t *next = NEW0(int32_t, nkey + 1);
    for (int i = 0; i < n; i++) next[key[i] + 1]++;
    for (int k = 0; k < nkey; k++) next[k + 1] += next[k];
    for (int i = 0; i < n; i++) to[i] = next[key[i]]++;
    if (end) memcpy(end, next, (size_t)nkey * sizeof *end);
    mem_free(next);
}

typedef struct JoinJob {
    Mesh *mesh;
    int n, base;
    const int32_t *half;  /* [n] */
    int32_t *leaving;     /* [n] the same by the vertices they leave, */
    int32_t *end;         /* and where each vertex's end */
} JoinJob;

static void join_block(void *ctx, int begin, int end)
{
    const JoinJob *job = ctx;
    Mesh *m = job->mesh;
    for (int i = begin; i < end; i++) {
        int h = job->half[i], to = he_to(m, h) - job->base, found = 0;
        for (int k = to ? job->end[to - 1] : 0; k < job->end[to]; k++)
            if (he_to(m, job->leaving[k]) == he_from(m, h)) m->opp[h] = job->leaving[k], found++;
        ASSERT(found == 1);
    }
}

/* Joins n half-edges, all of which leave the vertices from `base` on, with one another. */
static void join(Mesh *m, int base, int n, const int32_t *half)
{
    int nvert = m->nvert - base;
    int32_t *from = NEW(int32_t, n), *place = NEW(int32_t, n);
    JoinJob job = {m, n, base, half, NEW(int32_t, n), NEW(int32_t, nvert)};
    for (int i = 0; i < n; i++) from[i] = m->corner[half[i]] - base;
    find_places(n, nvert, from, place, job.end);
    for (int i = 0; i < n; i++) job.leaving[place[i]] = half[i];
    parallel_for(n, GRAIN, join_block, &job);
    mem_free(from);
    mem_free(place);
    mem_free(job.leaving);
    mem_free(job.end);
}

void mesh_append(Mesh *m, int nvert, const Vec3 *pos, const int32_t *id, int ntri, const int32_t *tri)
{
    int base = m->nvert, first = 3 * m->ntri;
    int32_t *half = NEW(int32_t, 3 * ntri);
    make_vert_room(m, base + nvert);
    make_tri_room(m, m->ntri + ntri);
    for (int v = 0; v < nvert; v++) mesh_add_vert(m, pos[v], id ? id[v] : mesh_fresh_id(m));
    for (int t = 0; t < ntri; t++) mesh_add_tri(m, base + tri[3 * t], base + tri[3 * t + 1], base + tri[3 * t + 2]);
    for (int i = 0; i < 3 * ntri; i++) half[i] = first + i, m->out[m->corner[first + i]] = first + i;
    join(m, base, 3 * ntri, half);
    mem_free(half);
}

static void sweep_tris(Mesh *m)
{
    int32_t *to = NEW(int32_t, m->ntri);
    int n = 0;
    for (int t = 0; t < m->ntri; t++) to[t] = tri_is_dead(m, t) ? NONE : n++;
    for (int t = 0; t < m->ntri; t++) {
        if (to[t] == NONE) continue;
        for (int k = 0; k < 3; k++) {
            int h = 3 * t + k, g = 3 * to[t] + k;
            m->corner[g] = m->corner[h];
            m->opp[g] = 3 * to[m->opp[h] / 3] + m->opp[h] % 3;
            m->length[g] = m->length[h];
            m->flag[g] = m->flag[h];
        }
    }
    for (int v = 0; v < m->nvert; v++)
        if (!vert_is_dead(m, v)) m->out[v] = 3 * to[m->out[v] / 3] + m->out[v] % 3;
    m->ntri = n;
    m->deadtri = 0;
    mem_free(to);
}

static void sweep_verts(Mesh *m, int32_t *to)
{
    int n = 0, sorted = m->nsorted;
    for (int v = 0; v < m->nvert; v++) {
        to[v] = vert_is_dead(m, v) ? NONE : n++;
        m->nsorted -= to[v] == NONE && v < sorted;
        if (to[v] == NONE) continue;
        m->pos[to[v]] = m->pos[v];
        m->id[to[v]] = m->id[v];
        m->out[to[v]] = m->out[v];
    }
    for (int h = 0; h < 3 * m->ntri; h++) m->corner[h] = to[m->corner[h]];
    m->nvert = n;
    m->deadvert = 0;
}

void mesh_compact(Mesh *m, int32_t *vert_to)
{
    if (m->deadtri) sweep_tris(m);
    int32_t *to = vert_to ? vert_to : NEW(int32_t, m->nvert);
    if (m->deadvert) sweep_verts(m, to);
    else
        for (int v = 0; v < m->nvert; v++) to[v] = v;
    if (!vert_to) mem_free(to);
}

static int half_to(const int32_t *tri_to, int h) { return 3 * tri_to[h / 3] + h % 3; }

void mesh_sort(Mesh *m, int nkey, const int32_t *key, int32_t *vert_to)
{
    ASSERT(m->deadvert == 0 && m->deadtri == 0);
    Mesh was = *m;
    int32_t *least = NEW(int32_t, m->ntri), *tri_to = NEW(int32_t, m->ntri);
    find_places(m->nvert, nkey, key, vert_to, NULL);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        least[t] = int_min(int_min(vert_to[c[0]], vert_to[c[1]]), vert_to[c[2]]);
    }
    find_places(m->ntri, m->nvert, least, tri_to, NULL);
    *m = (Mesh){.nvert = was.nvert, .ntri = was.ntri, .nsorted = was.nvert, .next_id = was.next_id};
    make_vert_room(m, m->nvert);
    make_tri_room(m, m->ntri);
    for (int v = 0; v < m->nvert; v++) {
        m->pos[vert_to[v]] = was.pos[v];
        m->id[vert_to[v]] = was.id[v];
        m->out[vert_to[v]] = half_to(tri_to, was.out[v]);
    }
    for (int h = 0; h < 3 * m->ntri; h++) {
        int g = half_to(tri_to, h);
        m->corner[g] = vert_to[was.corner[h]];
        m->opp[g] = half_to(tri_to, was.opp[h]);
        m->length[g] = was.length[h];
        m->flag[g] = was.flag[h];
    }
    mesh_free(&was);
    mem_free(least);
    mem_free(tri_to);
}

int mesh_components(const Mesh *m, int32_t *tri_comp, int32_t *vert_comp)
{
    int32_t *comp = tri_comp ? tri_comp : NEW(int32_t, m->ntri), *stack = NEW(int32_t, m->ntri + 1);
    int n = 0;
    for (int t = 0; t < m->ntri; t++) comp[t] = NONE;
    for (int s = 0; s < m->ntri; s++) {
        if (tri_is_dead(m, s) || comp[s] != NONE) continue;
        int depth = 0;
        comp[s] = n;
        stack[depth++] = s;
        while (depth) {
            int t = stack[--depth];
            for (int k = 0; k < 3; k++) { /* without a branch: which of them are new is as good as random */
                int u = m->opp[3 * t + k] / 3;
                stack[depth] = u;
                depth += comp[u] == NONE;
                comp[u] = n;
            }
        }
        n++;
    }
    if (vert_comp)
        for (int v = 0; v < m->nvert; v++) vert_comp[v] = vert_is_dead(m, v) ? NONE : comp[m->out[v] / 3];
    mem_free(stack);
    if (!tri_comp) mem_free(comp);
    return n;
}

void mesh_drop_components(Mesh *m, const int32_t *tri_comp, const uint8_t *drop)
{
    for (int v = 0; v < m->nvert; v++) {
        if (vert_is_dead(m, v) || !drop[tri_comp[m->out[v] / 3]]) continue;
        m->out[v] = NONE;
        m->deadvert++;
    }
    for (int t = 0; t < m->ntri; t++) {
        if (tri_is_dead(m, t) || !drop[tri_comp[t]]) continue;
        for (int k = 0; k < 3; k++) m->corner[3 * t + k] = NONE;
        m->deadtri++;
    }
}

static void kill_triangles(Mesh *m, const uint8_t *drop)
{
    for (int t = 0; t < m->ntri; t++) {
        if (tri_is_dead(m, t) || !drop[t]) continue;
        for (int h = 3 * t; h < 3 * t + 3; h++) {
            if (m->opp[h] != NONE) m->opp[m->opp[h]] = NONE;
            m->out[m->corner[h]] = NONE;
            m->corner[h] = NONE;
        }
        m->deadtri++;
    }
}

/* Joins the half-edges that have no opposite. */
static void close_gaps(Mesh *m)
{
    int32_t *open = NEW(int32_t, 3 * m->ntri);
    int n = 0;
    for (int h = 0; h < 3 * m->ntri; h++)
        if (m->corner[h] != NONE && m->opp[h] == NONE) open[n++] = h;
    join(m, 0, n, open);
    mem_free(open);
}

void mesh_patch(Mesh *m, const uint8_t *drop, int nvert_new, const Vec3 *pos, int ntri, const int32_t *tri)
{
    uint8_t *alive = NEW(uint8_t, m->nvert);
    int before = m->nvert;
    for (int v = 0; v < before; v++) alive[v] = !vert_is_dead(m, v);
    kill_triangles(m, drop);
    for (int v = 0; v < nvert_new; v++) mesh_add_vert(m, pos[v], mesh_fresh_id(m));
    for (int t = 0; t < ntri; t++) mesh_add_tri(m, tri[3 * t], tri[3 * t + 1], tri[3 * t + 2]);
    close_gaps(m);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (m->corner[h] != NONE) m->out[m->corner[h]] = h;
    for (int v = 0; v < before; v++) m->deadvert += alive[v] && vert_is_dead(m, v);
    mem_free(alive);
}

int mesh_valence(const Mesh *m, int v)
{
    int n = 0, h = m->out[v];
    do n++;
    while ((h = he_around(m, h)) != m->out[v]);
    return n;
}

Vec3 mesh_tri_area2(const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    return v_area2(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
}

Vec3 mesh_ring_mean(const Mesh *m, int v)
{
    Vec3 sum = vec3(0, 0, 0);
    int n = 0, h = m->out[v];
    do sum = v_add(sum, m->pos[he_to(m, h)]), n++;
    while ((h = he_around(m, h)) != m->out[v]);
    return v_scale(sum, 1.0 / n);
}

/* --- the invariant ----------------------------------------------------------------------------------------- */

static _Thread_local char complaint[160];

static const char *complain(const char *what, int i)
{
    snprintf(complaint, sizeof complaint, "%s (%d)", what, i);
    return complaint;
}

const char *mesh_check(const Mesh *m)
{
    int live = 0, reached = 0;
    for (int t = 0; t < m->ntri; t++) {
        if (tri_is_dead(m, t)) continue;
        for (int k = 0; k < 3; k++) {
            int h = 3 * t + k, g = m->opp[h];
            if (m->corner[h] < 0 || m->corner[h] >= m->nvert) return complain("corner out of range at half-edge", h);
            if (vert_is_dead(m, m->corner[h])) return complain("dead vertex used at half-edge", h);
            if (m->corner[h] == m->corner[3 * t + (k + 1) % 3]) return complain("repeated vertex in triangle", t);
            if (g < 0 || g >= 3 * m->ntri || tri_is_dead(m, g / 3)) return complain("no opposite of half-edge", h);
            if (m->opp[g] != h) return complain("opp is no involution at half-edge", h);
            if (he_from(m, g) != he_to(m, h) || he_to(m, g) != he_from(m, h)) return complain("opposite half-edges differ at", h);
            live++;
        }
    }
    for (int v = 0; v < m->nvert; v++) {
        if (vert_is_dead(m, v)) continue;
        int h = m->out[v], n = 0;
        if (h < 0 || h >= 3 * m->ntri || m->corner[h] != v) return complain("out does not leave vertex", v);
        do {
            if (m->corner[h] != v || n++ > 3 * m->ntri) return complain("broken umbrella at vertex", v);
            h = he_around(m, h);
        } while (h != m->out[v]);
        if (n < 3) return complain("valence below three at vertex", v);
        reached += n;
    }
    return reached == live ? NULL : complain("a vertex has more than one umbrella; half-edges not reached", live - reached);
}

/* --- kept between two runs -------------------------------------------------------------------------------- */

static bool is_sound(const Mesh *m)
{
    for (int v = 0; v < m->nvert; v++) {
        Vec3 p = m->pos[v];
        if (vert_is_dead(m, v) || !isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z)) return false;
        if (m->id[v] < 0 || m->id[v] >= m->next_id) return false;
    }
    for (int h = 0; h < 3 * m->ntri; h++)
        if (m->corner[h] == NONE) return false;
    return !mesh_check(m);
}

void mesh_store(Mesh *m, Store *s)
{
    ASSERT(s->reading || (m->deadvert == 0 && m->deadtri == 0));
    STORE(s, m->next_id);
    STORE(s, m->nvert);
    STORE(s, m->ntri);
    STORE(s, m->nsorted);
    STORE_ARRAY(s, m->pos, m->nvert);
    STORE_ARRAY(s, m->id, m->nvert);
    STORE_ARRAY(s, m->out, m->nvert);
    STORE_ARRAY(s, m->corner, 3 * (int64_t)m->ntri);
    STORE_ARRAY(s, m->opp, 3 * (int64_t)m->ntri);
    STORE_ARRAY(s, m->length, 3 * (int64_t)m->ntri);
    STORE_ARRAY(s, m->flag, 3 * (int64_t)m->ntri);
    if (!s->reading) return;
    m->capvert = m->nvert;
    m->captri = m->ntri;
    store_expect(s, !s->bad && m->next_id >= 0 && m->nsorted >= 0 && m->nsorted <= m->nvert && is_sound(m));
    if (s->bad) mesh_free(m);
}
