/* coarsen.c: marching cubes' small triangles brought to the edge length wanted.
 *
 * Where many edges are to be collapsed, that is done block by block, on several threads, a block being what lies in a cube of space: an
 * edge is collapsed there only if the rings of both its ends lie in the block. No other triangles are changed, and none is read without a
 * corner in the block, so that blocks know nothing of one another. Once more with the cubes half a side further, and what is still left
 * follows one by one. */
#include "remesh/remesh_priv.h"

#include "base/thread.h"

#include <math.h>
#include <string.h>

#define COARSEN_SHORT 0.72 /* edges below this are collapsed, */
#define COARSEN_TIDY 0.6   /* edges below this are collapsed even where that costs some distance, */
#define COARSEN_LONG 1.4   /* edges above this are split, in edges wanted: the mean comes out at 1 */
#define BLOCK_SIDE 24.0    /* in edges wanted */
enum {
    SWEEP_WORTH = 8,       /* with one of so many triangles dead, they are swept out before the later passes */
    BLOCKS = 64, PASSES = 2,
    MANY = 1024,           /* edges: fewer are collapsed one by one */
    GRAIN = 4096
};

/* --- collapses -------------------------------------------------------------------------------------------------- */

/* Edges below a length that are to be collapsed, in blocks or all in one. */
typedef struct Shortening {
    Remesh *r;
    double below;
    const Limits *limits;
    double shift;          /* of the blocks, in their sides */
    uint8_t *moved;        /* [nvert] vertices that edges were collapsed into */
    uint8_t *block;        /* [nvert] the block that each lies in; NULL: there are none */
    EdgeEnds *edge;        /* by block, those between blocks last */
    int first[BLOCKS + 2]; /* in `edge`, and the end */
    int left[BLOCKS];      /* first ones of a block that are for later */
    int collapses[BLOCKS];
} Shortening;

static bool is_within(const Mesh *m, const uint8_t *block, int v)
{
    int h = m->out[v];
    do
        if (block[he_to(m, h)] != block[v]) return false;
    while ((h = he_around(m, h)) != m->out[v]);
    return true;
}

/* In order of length. Those whose rings leave the block are gathered in front instead: returns how many. */
static int collapse_edges(Remesh *r, const Shortening *s, int n, EdgeEnds *edge, int *collapses)
{
    const Mesh *m = r->mesh;
    int left = 0;
    remesh_sort_edges(n, edge, false);
    for (int i = 0; i < n; i++) {
        int h = remesh_find_edge(m, &edge[i]);
        if (h == NONE || mesh_edge_length(m, h) >= s->below) continue;
        int a = he_from(m, h), b = he_to(m, h);
        if (s->block && !(is_within(m, s->block, a) && is_within(m, s->block, b))) {
            edge[left++] = edge[i];
            continue;
        }
        if (!remesh_try_collapse(r, h, s->limits)) continue;
        s->moved[vert_is_dead(m, a) ? b : a] = 1;
        ++*collapses;
    }
    return left;
}

/* Of a cube's place along an axis all that its number goes by: the volume may lie too far from the origin for integers. */
static int place_of(double p, const Shortening *s)
{
    double x = floor(p / (BLOCK_SIDE * s->r->edge) + s->shift);
    return (int)(x - BLOCKS * floor(x / BLOCKS));
}

/* Cubes that touch have different numbers; those of the same number are one block, of parts far from one another. */
static void number_block(void *ctx, int begin, int end)
{
    const Shortening *s = ctx;
    for (int v = begin; v < end; v++) {
        Vec3 p = s->r->mesh->pos[v];
        s->block[v] = (uint8_t)((place_of(p.x, s) + 5 * place_of(p.y, s) + 25 * place_of(p.z, s)) % BLOCKS);
    }
}

static void sort_into_blocks(Shortening *s, int n, const EdgeEnds *edge)
{
    int at[BLOCKS + 1], count[BLOCKS + 1] = {0};
    uint8_t *to = NEW(uint8_t, n);
    for (int i = 0; i < n; i++) {
        uint8_t a = s->block[edge[i].from], b = s->block[edge[i].to];
        to[i] = a == b ? a : BLOCKS;
        count[to[i]]++;
    }
    s->first[0] = 0;
    for (int k = 0; k <= BLOCKS; k++) at[k] = s->first[k], s->first[k + 1] = s->first[k] + count[k];
    for (int i = 0; i < n; i++) s->edge[at[to[i]]++] = edge[i];
    mem_free(to);
}

