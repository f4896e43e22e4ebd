#include "check/check_priv.h"

#include "base/hash.h"

#include <stdlib.h>
#include <string.h>

#define STILL_MOST_VOX 2.0  /* a surface that seems to move farther is none that was followed to first order */
#define SLOPE_KEPT 0.5      /* beyond the band where the field has a slope, it says nothing of motion */

/* The first vertex that bears each identity; returns how many bear another one's. */
static int index_ids(Map *at, const TriMesh *m)
{
    int duplicates = 0;
    map_init(at, m->nvert);
    for (int v = 0; v < m->nvert; v++) duplicates += map_put(at, (uint32_t)m->id[v], v) != v;
    return duplicates;
}

void check_ids(const TriMesh *mesh, CheckRow *row)
{
    Map at;
    row->value[CHECK_DUPLICATE_IDS] = index_ids(&at, mesh);
    map_free(&at);
}

void check_parents(const TriMesh *mesh, int mechanical, CheckRow *row)
{
    int odd = 0;
    for (int t = 0; t < mesh->ntri; t++) odd += mesh->parent[t] < 0 || mesh->parent[t] >= mechanical;
    row->value[CHECK_PARENTS_ODD] = odd;
}

/* --- triangles as triples of identities ----------------------------------------------------------- */

typedef struct Triple {
    int32_t id[3];
} Triple;

static int compare_triples(const void *pa, const void *pb)
{
    const Triple *a = pa, *b = pb;
    for (int k = 0; k < 3; k++)
        if (a->id[k] != b->id[k]) return a->id[k] < b->id[k] ? -1 : 1;
    return 0;
}

static Triple *list_triples(const TriMesh *m)
{
    Triple *list = NEW(Triple, m->ntri);
    for (int t = 0; t < m->ntri; t++) {
        int32_t a = m->id[m->tri[3 * t]], b = m->id[m->tri[3 * t + 1]], c = m->id[m->tri[3 * t + 2]];
        int32_t lo = int_min(a, int_min(b, c)), hi = int_max(a, int_max(b, c));
        list[t] = (Triple){{lo, a ^ b ^ c ^ lo ^ hi, hi}};
    }
    qsort(list, (size_t)m->ntri, sizeof *list, compare_triples);
    return list;
}

static double share_of_triangles_kept(const TriMesh *last, const TriMesh *mesh)
{
    Triple *a = list_triples(last), *b = list_triples(mesh);
    int kept = 0;
    for (int i = 0, j = 0; i < last->ntri && j < mesh->ntri;) {
        int order = compare_triples(&a[i], &b[j]);
        kept += order == 0;
        i += order <= 0;
        j += order >= 0;
    }
    mem_free(a);
    mem_free(b);
    return last->ntri ? (double)kept / last->ntri : NAN;
}

/* --- vertices that are still there ---------------------------------------------------------------- */

typedef struct Pairs {
    int n;
    Vec3 *from, *to;
} Pairs;

/* The share of the last frame's identities that are kept. */
static double pair_vertices(const TriMesh *last, const TriMesh *mesh, Pairs *out)
{
    Map before, now;
    int kept = 0, identities = last->nvert - index_ids(&before, last);
    index_ids(&now, mesh);
    *out = (Pairs){0, NEW(Vec3, last->nvert), NEW(Vec3, last->nvert)};
    for (int v = 0; v < last->nvert; v++) {
        int at = map_get(&now, (uint32_t)last->id[v]);
        if (at == NONE) continue;
        kept += map_get(&before, (uint32_t)last->id[v]) == v;
        out->from[out->n] = place_of(last->pos, v);
        out->to[out->n++] = place_of(mesh->pos, at);
    }
    map_free(&before);
    map_free(&now);
    return identities ? (double)kept / identities : NAN;
}

/* A field's values and outward gradients at points. */
typedef struct Sampled {
    double *F;
    Vec3 *grad;
} Sampled;

static Sampled sample(const Field *f, int n, const Vec3 *p)
{
    Sampled s = {NEW(double, n), NEW(Vec3, n)};
    field_sample(f, n, p, s.F, s.grad);
    return s;
}

static void sampled_free(Sampled *s)
{
    mem_free(s->F);
    mem_free(s->grad);
}

/* The surface itself moves along its outward normal by F_t / |grad F|, taken at the old place: what a vertex moves along
 * it beyond that is flicker. To first order, where both fields have a slope. */
static void measure_flicker(const Field *last_field, const Field *field, const Pairs *pairs, Spread *out)
{
    Sampled a = sample(last_field, pairs->n, pairs->from), b = sample(field, pairs->n, pairs->from);
    for (int i = 0; i < pairs->n; i++) {
        double la = v_len(a.grad[i]), lb = v_len(b.grad[i]);
        if (depth_of(last_field, pairs->from[i]) < 1 || depth_of(field, pairs->from[i]) < 1) continue;
        if (!(la > 0) || lb < SLOPE_KEPT * la) continue;
        double own = (b.F[i] - a.F[i]) / (0.5 * (la + lb)) / field->voxel;
        double moved = -v_dot(v_sub(pairs->to[i], pairs->from[i]), a.grad[i]) / la / field->voxel;
        if (fabs(own) <= STILL_MOST_VOX) spread_add(out, fabs(moved - own), 1);
    }
    sampled_free(&a);
    sampled_free(&b);
}

void check_motion(const Field *last_field, const TriMesh *last, const Field *field, const TriMesh *mesh, CheckRow *row)
{
    Spread way = {0}, flicker = {0};
    Pairs pairs;
    row->value[CHECK_IDS_KEPT] = pair_vertices(last, mesh, &pairs);
    row->value[CHECK_TRIANGLES_KEPT] = share_of_triangles_kept(last, mesh);
    for (int i = 0; i < pairs.n; i++) spread_add(&way, v_dist(pairs.from[i], pairs.to[i]) / field->voxel, 1);
    measure_flicker(last_field, field, &pairs, &flicker);
    spread_sort(&way);
    spread_sort(&flicker);
    row->value[CHECK_MOTION_P50] = spread_quantile(&way, 0.5);
    row->value[CHECK_MOTION_P95] = spread_quantile(&way, 0.95);
    row->value[CHECK_MOTION_MAX] = spread_most(&way);
    row->value[CHECK_FLICKER_MEAN] = spread_mean(&flicker);
    row->value[CHECK_FLICKER_P95] = spread_quantile(&flicker, 0.95);
    spread_free(&way);
    spread_free(&flicker);
    mem_free(pairs.from);
    mem_free(pairs.to);
}
