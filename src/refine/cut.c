/* cut.c: marked edges get their midpoints, triangles give way to their pieces. */
#include "refine/refine_priv.h"

#include "base/thread.h"

/* Where a half-edge comes in the finished mesh. */
static uint64_t place_of(const Pass *p, int h)
{
    int t = h / 3;
    return ((uint64_t)p->parent[t] << WAY_BITS * PASSES_MAX | p->way[t]) << 2 | (uint64_t)(h % 3);
}

static void list_cut(Pass *p)
{
    int n = 0;
    for (int i = 0; i < p->nlist; i++)
        if (p->marked[p->list[i]]) p->list[n++] = p->list[i];
    p->nlist = n;
}

typedef struct Ranked {
    int32_t edge, vert; /* its lower end */
    uint64_t place;     /* of the first of its half-edges */
} Ranked;

/* Identities are given out by the edges' lower ends, then by the places of their half-edges, whatever the edges' numbers. */
static void sort_list(Pass *p)
{
    int32_t *start = NEW0(int32_t, p->m->nvert + 1);
    Ranked *rank = NEW(Ranked, p->nlist);
    for (int i = 0; i < p->nlist; i++) start[edge_end(p, p->list[i], 0) + 1]++;
    for (int v = 0; v < p->m->nvert; v++) start[v + 1] += start[v];
    for (int i = 0; i < p->nlist; i++) {
        int e = p->list[i], v = edge_end(p, e, 0);
        uint64_t a = place_of(p, p->half[e][0]), b = place_of(p, p->half[e][1]);
        rank[start[v]++] = (Ranked){e, v, a < b ? a : b};
    }
    for (int i = 1; i < p->nlist; i++) {
        Ranked r = rank[i];
        int at = i;
        for (; at > 0 && rank[at - 1].vert == r.vert && rank[at - 1].place > r.place; at--) rank[at] = rank[at - 1];
        rank[at] = r;
    }
    for (int i = 0; i < p->nlist; i++) p->list[i] = rank[i].edge;
    mem_free(start);
    mem_free(rank);
}

static void add_midpoints(Pass *p, Refine *now, int32_t *next_id)
{
    RefinedMesh *m = p->m;
    refined_reserve_verts(m, m->nvert + p->nlist);
    for (int i = 0; i < p->nlist; i++) {
        int e = p->list[i], v = m->nvert++, a = edge_end(p, e, 0), b = edge_end(p, e, 1), was = p->was[e];
        const Midpoint *at = &p->midpoint[p->mid[e]];
        m->pos[v] = at->pos;
        m->normal[v] = at->normal;
        m->ends[v][0] = a;
        m->ends[v][1] = b;
        m->flat[v] = p->mid_state[e] == MID_FLAT;
        if (was != NONE) m->id[v] = p->memory->mark[was].id;
        else m->id[v] = *next_id, *next_id += MESH_ID_STEP;
        refine_note(now, (RefineMark){int_min(m->id[a], m->id[b]), int_max(m->id[a], m->id[b]), m->id[v], p->number});
        p->mid[e] = v;
    }
}

/* Numbers of what is new: the halves of cut edges away from their lower ends in the order of the midpoints, then the edges inside
 * the wholes; triangles. */
typedef struct Cut {
    Pass *p;
    int first_vert, first_half, first_inner, first_tri;
    int32_t *at; /* [nwhole] how many triangles, and as many inner edges, the wholes before it add */
} Cut;

static void make_fresh(Pass *p, int e)
{
    p->note[e] = EDGE_UNKNOWN;
    p->mid_state[e] = MID_NONE;
}

/* A whole while it is cut. */
typedef struct Pattern {
    Whole whole;
    int marks;
    int32_t vert[WHOLE_POINTS];
    int ninner;
    uint8_t inner[PIECES_MAX][2];    /* [ninner] points */
    int32_t inner_edge[PIECES_MAX];  /* [ninner] */
    int32_t spare;                   /* the edge between green halves, NONE once it is used again */
    int next_inner;
} Pattern;

/* The number of an edge between two points that are on no side together. */
static int inner_edge(Pass *p, Pattern *q, int a, int b)
{
    for (int i = 0; i < q->ninner; i++)
        if (q->inner[i][0] == b && q->inner[i][1] == a) return q->inner_edge[i];
    int e = q->spare != NONE ? q->spare : q->next_inner++;
    q->spare = NONE;
    q->inner[q->ninner][0] = (uint8_t)a, q->inner[q->ninner][1] = (uint8_t)b;
    make_fresh(p, e);
    return q->inner_edge[q->ninner++] = e;
}

/* The number of the edge from point a to point b. */
static int piece_edge(const Cut *c, Pattern *q, int a, int b)
{
    /* the side that both points are on, by its midpoint, or 0; of green triangles 0-3 and 3-1 are sides of their own */
    static const uint8_t SIDE[2][WHOLE_POINTS][WHOLE_POINTS] = {
        {{0, 3, 5, 3, 0, 5}, {3, 0, 4, 3, 4}, {5, 4, 0, 0, 4, 5}, {3, 3}, {0, 4, 4}, {5, 0, 5}},
        {{0, 0, 5, 6, 0, 5, 6}, {0, 0, 4, 7, 4, 0, 0, 7}, {5, 4, 0, 0, 4, 5}, {6, 7, 0, 0, 0, 0, 6, 7}, {0, 4, 4}, {5, 0, 5}, {6, 0, 0, 6}, {0, 7, 0, 7}},
    };
    static const uint8_t END[WHOLE_POINTS][2] = {{0}, {0}, {0}, {0, 1}, {1, 2}, {2, 0}, {0, 3}, {3, 1}};
    int i = SIDE[q->whole.ntri == 2][a][b];
    if (i == 0) return inner_edge(c->p, q, a, b);
    if (!(q->marks >> (i - 3) & 1)) return q->whole.edge[i];
    int end = q->vert[a == i ? b : a];
    return end == int_min(q->vert[END[i][0]], q->vert[END[i][1]]) ? q->whole.edge[i] : c->first_half + q->vert[i] - c->first_vert;
}

