#include "diff/diff.h"

#include "diff/hausdorff.h"
#include "mesh/structure.h"

#include <math.h>
#include <string.h>

#define DEGREES 57.29577951308232
#define SLACK_SHARE 1e-4 /* of the meshes' extent: what distances are known to, where no tolerance asks for more */
#define SLACK_TOLERANCE 0.1

static Vec3 place_of(const float *column, int v)
{
    const float *p = column + 3 * (size_t)v;
    return vec3((double)p[0], (double)p[1], (double)p[2]);
}

/* --- one connectivity ----------------------------------------------------------------------------- */

static double most_apart(const float *a, const float *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = real_max(most, fabs((double)a[i] - (double)b[i]));
    return most;
}

/* The column of b under the same name, or NULL. */
static const float *attribute_of(const TriMesh *b, const char *name)
{
    for (int i = 0; i < b->nattr; i++)
        if (strcmp(b->attr_name[i], name) == 0) return b->attr[i];
    return NULL;
}

static void compare_places(const TriMesh *a, const TriMesh *b, DiffMesh *d)
{
    d->place = d->normal_deg = 0;
    for (int v = 0; v < a->nvert; v++) {
        double far = v_dist(place_of(a->pos, v), place_of(b->pos, v));
        Vec3 n = place_of(a->normal, v), m = place_of(b->normal, v);
        if (far > d->place) d->place = far, d->place_vertex = v;
        d->normal_deg = real_max(d->normal_deg, atan2(v_len(v_cross(n, m)), v_dot(n, m)) * DEGREES);
    }
}

static void compare_columns(const TriMesh *a, const TriMesh *b, DiffMesh *d)
{
    d->same_columns = !a->velocity == !b->velocity && !a->parent == !b->parent && a->nattr == b->nattr;
    if (a->velocity && b->velocity) d->velocity = most_apart(a->velocity, b->velocity, 3 * (size_t)a->nvert);
    for (int t = 0; a->parent && b->parent && t < a->ntri; t++) d->parents += a->parent[t] != b->parent[t];
    for (int i = 0; i < a->nattr; i++) {
        const float *other = attribute_of(b, a->attr_name[i]);
        d->same_columns = d->same_columns && other;
        if (other) d->value = fmax(d->value, most_apart(a->attr[i], other, (size_t)a->nvert));
    }
}

/* --- surfaces ------------------------------------------------------------------------------------- */

typedef struct Side {
    Vec3 *pos;
    Surface surface;
} Side;

static Side make_side(const TriMesh *m, DiffSide *out)
{
    Side s = {.pos = NEW(Vec3, m->nvert)};
    MeshStructure structure;
    for (int v = 0; v < m->nvert; v++) s.pos[v] = place_of(m->pos, v);
    s.surface = (Surface){m->nvert, m->ntri, s.pos, m->tri};
    structure_build(&structure, m->nvert, s.pos, m->ntri, m->tri);
    *out = (DiffSide){m->nvert, m->ntri, structure.ncomp, structure_euler(&structure), NAN, NAN, {NAN, NAN, NAN}};
    structure_free(&structure);
    return s;
}

static double extent_of(const Side *s)
{
    Vec3 lo = vec3(INFINITY, INFINITY, INFINITY), hi = vec3(-INFINITY, -INFINITY, -INFINITY);
    for (int v = 0; v < s->surface.nvert; v++) {
        Vec3 p = s->pos[v];
        lo = vec3(real_min(lo.x, p.x), real_min(lo.y, p.y), real_min(lo.z, p.z));
        hi = vec3(real_max(hi.x, p.x), real_max(hi.y, p.y), real_max(hi.z, p.z));
    }
    return v_dist(lo, hi);
}

static void compare_surfaces(const DiffSettings *set, const Side side[2], DiffMesh *d)
{
    if (side[0].surface.ntri == 0 || side[1].surface.ntri == 0) return;
    double slack = SLACK_SHARE * real_max(extent_of(&side[0]), extent_of(&side[1]));
    if (set->surface && set->tolerance > 0) slack = real_min(slack, SLACK_TOLERANCE * set->tolerance);
    if (!(slack > 0)) slack = 1e-30; /* all in one place */
    for (int i = 0; i < 2; i++) {
        FarPoint far = hausdorff_from(&side[i].surface, &side[!i].surface, slack);
        d->side[i].distance = far.distance;
        d->side[i].most = far.most;
        for (int a = 0; a < 3; a++) d->side[i].at[a] = v_get(far.at, a);
    }
}

/* --- the answer ----------------------------------------------------------------------------------- */

static bool within(double x, double limit) { return isnan(x) || x <= limit; }

static bool is_same_mesh(const DiffSettings *set, const DiffMesh *d)
{
    return within(d->place, set->tolerance) && within(d->normal_deg, set->normals_deg) &&
           within(d->velocity, set->values) && within(d->value, set->values) && d->parents == 0 &&
           (d->same_columns || isinf(set->values));
}

/* As far as that is known for certain. Two without triangles are one surface. */
static bool is_same_surface(const DiffSettings *set, const DiffMesh *d)
{
    if (d->side[0].triangles == 0 || d->side[1].triangles == 0)
        return set->surface && d->side[0].triangles == d->side[1].triangles;
    return set->surface && d->side[0].most <= set->tolerance && d->side[1].most <= set->tolerance;
}

DiffMesh diff_meshes(const DiffSettings *set, const TriMesh *a, const TriMesh *b)
{
    DiffMesh d = {.same_run = trimesh_is_same_run(a, b),
                  .place = NAN,
                  .normal_deg = NAN,
                  .velocity = NAN,
                  .value = NAN,
                  .place_vertex = NONE};
    Side side[2] = {make_side(a, &d.side[0]), make_side(b, &d.side[1])};
    if (d.same_run) {
        compare_places(a, b, &d);
        compare_columns(a, b, &d);
        d.same = is_same_mesh(set, &d);
    } else {
        compare_surfaces(set, side, &d);
        d.same = is_same_surface(set, &d);
    }
    mem_free(side[0].pos);
    mem_free(side[1].pos);
    return d;
}
