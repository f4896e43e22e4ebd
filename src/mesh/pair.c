#include "mesh/pair.h"

#include "base/hash.h"
#include "base/vec.h"

#include <stdlib.h>
#include <string.h>

#define SAME_WAY 0.25        /* least cosine of the normals of two candidates */
enum { DEPTH_MAX = 64 };     /* of an augmenting path */
enum { EXCHANGES = 8 };      /* rounds of them */

/* A candidate. */
typedef struct Link {
    float d2;
    int32_t a, b;
} Link;

typedef struct Pairing {
    const PairSide *a, *b;
    int nlink, caplink;
    Link *link;              /* by b, each b's nearest first */
    int32_t *first;          /* [b->n + 1] in link */
    int32_t *of_a, *of_b;    /* partners, NONE */
    int32_t *seen;           /* [a->n] the round that came by */
} Pairing;

static Vec3 get3(const float *v, int i) { return vec3((double)v[3 * i], (double)v[3 * i + 1], (double)v[3 * i + 2]); }

/* --- candidates ------------------------------------------------------------------------------------ */

/* Vertices of a by cell of a grid. */
typedef struct Cells {
    double side;
    Map at;                  /* which cell */
    int32_t *first, *next;   /* [at.count], [n]: its vertices, NONE behind the last */
} Cells;

/* What is out of range shares a place with others: that costs time alone. */
static int cell_at(double x, double side)
{
    double q = floor(x / side);
    return q > -1e6 && q < 1e6 ? (int)q : 0;
}

static uint64_t cell_key(const Cells *c, Vec3 p, int dx, int dy, int dz)
{
    return key_coord(cell_at(p.x, c->side) + dx, cell_at(p.y, c->side) + dy, cell_at(p.z, c->side) + dz);
}

static void cells_fill(Cells *c, const PairSide *a, double side)
{
    *c = (Cells){.side = side, .first = NEW(int32_t, a->n), .next = NEW(int32_t, a->n)};
    map_init(&c->at, a->n);
    for (int i = a->n; i-- > 0;) {
        if (a->group[i] == NONE) continue;
        int n = c->at.count, k = map_put(&c->at, cell_key(c, get3(a->pos, i), 0, 0, 0), n);
        c->next[i] = k == n ? NONE : c->first[k];
        c->first[k] = i;
    }
}

static void cells_free(Cells *c)
{
    map_free(&c->at);
    mem_free(c->first);
    mem_free(c->next);
}

static void link_candidates(Pairing *p, int b, double reach, int a)
{
    if (p->a->group[a] != p->b->group[b]) return;
    double d2 = v_len2(v_sub(get3(p->a->pos, a), get3(p->b->pos, b)));
    if (!(d2 <= reach * reach) || v_dot(get3(p->a->normal, a), get3(p->b->normal, b)) < SAME_WAY) return;
    RESERVE(p->link, p->caplink, p->nlink + 1);
    p->link[p->nlink++] = (Link){(float)d2, a, b};
}

static int compare_links(const void *px, const void *py)
{
    const Link *x = px, *y = py;
    if (x->d2 != y->d2) return x->d2 < y->d2 ? -1 : 1;
    return x->b != y->b ? (x->b < y->b ? -1 : 1) : (x->a > y->a) - (x->a < y->a);
}

