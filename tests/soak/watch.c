#include "watch.h"

#include "topology/audit.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const MESH_NAME[2] = {"mechanical", "geometric"};

/* Always false. */
static bool wrong(Watch *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static bool wrong(Watch *w, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(w->wrong, sizeof w->wrong, format, args);
    va_end(args);
    return false;
}

void watch_open(Watch *w, const TrackSettings *set) { *w = (Watch){.tr = track_open(set), .hash = 14695981039346656037u}; }

void watch_close(Watch *w)
{
    track_close(w->tr);
    for (int i = 0; i < 2; i++) {
        field_free(&w->field[i]);
        grid_free(&w->velocity[i]);
        mem_free(w->seen[i].frame);
        trimesh_free(&w->mesh[i]);
    }
    *w = (Watch){0};
}

/* --- closed and manifold ------------------------------------------------------------------------------------------------- */

static bool check_indices(Watch *w, int i)
{
    const TriMesh *m = &w->mesh[i];
    uint8_t *used = NEW0(uint8_t, m->nvert);
    bool good = true;
    for (int h = 0; h < 3 * m->ntri && good; h++) {
        int v = m->tri[h];
        if (v < 0 || v >= m->nvert) good = wrong(w, "%s triangle %d: vertex %d of %d", MESH_NAME[i], h / 3, v, m->nvert);
        else if (v == m->tri[he_next(h)]) good = wrong(w, "%s triangle %d has vertex %d twice", MESH_NAME[i], h / 3, v);
        else used[v] = 1;
    }
    for (int v = 0; v < m->nvert && good; v++) {
        if (!used[v]) good = wrong(w, "%s vertex %d is in no triangle", MESH_NAME[i], v);
        for (int a = 0; a < 3; a++)
            if (!isfinite(m->pos[3 * v + a]) || !isfinite(m->normal[3 * v + a])) good = wrong(w, "%s vertex %d: no finite position and normal", MESH_NAME[i], v);
    }
    for (int t = 0; t < m->ntri && m->parent && good; t++)
        if (m->parent[t] < 0 || m->parent[t] >= w->mesh[0].ntri) good = wrong(w, "geometric triangle %d: parent %d of %d", t, m->parent[t], w->mesh[0].ntri);
    mem_free(used);
    return good;
}

/* opp[3*ntri]: every edge twice, in opposite directions. */
static bool check_edges(Watch *w, int i, int32_t *opp)
{
    const TriMesh *m = &w->mesh[i];
    Map edge;
    bool good = true;
    map_init(&edge, 3 * m->ntri);
    for (int h = 0; h < 3 * m->ntri && good; h++) {
        int a = m->tri[h], b = m->tri[he_next(h)];
        if (map_put(&edge, key_pair(a, b), h) != h) good = wrong(w, "%s edge %d-%d is there twice in one direction", MESH_NAME[i], a, b);
    }
    for (int h = 0; h < 3 * m->ntri && good; h++) {
        int a = m->tri[h], b = m->tri[he_next(h)];
        opp[h] = map_get(&edge, key_pair(b, a));
        if (opp[h] == NONE) good = wrong(w, "%s edge %d-%d has one side only", MESH_NAME[i], a, b);
    }
    map_free(&edge);
    return good;
}

/* All triangles at a vertex are reached by going around it once. */
static bool check_umbrellas(Watch *w, int i, const int32_t *opp)
{
    const TriMesh *m = &w->mesh[i];
    int32_t *left = NEW0(int32_t, m->nvert), *start = NEW(int32_t, m->nvert);
    bool good = true;
    for (int h = 0; h < 3 * m->ntri; h++) left[m->tri[h]]++, start[m->tri[h]] = h;
    for (int v = 0; v < m->nvert && good; v++) {
        int h = start[v];
        do left[v]--, h = he_next(opp[h]);
        while (h != start[v]);
        if (left[v]) good = wrong(w, "%s vertex %d: two umbrellas", MESH_NAME[i], v);
    }
    mem_free(left);
    mem_free(start);
    return good;
}

/* --- components ------------------------------------------------------------------------------------------------------------ */

/* comp[ntri], over shared edges; returns how many. */
static int find_components(const TriMesh *m, const int32_t *opp, int32_t *comp)
{
    int32_t *todo = NEW(int32_t, m->ntri);
    int n = 0;
    for (int t = 0; t < m->ntri; t++) comp[t] = NONE;
    for (int seed = 0; seed < m->ntri; seed++) {
        if (comp[seed] != NONE) continue;
        int ntodo = 0;
        comp[todo[ntodo++] = seed] = n;
        while (ntodo) {
            int t = todo[--ntodo];
            for (int k = 0; k < 3; k++) {
                int other = opp[3 * t + k] / 3;
                if (comp[other] == NONE) comp[todo[ntodo++] = other] = n;
            }
        }
        n++;
    }
    mem_free(todo);
    return n;
}

/* V - E + F and volume of each component of a manifold. */
static void measure_components(const TriMesh *m, const int32_t *comp, int ncomp, int32_t *euler, double *volume)
{
    uint8_t *seen = NEW0(uint8_t, m->nvert);
    int32_t *faces = NEW0(int32_t, ncomp);
    for (int c = 0; c < ncomp; c++) euler[c] = 0, volume[c] = 0;
    const float *o = m->pos;
    for (int t = 0; t < m->ntri; t++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            int v = m->tri[3 * t + k];
            p[k] = vec3((double)m->pos[3 * v] - (double)o[0], (double)m->pos[3 * v + 1] - (double)o[1], (double)m->pos[3 * v + 2] - (double)o[2]);
            euler[comp[t]] += !seen[v];
            seen[v] = 1;
        }
        volume[comp[t]] += v_dot(p[0], v_cross(p[1], p[2])) / 6;
        faces[comp[t]]++;
    }
    for (int c = 0; c < ncomp; c++) euler[c] -= faces[c] / 2;
    mem_free(seen);
    mem_free(faces);
}

