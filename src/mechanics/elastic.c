#include "mechanics/mechanics_priv.h"

#include "base/thread.h"

#include <string.h>

/* --- who is next to whom ------------------------------------------------------------------------- */

void incidence_build(Incidence *inc, int n, int nslot, const int32_t *node)
{
    RESERVE(inc->first, inc->cap_first, n + 2);
    RESERVE(inc->slot, inc->cap_slot, nslot);
    /* counting sort: first[v + 1] counts, then runs through v's places and ends where v + 1 begins */
    int32_t *first = inc->first;
    memset(first, 0, ((size_t)n + 2) * sizeof *first);
    for (int i = 0; i < nslot; i++) first[node[i] + 1]++;
    int sum = 0;
    for (int v = 0; v <= n; v++) {
        int count = first[v + 1];
        first[v + 1] = sum;
        sum += count;
    }
    for (int i = 0; i < nslot; i++)
        if (node[i] < n) inc->slot[first[node[i] + 1]++] = i;
}

/* --- setting up ---------------------------------------------------------------------------------- */

static void reserve_vertices(Elastic *el, int nvert)
{
    RESERVE(el->local, el->cap_vert, nvert);
    RESERVE(el->vert, el->cap_free, nvert);
}

static void reserve_elements(Elastic *el, int nelem, int arity)
{
    if (arity == 3 && nelem > el->cap_tri) {
        el->cap_tri = mem_capacity(el->cap_tri, nelem);
        RESIZE(el->tri, el->cap_tri);
        RESIZE(el->frame, el->cap_tri);
    }
    if (arity == 2 && nelem > el->cap_edge) {
        el->cap_edge = mem_capacity(el->cap_edge, nelem);
        RESIZE(el->edge, 2 * (size_t)el->cap_edge);
        RESIZE(el->spring, el->cap_edge);
    }
    int npart = arity * nelem;
    if (npart > el->cap_part) {
        el->cap_part = mem_capacity(el->cap_part, npart);
        RESIZE(el->node, el->cap_part);
        RESIZE(el->part, el->cap_part);
    }
}

/* Numbers the free vertices in the order of the vertices. */
static void number_vertices(Elastic *el, const uint8_t *frozen)
{
    int nvert = el->prob->nvert;
    reserve_vertices(el, nvert);
    el->nfree = 0;
    for (int v = 0; v < nvert; v++)
        if (!frozen || !frozen[v]) el->vert[el->nfree++] = v;
    for (int v = 0, i = 0; v < nvert; v++) el->local[v] = i < el->nfree && el->vert[i] == v ? i++ : el->nfree;
}

static bool is_free(const Elastic *el, int v) { return el->local[v] < el->nfree; }

/* Triangle elements: those with a free vertex. Frames and forces are filled in afterwards, in parallel. */
static void choose_triangles(Elastic *el)
{
    const MechanicsProblem *prob = el->prob;
    reserve_elements(el, prob->ntri, 3);
    el->arity = 3;
    el->nelem = 0;
    for (int t = 0; t < prob->ntri; t++) {
        const int32_t *c = prob->tri + 3 * t;
        if (is_free(el, c[0]) || is_free(el, c[1]) || is_free(el, c[2])) el->tri[el->nelem++] = t;
    }
}

static void choose_springs(Elastic *el)
{
    const MechanicsProblem *prob = el->prob;
    reserve_elements(el, 3 * prob->ntri, 2);
    el->arity = 2;
    int nedge = spring_edges(prob->ntri, prob->tri, &el->seen, el->edge);
    el->nelem = 0;
    for (int i = 0; i < nedge; i++) {
        int a = el->edge[2 * i], b = el->edge[2 * i + 1];
        if (!is_free(el, a) && !is_free(el, b)) continue;
        el->edge[2 * el->nelem] = a;
        el->edge[2 * el->nelem + 1] = b;
        el->nelem++;
    }
}