static void find_candidates(Pairing *p, double reach)
{
    Cells c;
    cells_fill(&c, p->a, reach);
    for (int b = 0; b < p->b->n; b++) {
        p->first[b] = p->nlink;
        if (p->b->group[b] == NONE) continue;
        for (int k = 0; k < 27; k++) {
            int cell = map_get(&c.at, cell_key(&c, get3(p->b->pos, b), k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
            for (int a = cell == NONE ? NONE : c.first[cell]; a != NONE; a = c.next[a]) link_candidates(p, b, reach, a);
        }
        int n = p->nlink - p->first[b];
        if (n) qsort(p->link + p->first[b], (size_t)n, sizeof *p->link, compare_links);
    }
    p->first[p->b->n] = p->nlink;
    cells_free(&c);
}

/* --- pairs ----------------------------------------------------------------------------------------- */

static void pair_off(Pairing *p, int a, int b)
{
    p->of_a[a] = b;
    p->of_b[b] = a;
}

static void pair_nearest(Pairing *p)
{
    Link *all = NEW(Link, p->nlink);
    if (p->nlink) memcpy(all, p->link, (size_t)p->nlink * sizeof *all);
    if (p->nlink) qsort(all, (size_t)p->nlink, sizeof *all, compare_links);
    for (int i = 0; i < p->nlink; i++)
        if (p->of_a[all[i].a] == NONE && p->of_b[all[i].b] == NONE) pair_off(p, all[i].a, all[i].b);
    mem_free(all);
}

/* A partner for b by way of at most `depth` others, who change theirs. */
static bool find_partner(Pairing *p, int b, int round, int depth)
{
    for (int i = p->first[b]; i < p->first[b + 1]; i++) {
        int a = p->link[i].a;
        if (p->of_a[a] != NONE) continue;
        pair_off(p, a, b);
        return true;
    }
    for (int i = p->first[b]; i < p->first[b + 1] && depth > 0; i++) {
        int a = p->link[i].a;
        if (p->seen[a] == round) continue;
        p->seen[a] = round;
        if (!find_partner(p, p->of_a[a], round, depth - 1)) continue;
        pair_off(p, a, b);
        return true;
    }
    return false;
}

/* Short ways first: each of them moves identities along. */
static void pair_left_over(Pairing *p)
{
    for (int depth = 1, round = 0; depth <= DEPTH_MAX; depth *= 2)
        for (int found = 1; found;) {
            found = 0;
            round++;
            for (int b = 0; b < p->b->n; b++)
                if (p->of_b[b] == NONE) found += find_partner(p, b, round, depth);
        }
}

/* The link between the two, or NULL. */
static const Link *find_link(const Pairing *p, int a, int b)
{
    for (int i = p->first[b]; i < p->first[b + 1]; i++)
        if (p->link[i].a == a) return &p->link[i];
    return NULL;
}

/* Squares: one long way weighs more than two short ones. */
static bool exchange_one(Pairing *p, int b)
{
    int a = p->of_b[b];
    const Link *own = find_link(p, a, b);
    for (int i = p->first[b]; p->link[i].d2 < own->d2; i++) {
        int to = p->link[i].a, other = p->of_a[to];
        if (other == NONE) {
            p->of_a[a] = NONE;
            pair_off(p, to, b);
            return true;
        }
        const Link *back = find_link(p, a, other);
        if (!back || !(p->link[i].d2 + back->d2 < own->d2 + find_link(p, to, other)->d2)) continue;
        pair_off(p, to, b);
        pair_off(p, a, other);
        return true;
    }
    return false;
}

static void exchange(Pairing *p)
{
    for (int round = 0, found = 1; round < EXCHANGES && found; round++) {
        found = 0;
        for (int b = 0; b < p->b->n; b++)
            if (p->of_b[b] != NONE) found += exchange_one(p, b);
    }
}

int pair_vertices(const PairSide *a, const PairSide *b, double reach, int32_t *partner)
{
    Pairing p = {.a = a, .b = b, .first = NEW(int32_t, b->n + 1), .of_a = NEW(int32_t, a->n), .of_b = partner, .seen = NEW0(int32_t, a->n)};
    for (int i = 0; i < a->n; i++) p.of_a[i] = NONE;
    for (int i = 0; i < b->n; i++) p.of_b[i] = NONE;
    if (reach > 0) find_candidates(&p, reach);
    if (p.nlink) {
        pair_nearest(&p);
        pair_left_over(&p);
        exchange(&p);
    }
    int pairs = 0;
    for (int i = 0; i < b->n; i++) pairs += partner[i] != NONE;
    mem_free(p.link);
    mem_free(p.first);
    mem_free(p.of_a);
    mem_free(p.seen);
    return pairs;
}
