#include "check/check_priv.h"

#include "mesh/intersect.h"
#include "topology/audit.h"

#include <stdlib.h>
#include <string.h>

const CheckFigureSpec check_figure[CHECK_FIGURES] = {
#define SECTION(heading)
#define FIGURE(id, name, bad, limit, what) {name, CHECK_BAD_##bad, limit, what},
#include "check/figures.def"
};

CheckRow check_row_empty(void)
{
    CheckRow row;
    for (int i = 0; i < CHECK_FIGURES; i++) row.value[i] = NAN;
    return row;
}

double depth_of(const Field *f, Vec3 p)
{
    Vec3 q = affine_to_index(&f->xform, p);
    double depth = INFINITY;
    for (int a = 0; a < 3; a++) depth = real_min(depth, real_min(v_get(q, a) - f->lo[a], f->hi[a] - v_get(q, a)));
    return depth;
}

CheckSurface *check_surface_make(const Field *field)
{
    CheckSurface *s = NEW0(CheckSurface, 1);
    s->field = field;
    iso_build(&s->iso, field);
    uint8_t *all = NEW(uint8_t, s->iso.ncomp);
    memset(all, 1, (size_t)s->iso.ncomp);
    iso_triangles(&s->iso, all, NULL, &s->tri);
    mem_free(all);
    closest_build(&s->index, s->tri.ntri, s->tri.pos, s->tri.tri);
    return s;
}

void check_surface_free(CheckSurface *s)
{
    if (!s) return;
    closest_free(&s->index);
    iso_triangles_free(&s->tri);
    iso_free(&s->iso);
    mem_free(s);
}

/* --- the mesh itself ------------------------------------------------------------------------------ */

static int compare_places(const void *pa, const void *pb)
{
    const float *a = pa, *b = pb;
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* Vertices of some triangle that stand where another one does. */
static int count_coincident(const TriMesh *m)
{
    uint8_t *used = NEW0(uint8_t, m->nvert);
    float *place = NEW(float, 3 * (size_t)m->nvert);
    int n = 0, count = 0;
    for (int h = 0; h < 3 * m->ntri; h++) used[m->tri[h]] = 1;
    for (int v = 0; v < m->nvert; v++)
        if (used[v]) memcpy(place + 3 * (size_t)n++, m->pos + 3 * (size_t)v, 3 * sizeof *place);
    qsort(place, (size_t)n, 3 * sizeof *place, compare_places);
    for (int i = 0; i < n; i++) {
        const float *p = place + 3 * (size_t)i;
        count += (i > 0 && compare_places(p - 3, p) == 0) || (i + 1 < n && compare_places(p, p + 3) == 0);
    }
    mem_free(place);
    mem_free(used);
    return count;
}

static int count_collinear(const Ready *r)
{
    int n = 0;
    for (int t = 0; t < r->ntri; t++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) p[k] = r->pos[r->tri[3 * t + k]];
        n += triangle_is_collinear(p);
    }
    return n;
}

static int count_intersections(const Ready *r)
{
    TriPair *pair = NULL;
    int cap = 0, n = intersect_find(&(TriSoup){r->ntri, r->pos, r->tri}, NULL, &pair, &cap);
    mem_free(pair);
    return n;
}

/* Where the mesh of an open border may end: two of its longest edges, and a voxel, from the border. A refined mesh was cut as long as it
 * was coarser. */
static int count_edges_at_border(const Field *f, const Ready *r)
{
    uint8_t *sides = NEW0(uint8_t, r->s.nedge);
    int n = 0;
    double longest = 0;
    for (int h = 0; h < 3 * r->ntri; h++)
        if (sides[r->s.side_edge[h]] < 2) sides[r->s.side_edge[h]]++;
    for (int e = 0; e < r->s.nedge; e++) longest = real_max(longest, v_dist(r->pos[r->s.edge[e][0]], r->pos[r->s.edge[e][1]]));
    for (int e = 0; e < r->s.nedge; e++)
        n += sides[e] == 1 && depth_of(f, v_mid(r->pos[r->s.edge[e][0]], r->pos[r->s.edge[e][1]])) <= 1 + 2 * longest / f->voxel;
    mem_free(sides);
    return n;
}