static void collapse_block(void *ctx, int begin, int end)
{
    Shortening *s = ctx;
    for (int k = begin; k < end; k++) {
        Mesh mesh = *s->r->mesh; /* so that only its own dead are counted */
        Remesh r = *s->r;
        r.mesh = &mesh;
        s->collapses[k] = 0;
        s->left[k] = collapse_edges(&r, s, s->first[k + 1] - s->first[k], s->edge + s->first[k], &s->collapses[k]);
    }
}

/* What can be within blocks. The others are gathered in front: returns how many. */
static int collapse_in_blocks(Shortening *s, int n, EdgeEnds *edge, int *collapses)
{
    Mesh *m = s->r->mesh;
    int left = 0;
    s->block = NEW(uint8_t, m->nvert);
    s->edge = NEW(EdgeEnds, n);
    parallel_for(m->nvert, GRAIN, number_block, s);
    sort_into_blocks(s, n, edge);
    parallel_for(BLOCKS, 1, collapse_block, s);
    for (int k = 0; k <= BLOCKS; k++) {
        int more = k < BLOCKS ? s->left[k] : s->first[k + 1] - s->first[k];
        if (more) memcpy(edge + left, s->edge + s->first[k], (size_t)more * sizeof *edge);
        left += more;
    }
    for (int k = 0; k < BLOCKS; k++) {
        *collapses += s->collapses[k];
        m->deadvert += s->collapses[k];
        m->deadtri += 2 * s->collapses[k];
    }
    mem_free(s->edge);
    mem_free(s->block);
    s->block = NULL;
    return left;
}

static int collapse_below(Remesh *r, double below, const Limits *limits)
{
    EdgeEnds *edge;
    int n = remesh_find_edges(r, &(EdgeChoice){.lo = -1, .hi = below}, &edge), collapses = 0;
    Shortening s = {.r = r, .below = below, .limits = limits, .moved = NEW0(uint8_t, r->mesh->nvert)};
    for (int k = 0; k < PASSES && n >= MANY; k++) {
        s.shift = (double)k / PASSES;
        n = collapse_in_blocks(&s, n, edge, &collapses);
    }
    collapse_edges(r, &s, n, edge, &collapses);
    mem_free(edge);
    remesh_land(r, s.moved, 0.5 * r->edge);
    mem_free(s.moved);
    return collapses;
}

/* --- rounds of them --------------------------------------------------------------------------------------------- */

static int split_above(Remesh *r, double limit)
{
    EdgeEnds *edge;
    int n = remesh_edges_by_length(r, &(EdgeChoice){.lo = limit, .hi = 1e300}, true, &edge);
    for (int i = 0; i < n; i++) remesh_split(r, remesh_find_edge(r->mesh, &edge[i])); /* splits take no edge of the list away */
    mem_free(edge);
    return n;
}

static void forget_steps(const Remesh *r)
{
    Mesh *m = r->mesh;
    for (int i = 0; i < 3 * remesh_scope_size(r); i++) {
        int h = remesh_scope_half(r, i);
        if (!remesh_in_zone(r, he_from(m, h)) && !remesh_in_zone(r, he_to(m, h))) continue;
        m->flag[h] = 0;
        m->length[h] = -1;
    }
}

RemeshStat remesh_coarsen(Remesh *r, int rounds)
{
    static const double LIMIT[] = {0.5, COARSEN_SHORT};
    RemeshStat stat = {0};
    for (int k = 0; k < 2; k++) {
        stat.collapses += collapse_below(r, LIMIT[k] * r->edge, &LIMITS_EDIT);
        stat.flips += remesh_flip(r, 0.05);
    }
    if (SWEEP_WORTH * r->mesh->deadtri > r->mesh->ntri) remesh_compact(r, NULL);
    for (int k = 0; k < rounds; k++) {
        remesh_smooth(r, 1);
        stat.splits += split_above(r, COARSEN_LONG * r->edge);
        stat.collapses += collapse_below(r, COARSEN_SHORT * r->edge, &LIMITS_EDIT);
        stat.flips += remesh_flip(r, 0.05);
    }
    for (int k = 0; k < 2; k++) {
        stat.collapses += collapse_below(r, COARSEN_TIDY * r->edge, &LIMITS_TIDY);
        stat.flips += remesh_flip_within(r, 0.05, &LIMITS_TIDY);
        remesh_smooth(r, 1);
    }
    stat.flips += remesh_flip(r, 0.1);
    remesh_compact(r, NULL);
    forget_steps(r);
    return stat;
}

void remesh_even(Remesh *r)
{
    for (int k = 0; k < 2; k++) {
        if (k > 0) split_above(r, COARSEN_LONG * r->edge);
        collapse_below(r, COARSEN_SHORT * r->edge, &LIMITS_EDIT);
        remesh_flip(r, 0.05);
        remesh_smooth(r, 1);
    }
    remesh_compact(r, NULL);
    forget_steps(r);
}