static int by_number(const void *a, const void *b)
{
    int x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

/* The same numbers in some order. The arrays are sorted. */
static bool is_same_bag(int n, int32_t *a, int32_t *b)
{
    qsort(a, (size_t)n, sizeof *a, by_number);
    qsort(b, (size_t)n, sizeof *b, by_number);
    return n == 0 || memcmp(a, b, (size_t)n * sizeof *a) == 0;
}

/* One to one by place, and each turned the right way out. */
static bool check_places(Watch *w, int i, const IsoSurface *iso, const int32_t *comp, int ncomp, const double *volume)
{
    const TriMesh *m = &w->mesh[i];
    Vec3 *pos = NEW(Vec3, m->nvert);
    uint8_t *mesh_bad = NEW(uint8_t, ncomp), *iso_bad = NEW(uint8_t, iso->ncomp);
    int32_t *partner = NEW(int32_t, ncomp);
    bool good = true;
    for (int v = 0; v < m->nvert; v++) pos[v] = vec3(m->pos[3 * v], m->pos[3 * v + 1], m->pos[3 * v + 2]);
    for (int t = 0; t < m->ntri; t++) w->degenerate[i] += !(v_len2(v_area2(pos[m->tri[3 * t]], pos[m->tri[3 * t + 1]], pos[m->tri[3 * t + 2]])) > 0);
    audit_match(iso, &(AuditMesh){m->nvert, m->ntri, ncomp, pos, m->tri, comp}, false, mesh_bad, iso_bad, partner);
    for (int k = 0; k < iso->ncomp && good; k++)
        if (iso_bad[k])
            good = wrong(w, "%s: component %d of the grid (Euler %d, %d loops, volume %.3g voxels) has no mesh of its own", MESH_NAME[i], k, iso->comp_euler[k],
                         iso->comp_loops[k], iso->comp_volume[k]);
    for (int c = 0; c < ncomp && good; c++)
        if (volume[c] * iso->comp_volume[partner[c]] < 0)
            good = wrong(w, "%s: component %d is inside out: volume %.3g, the grid's %.3g voxels", MESH_NAME[i], c, volume[c] / fabs(affine_det(&iso->field->xform)),
                         iso->comp_volume[partner[c]]);
    mem_free(pos);
    mem_free(mesh_bad);
    mem_free(iso_bad);
    mem_free(partner);
    return good;
}

static bool check_components(Watch *w, int i, const IsoSurface *iso, const int32_t *opp)
{
    const TriMesh *m = &w->mesh[i];
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = find_components(m, opp, comp);
    int32_t *euler = NEW(int32_t, n), *wanted = NEW(int32_t, iso->ncomp);
    double *volume = NEW(double, n);
    measure_components(m, comp, n, euler, volume);
    for (int k = 0; k < iso->ncomp; k++) wanted[k] = iso->comp_euler[k];
    bool good = true;
    if (n != iso->ncomp) good = wrong(w, "%s: %d components, the grid has %d", MESH_NAME[i], n, iso->ncomp);
    else if (!is_same_bag(n, euler, wanted)) good = wrong(w, "%s: Euler characteristics are not the grid's", MESH_NAME[i]);
    else good = check_places(w, i, iso, comp, n, volume);
    mem_free(comp);
    mem_free(euler);
    mem_free(wanted);
    mem_free(volume);
    return good;
}

/* --- identities ------------------------------------------------------------------------------------------------------------ */

static bool check_ids(Watch *w, int i)
{
    const TriMesh *m = &w->mesh[i];
    Seen *s = &w->seen[i];
    for (int v = 0; v < m->nvert; v++) {
        int id = m->id[v], old = s->cap;
        if (id < 0) return wrong(w, "%s vertex %d: identity %d", MESH_NAME[i], v, id);
        RESERVE(s->frame, s->cap, id + 1);
        for (int k = old; k < s->cap; k++) s->frame[k] = 0;
        int last = s->frame[id];
        s->frame[id] = w->frames;
        if (last == w->frames) return wrong(w, "%s: two vertices of identity %d", MESH_NAME[i], id);
        if (last && last < w->frames - 1) return wrong(w, "%s: identity %d comes back, gone since frame %d", MESH_NAME[i], id, last);
    }
    return true;
}

/* --- a frame --------------------------------------------------------------------------------------------------------------- */

static bool check_mesh(Watch *w, int i, const IsoSurface *iso)
{
    int32_t *opp = NEW(int32_t, 3 * w->mesh[i].ntri);
    bool good = check_indices(w, i) && check_edges(w, i, opp) && check_umbrellas(w, i, opp) && check_components(w, i, iso, opp) && check_ids(w, i);
    mem_free(opp);
    return good;
}

static void hash_bytes(uint64_t *hash, const void *data, size_t n)
{
    const uint8_t *p = data;
    for (size_t i = 0; i < n; i++) *hash = (*hash ^ p[i]) * 1099511628211u;
}

static void count_frame(Watch *w)
{
    for (int i = 0; i < 2; i++) {
        const TriMesh *m = &w->mesh[i];
        size_t v = (size_t)m->nvert, t = (size_t)m->ntri;
        hash_bytes(&w->hash, m->pos, 12 * v);
        hash_bytes(&w->hash, m->normal, 12 * v);
        hash_bytes(&w->hash, m->id, 4 * v);
        hash_bytes(&w->hash, m->tri, 12 * t);
    }
    const FrameStat *s = &w->stat;
    w->events += w->frames > 1 && (s->audit_components != w->last[0] || s->audit_euler != w->last[1]);
    w->last[0] = s->audit_components;
    w->last[1] = s->audit_euler;
    for (int i = 0; i < 2; i++) w->triangles[i] += w->mesh[i].ntri;
    w->components += s->audit_components;
    w->remade_components += w->frames > 1 ? s->remade_components : 0;
    w->replaced_vertices += w->frames > 1 ? s->replaced_vertices : 0;
    w->raw_components += s->raw_components;
    w->inverted_left[0] += s->inverted_left;
    w->inverted_left[1] += s->inverted_left_geometric;
    if (w->frames > 1) w->ids_kept += isnan(s->ids_kept) ? 1 : s->ids_kept;
}

bool watch_frame(Watch *w, Grid *g, Grid *velocity)
{
    int slot = w->frames++ % 2;
    Field *f = &w->field[slot];
    FieldSpec spec = {0, true};
    Err err = {0};
    field_free(f);
    bool built = field_build(f, g, &spec, &err);
    grid_free(g);
    grid_free(&w->velocity[slot]);
    if (velocity) w->velocity[slot] = *velocity;
    if (!built || !track_frame(w->tr, f, velocity ? &w->velocity[slot] : NULL, 1, &w->stat, &err)) return wrong(w, "%s", err.text);
    for (int i = 0; i < 2; i++) trimesh_free(&w->mesh[i]);
    track_meshes(w->tr, false, &w->mesh[0], &w->mesh[1]);
    count_frame(w);
    if (w->stat.wrong_components) return wrong(w, "the tracker reports %d wrong components", w->stat.wrong_components);
    if (w->stat.components != w->stat.audit_components) return wrong(w, "the tracker reports %d components, the grid has %d", w->stat.components, w->stat.audit_components);
    IsoSurface iso;
    iso_build(&iso, f);
    bool good = check_mesh(w, 0, &iso) && check_mesh(w, 1, &iso);
    iso_free(&iso);
    return good;
}