static void put_piece(const Cut *c, Pattern *q, int t, const uint8_t corner[3])
{
    Pass *p = c->p;
    for (int k = 0; k < 3; k++) p->tri[3 * t + k] = q->vert[corner[k]];
    for (int k = 0; k < 3; k++) {
        int a = corner[k], b = corner[(k + 1) % 3], e = piece_edge(c, q, a, b), s = q->vert[a] > q->vert[b];
        p->edge_of[3 * t + k] = e;
        p->half[e][s] = 3 * t + k;
        p->note[e].stirred[s] = 1;
        p->note[e].asked[s] = 0;
    }
}

static void cut_whole(const Cut *c, int i)
{
    Pass *p = c->p;
    int first = p->whole[i];
    Pattern q;
    q.whole = whole_of(p, first);
    q.marks = p->marks[i];
    q.ninner = 0;
    q.next_inner = c->first_inner + c->at[i];
    const Whole *w = &q.whole;
    const Pieces *pieces = whole_pieces(p, w, q.marks, (p->state[first] & TRI_OTHER_DIAGONAL) != 0);
    int32_t then = p->after[w->tri[w->ntri - 1]];
    uint32_t way = p->way[first];
    q.spare = w->ntri == 2 ? p->edge_of[3 * first + 1] : NONE;
    for (int k = 0; k < WHOLE_POINTS; k++) q.vert[k] = k >= 3 && q.marks >> (k - 3) & 1 ? p->mid[w->edge[k]] : w->vert[k];
    for (int k = pieces->n - 1; k >= 0; k--) {
        int t = k < w->ntri ? w->tri[k] : c->first_tri + c->at[i] + k - w->ntri;
        put_piece(c, &q, t, pieces->corner[k]);
        p->parent[t] = p->parent[first];
        p->way[t] = way | (uint32_t)k << WAY_BITS * (PASSES_MAX - 1 - p->number);
        p->green[t] = pieces->green[k];
        p->state[t] = TRI_NEW;
        p->after[t] = then;
        then = t;
    }
}

static void cut_block(void *ctx, int begin, int end)
{
    const Cut *c = ctx;
    for (int i = begin; i < end; i++) {
        if (c->p->marks[i]) cut_whole(c, i);
        else c->p->state[c->p->whole[i]] &= TRI_LASTING;
    }
}

static void halve_block(void *ctx, int begin, int end)
{
    const Cut *c = ctx;
    for (int i = begin; i < end; i++) {
        make_fresh(c->p, c->p->list[i]);
        make_fresh(c->p, c->first_half + i);
    }
}

int pass_cut(Pass *p, Refine *now, int32_t *next_id)
{
    list_cut(p);
    sort_list(p);
    int added = p->nlist, tris = 0;
    Cut c = {p, p->m->nvert, p->nedge, p->nedge + added, p->ntri, NEW(int32_t, p->nwhole)};
    add_midpoints(p, now, next_id);
    for (int i = 0; i < p->nwhole; i++) {
        c.at[i] = tris;
        for (int marks = p->marks[i]; marks; marks &= marks - 1) tris++;
    }
    ASSERT(tris == 2 * added); /* each edge has two sides */
    pass_reserve(p, 2 * added, 3 * added);
    parallel_for(p->nwhole, LIST_GRAIN, cut_block, &c);
    parallel_for(added, GRAIN, halve_block, &c);
    p->ntri += 2 * added;
    p->nedge += 3 * added;
    mem_free(c.at);
    return added;
}

/* --- in order -------------------------------------------------------------------------------------------------------------- */

typedef struct Order {
    Pass *p;
    int32_t *first; /* [blocks] of mechanical triangles: how many pieces, then how many come before */
} Order;

static void count_block(void *ctx, int begin, int end)
{
    const Order *o = ctx;
    int n = 0;
    for (int t = begin; t < end; t++)
        for (int s = t; s != NONE; s = o->p->after[s]) n++;
    o->first[begin / GRAIN] = n;
}

static void finish_block(void *ctx, int begin, int end)
{
    const Order *o = ctx;
    const Pass *p = o->p;
    RefinedMesh *m = p->m;
    int n = o->first[begin / GRAIN];
    for (int t = begin; t < end; t++)
        for (int s = t; s != NONE; s = p->after[s], n++) {
            for (int k = 0; k < 3; k++) m->tri[3 * n + k] = p->tri[3 * s + k];
            m->parent[n] = t;
            m->green[n] = p->green[s];
        }
}

void pass_finish(Pass *p)
{
    int top = p->m->ntri, blocks = (top + GRAIN - 1) / GRAIN, n = 0;
    Order o = {p, NEW(int32_t, blocks)};
    parallel_for(top, GRAIN, count_block, &o);
    for (int b = 0; b < blocks; b++) {
        int pieces = o.first[b];
        o.first[b] = n;
        n += pieces;
    }
    ASSERT(n == p->ntri);
    refined_reserve_tris(p->m, n);
    p->m->ntri = n;
    parallel_for(top, GRAIN, finish_block, &o);
    mem_free(o.first);
}