static void make_triangles(void *ctx, int begin, int end)
{
    Elastic *el = ctx;
    const MechanicsProblem *prob = el->prob;
    for (int e = begin; e < end; e++) {
        int t = el->tri[e], turn;
        const int32_t *c = prob->tri + 3 * t;
        Vec3 p[3] = {prob->pos[c[0]], prob->pos[c[1]], prob->pos[c[2]]};
        Vec3 n[3] = {prob->normal[c[0]], prob->normal[c[1]], prob->normal[c[2]]};
        el->frame[e] = element_frame(p, n, prob->inverted && prob->inverted[t], &turn);
        Vec3 uvw[3];
        for (int i = 0; i < 3; i++) {
            uvw[i] = p[(turn + i) % 3];
            el->node[3 * e + i] = el->local[c[(turn + i) % 3]];
        }
        element_force(el->k, el->set->rest, &el->frame[e], uvw, el->part + 3 * e);
    }
}

static void make_springs(void *ctx, int begin, int end)
{
    Elastic *el = ctx;
    const MechanicsProblem *prob = el->prob;
    for (int e = begin; e < end; e++) {
        int a = el->edge[2 * e], b = el->edge[2 * e + 1];
        el->node[2 * e] = el->local[a];
        el->node[2 * e + 1] = el->local[b];
        el->spring[e] = spring_make(el->set->spring, el->set->rest, prob->pos[a], prob->pos[b], el->part + 2 * e);
    }
}

void elastic_build(Elastic *el, const MechanicsSettings *set, const MechanicsProblem *prob, bool all)
{
    el->set = set;
    el->prob = prob;
    number_vertices(el, all ? NULL : prob->frozen);
    if (set->kind == MECHANICS_FEM) {
        element_stiffness(set->young, set->poisson, el->k);
        choose_triangles(el);
        parallel_for(el->nelem, MECHANICS_GRAIN, make_triangles, el);
    } else {
        choose_springs(el);
        parallel_for(el->nelem, MECHANICS_GRAIN, make_springs, el);
    }
    incidence_build(&el->inc, el->nfree, el->arity * el->nelem, el->node);
}

void elastic_free(Elastic *el)
{
    mem_free(el->vert);
    mem_free(el->local);
    mem_free(el->edge);
    mem_free(el->tri);
    mem_free(el->node);
    mem_free(el->frame);
    mem_free(el->spring);
    mem_free(el->part);
    mem_free(el->inc.first);
    mem_free(el->inc.slot);
    map_free(&el->seen);
    *el = (Elastic){0};
}

/* --- the operator -------------------------------------------------------------------------------- */

typedef struct Apply {
    Elastic *el;
    const Vec3 *d;
    const int32_t *only; /* [] the elements; NULL: all */
} Apply;

static void apply_triangles(void *ctx, int begin, int end)
{
    const Apply *ap = ctx;
    const Elastic *el = ap->el;
    const Vec3 *d = ap->d;
    double k[6][6]; /* a copy nobody else can write to: it stays in registers */
    memcpy(k, el->k, sizeof k);
    for (int i = begin; i < end; i++) {
        int e = ap->only ? ap->only[i] : i;
        const int32_t *c = el->node + 3 * e;
        element_apply(k, &el->frame[e], d[c[0]], d[c[1]], d[c[2]], el->part + 3 * e);
    }
}

static void apply_springs(void *ctx, int begin, int end)
{
    const Apply *ap = ctx;
    const Elastic *el = ap->el;
    for (int i = begin; i < end; i++) {
        int e = ap->only ? ap->only[i] : i;
        const int32_t *c = el->node + 2 * e;
        spring_apply(&el->spring[e], ap->d[c[0]], ap->d[c[1]], el->part + 2 * e);
    }
}

void elastic_apply(Elastic *el, const Vec3 *d, int n, const int32_t *only)
{
    parallel_for(n, MECHANICS_GRAIN, el->arity == 3 ? apply_triangles : apply_springs, &(Apply){el, d, only});
}

double elastic_diagonal(const Elastic *el, int v)
{
    int begin = el->inc.first[v], end = el->inc.first[v + 1];
    /* corners of an equilateral triangle are alike: any diagonal block of K has the same trace */
    if (el->arity == 3) return (end - begin) * 0.5 * (el->k[0][0] + el->k[1][1]);
    double sum = 0;
    for (int i = begin; i < end; i++) {
        const Spring *s = &el->spring[el->inc.slot[i] / 2];
        sum += 0.5 * (s->along + s->across);
    }
    return sum;
}
