#include "cli/seam.h"

#include "base/vec.h"
#include "mesh/pair.h"

#include <stdlib.h>
#include <string.h>

/* How far apart the two of a pair may be, in mean mechanical edges. Two meshes that know nothing of each other have a vertex
 * of the other within one edge; the rest is for those left over. */
static const double reach_edges[KIND_COUNT] = {1.5, 1.25};

/* One of the two, or its components' share of it. */
typedef struct Half {
    const TriMesh *mesh;     /* [KIND_COUNT] */
    int ncomp;
    int32_t *comp;           /* [mechanical vertices] */
    int32_t *group;          /* [ncomp] the components that both have bear the same; else NONE */
    int32_t *of_kind[KIND_COUNT]; /* [vertices] their groups */
} Half;

static void half_fill(Half *h, const TriMesh *mesh)
{
    *h = (Half){.mesh = mesh};
    const TriMesh *mech = &mesh[KIND_MECHANICAL];
    h->comp = NEW(int32_t, mech->nvert);
    h->ncomp = trimesh_components(mech, h->comp);
    h->group = NEW(int32_t, h->ncomp);
    for (int c = 0; c < h->ncomp; c++) h->group[c] = NONE;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        h->of_kind[kind] = NEW(int32_t, mesh[kind].nvert);
        for (int v = 0; v < mesh[kind].nvert; v++) h->of_kind[kind][v] = kind == KIND_MECHANICAL ? 0 : NONE;
    }
}

static void half_free(Half *h)
{
    mem_free(h->comp);
    mem_free(h->group);
    for (int kind = 0; kind < KIND_COUNT; kind++) mem_free(h->of_kind[kind]);
}

static PairSide side_of(const Half *h, int kind)
{
    const TriMesh *m = &h->mesh[kind];
    return (PairSide){m->nvert, m->pos, m->normal, h->of_kind[kind]};
}

static Vec3 place(const TriMesh *m, int v)
{
    const float *p = m->pos + 3 * (size_t)v;
    return vec3((double)p[0], (double)p[1], (double)p[2]);
}

static double mean_edge(const TriMesh *m)
{
    double sum = 0;
    for (int h = 0; h < 3 * m->ntri; h++) sum += v_dist(place(m, m->tri[h]), place(m, m->tri[h % 3 == 2 ? h - 2 : h + 1]));
    return m->ntri ? sum / (3 * m->ntri) : 0;
}

/* --- components ------------------------------------------------------------------------------------ */

typedef struct Vote {
    int32_t before, behind, count;
} Vote;

static int compare_votes(const void *px, const void *py)
{
    const Vote *x = px, *y = py;
    if (x->count != y->count) return x->count > y->count ? -1 : 1;
    if (x->behind != y->behind) return x->behind < y->behind ? -1 : 1;
    return (x->before > y->before) - (x->before < y->before);
}

/* Components with most pairs in common are one. */
static void match_components(Half *a, Half *b, const int32_t *partner)
{
    int n = b->mesh[KIND_MECHANICAL].nvert, nvote = 0;
    Vote *vote = NEW(Vote, n);
    Map at;
    map_init(&at, b->ncomp);
    for (int v = 0; v < n; v++) {
        if (partner[v] == NONE) continue;
        int ca = a->comp[partner[v]], cb = b->comp[v], k = map_put(&at, key_pair(ca, cb), nvote);
        if (k == nvote) vote[nvote++] = (Vote){ca, cb, 0};
        vote[k].count++;
    }
    if (nvote) qsort(vote, (size_t)nvote, sizeof *vote, compare_votes);
    for (int i = 0; i < nvote; i++) {
        int32_t *ga = &a->group[vote[i].before], *gb = &b->group[vote[i].behind];
        if (*ga == NONE && *gb == NONE) *ga = *gb = i;
    }
    map_free(&at);
    mem_free(vote);
}