static void measure_structure(const CheckSettings *set, const Field *f, const Ready *r, CheckRow *row)
{
    const MeshStructure *s = &r->s;
    double *v = row->value;
    v[CHECK_VERTICES] = r->mesh->nvert;
    v[CHECK_TRIANGLES] = r->mesh->ntri;
    v[CHECK_COMPONENTS] = s->ncomp;
    v[CHECK_BOUNDARY_EDGES] = s->boundary_edges - (set->open_border ? count_edges_at_border(f, r) : 0);
    v[CHECK_NONMANIFOLD_EDGES] = s->nonmanifold_edges;
    v[CHECK_MISORIENTED_EDGES] = s->misoriented_edges;
    v[CHECK_NONMANIFOLD_VERTICES] = s->nonmanifold_vertices;
    v[CHECK_REPEATED_CORNERS] = r->mesh->ntri - r->ntri;
    v[CHECK_NO_AREA] = count_collinear(r);
    v[CHECK_DUPLICATES] = s->duplicates;
    v[CHECK_UNREFERENCED] = s->unreferenced;
    v[CHECK_INWARD] = structure_volume(s) < 0;
    v[CHECK_FAULTS] = 0;
    for (int i = CHECK_FAULTS + 1; i <= CHECK_INWARD; i++) v[CHECK_FAULTS] += v[i];
    v[CHECK_COINCIDENT] = count_coincident(r->mesh);
    if (!set->quick) v[CHECK_SELF_INTERSECTIONS] = count_intersections(r);
}

/* --- topology ------------------------------------------------------------------------------------- */

/* The audit finds the partners; the Euler characteristics are those of the structure, which holds for meshes that are
 * neither closed nor manifold too. */
static void measure_topology(const CheckSurface *surface, const Ready *r, CheckRow *row)
{
    const IsoSurface *iso = &surface->iso;
    const MeshStructure *s = &r->s;
    uint8_t *mesh_bad = NEW(uint8_t, s->ncomp), *iso_bad = NEW(uint8_t, iso->ncomp), *taken = NEW0(uint8_t, iso->ncomp);
    int32_t *partner = NEW(int32_t, s->ncomp);
    int missing = iso->ncomp, extra = 0, euler = 0;
    AuditMesh mesh = {r->mesh->nvert, r->ntri, s->ncomp, r->pos, r->tri, s->tri_comp};
    AuditStat stat = audit_match(iso, &mesh, true, mesh_bad, iso_bad, partner);
    for (int c = 0; c < s->ncomp; c++) {
        int k = partner[c];
        if (k == NONE || taken[k]) {
            extra++;
            continue;
        }
        taken[k] = 1;
        missing--;
        euler += component_euler(&s->comp[c]) != iso->comp_euler[k];
    }
    row->value[CHECK_SURFACE_COMPONENTS] = iso->ncomp;
    row->value[CHECK_MISSING] = missing;
    row->value[CHECK_EXTRA] = extra;
    row->value[CHECK_EULER_ERRORS] = euler;
    row->value[CHECK_TOPOLOGY_ERRORS] = missing + extra + euler;
    row->value[CHECK_SIZE_ERRORS] = stat.size_errors;
    mem_free(mesh_bad);
    mem_free(iso_bad);
    mem_free(taken);
    mem_free(partner);
}

static Ready make_ready(const TriMesh *m)
{
    Ready r = {.mesh = m, .pos = NEW(Vec3, m->nvert), .tri = NEW(int32_t, 3 * (size_t)m->ntri)};
    for (int v = 0; v < m->nvert; v++) r.pos[v] = place_of(m->pos, v);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *v = m->tri + 3 * (size_t)t;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        memcpy(r.tri + 3 * (size_t)r.ntri++, v, 3 * sizeof *v);
    }
    structure_build(&r.s, m->nvert, r.pos, r.ntri, r.tri);
    return r;
}

void check_mesh(const CheckSettings *set, const CheckSurface *surface, const TriMesh *mesh, CheckRow *row)
{
    Ready r = make_ready(mesh);
    measure_structure(set, surface->field, &r, row);
    if (!set->open_border) measure_topology(surface, &r, row);
    if (!set->quick) measure_distances(surface, &r, row);
    measure_quality(set, surface->field, &r, row);
    measure_normals(surface->field, &r, row);
    structure_free(&r.s);
    mem_free(r.pos);
    mem_free(r.tri);
}