/* Vertices take part with their component; of the geometric mesh its midpoints alone, by the triangles that they are on. */
static void set_groups(Half *h)
{
    const TriMesh *mech = &h->mesh[KIND_MECHANICAL], *fine = &h->mesh[KIND_GEOMETRIC];
    int32_t *of = h->of_kind[KIND_MECHANICAL], *of_fine = h->of_kind[KIND_GEOMETRIC];
    Map is_mechanical;
    map_init(&is_mechanical, mech->nvert);
    for (int v = 0; v < mech->nvert; v++) {
        of[v] = h->group[h->comp[v]];
        map_put(&is_mechanical, (uint64_t)mech->id[v], v);
    }
    for (int i = 0; i < 3 * fine->ntri; i++) {
        int v = fine->tri[i];
        if (map_get(&is_mechanical, (uint64_t)fine->id[v]) == NONE) of_fine[v] = of[mech->tri[3 * fine->parent[i / 3]]];
    }
    map_free(&is_mechanical);
}

/* least[group] */
static int32_t *least_identities(const Half *h, int ngroup)
{
    const TriMesh *mech = &h->mesh[KIND_MECHANICAL];
    int32_t *least = NEW(int32_t, ngroup);
    for (int g = 0; g < ngroup; g++) least[g] = INT32_MAX;
    for (int v = 0; v < mech->nvert; v++) {
        int g = h->group[h->comp[v]];
        if (g != NONE) least[g] = int_min(least[g], mech->id[v]);
    }
    return least;
}

static void map_numbers(const Half *a, const Half *b, Map *number)
{
    int n = b->mesh[KIND_MECHANICAL].nvert; /* more than there are groups */
    int32_t *before = least_identities(a, n), *behind = least_identities(b, n);
    map_init(number, b->ncomp);
    for (int g = 0; g < n; g++)
        if (behind[g] != INT32_MAX) map_put(number, (uint64_t)behind[g], before[g]);
    mem_free(before);
    mem_free(behind);
}

/* --- identities ------------------------------------------------------------------------------------ */

static void take_pairs(const Half *a, const Half *b, int kind, const int32_t *partner, double edge, Seam *out)
{
    const TriMesh *ma = &a->mesh[kind], *mb = &b->mesh[kind];
    SeamSide *side = &out->side[kind];
    if (kind == KIND_GEOMETRIC) *side = out->side[KIND_MECHANICAL];
    double sum = side->mean * side->pairs;
    for (int v = 0; v < mb->nvert; v++) {
        if (partner[v] == NONE) continue;
        double way = v_dist(place(ma, partner[v]), place(mb, v)) / edge;
        map_put(&out->identity, (uint64_t)mb->id[v], ma->id[partner[v]]);
        sum += way;
        side->largest = real_max(side->largest, way);
        side->pairs++;
    }
    side->mean = side->pairs ? sum / side->pairs : 0;
    side->vertices[0] = ma->nvert;
    side->vertices[1] = mb->nvert;
}

void seam_find(const TriMesh *before, const TriMesh *behind, Seam *out)
{
    Half a, b;
    *out = (Seam){0};
    half_fill(&a, before);
    half_fill(&b, behind);
    double edge = mean_edge(&behind[KIND_MECHANICAL]);
    int32_t *partner[KIND_COUNT];
    for (int kind = 0; kind < KIND_COUNT; kind++) partner[kind] = NEW(int32_t, behind[kind].nvert);
    map_init(&out->identity, behind[KIND_GEOMETRIC].nvert);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        PairSide sa = side_of(&a, kind), sb = side_of(&b, kind);
        pair_vertices(&sa, &sb, reach_edges[kind] * edge, partner[kind]);
        if (kind == KIND_MECHANICAL) { /* of all vertices, to know the components; then component by component */
            match_components(&a, &b, partner[kind]);
            set_groups(&a);
            set_groups(&b);
            pair_vertices(&sa, &sb, reach_edges[kind] * edge, partner[kind]);
        }
        take_pairs(&a, &b, kind, partner[kind], edge, out);
        mem_free(partner[kind]);
    }
    map_numbers(&a, &b, &out->number);
    half_free(&a);
    half_free(&b);
}

void seam_free(Seam *s)
{
    map_free(&s->identity);
    map_free(&s->number);
    *s = (Seam){0};
}
