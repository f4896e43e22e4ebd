/* withdraw.c: marks that would do harm. */
#include "refine/refine_priv.h"

#include "base/thread.h"

#define FACING_MIN 0.1        /* mean cosine of a piece's normal to the surface's; a triangle is not cut into less */
#define QUALITY_MIN 0.03      /* |2 area| / (sum of squared edges) of a piece; 0.29 is equilateral */

/* 2 r_in / r_circ: 1 is equilateral. */
static double aspect(const Vec3 q[3])
{
    double a = v_dist(q[0], q[1]), b = v_dist(q[1], q[2]), c = v_dist(q[2], q[0]), product = (a + b + c) * a * b * c;
    return product > 0 ? 4 * v_len2(v_area2(q[0], q[1], q[2])) / product : 0;
}

/* Faults of a triangle's shape, as bits: a whole that has one lets its pieces have it too. */
enum { TURNED = 1, NEEDLE = 2, SLIM = 4 };

static int faults_of(const Vec3 q[3], const Vec3 n[3], double min_aspect)
{
    Vec3 a = v_area2(q[0], q[1], q[2]);
    double area2 = v_len(a), sum = v_len2(v_sub(q[1], q[0])) + v_len2(v_sub(q[2], q[1])) + v_len2(v_sub(q[0], q[2]));
    int faults = v_dot(a, v_add(v_add(n[0], n[1]), n[2])) < 3 * FACING_MIN * area2 ? TURNED : 0;
    if (area2 < QUALITY_MIN * sum) faults |= NEEDLE;
    if (min_aspect > 0 && aspect(q) < min_aspect) faults |= SLIM;
    return faults;
}

/* A whole's corners and midpoints. */
typedef struct Points {
    Vec3 pos[WHOLE_POINTS], normal[WHOLE_POINTS];
} Points;

static void find_points(const Pass *p, const Whole *w, Points *at)
{
    for (int i = 0; i < WHOLE_POINTS; i++) {
        int v = w->vert[i], e = w->edge[i];
        if (v != NONE) {
            at->pos[i] = p->m->pos[v];
            at->normal[i] = p->m->normal[v];
        } else if (e != NONE && p->marked[e]) {
            const Midpoint *mid = &p->midpoint[p->mid[e]];
            at->pos[i] = mid->pos;
            at->normal[i] = mid->normal;
        }
    }
}

static void take_corners(const Points *at, const uint8_t c[3], Vec3 pos[3], Vec3 normal[3])
{
    for (int k = 0; k < 3; k++) pos[k] = at->pos[c[k]], normal[k] = at->normal[c[k]];
}

/* Of all pieces together. */
static int faults_of_pieces(const Pieces *q, const Points *at, double min_aspect)
{
    int faults = 0;
    for (int i = 0; i < q->n; i++) {
        Vec3 pos[3], normal[3];
        take_corners(at, q->corner[i], pos, normal);
        faults |= faults_of(pos, normal, min_aspect);
    }
    return faults;
}

/* A piece without an area counts. */
static bool is_any_inverted(const Field *f, const Pieces *q, const Points *at)
{
    for (int i = 0; i < q->n; i++) {
        const Vec3 *a = &at->pos[q->corner[i][0]], *b = &at->pos[q->corner[i][1]], *c = &at->pos[q->corner[i][2]];
        if (!(v_len2(v_area2(*a, *b, *c)) > 0) || field_triangle_inverted(f, *a, *b, *c)) return true;
    }
    return false;
}

/* The least that its pieces may have: a slim whole may be cut into what is no slimmer. */
static double aspect_limit(const Pass *p, const Pieces *whole, const Points *at)
{
    double limit = p->set->min_aspect;
    for (int i = 0; i < whole->n && limit > 0; i++) {
        Vec3 pos[3], normal[3];
        take_corners(at, whole->corner[i], pos, normal);
        limit = real_min(limit, aspect(pos));
    }
    return limit;
}

/* Of the two diagonals the one between the more alike normals lies along the lesser curvature (GI'07 section 3). */
static bool prefers_other_diagonal(int marks, const Vec3 normal[6])
{
    int turn = marks == 6 ? 1 : marks == 5 ? 2 : 0; /* diagonals: corner 0 - midpoint 4, midpoint 3 - corner 2 */
    return v_dot(normal[turn], normal[3 + (1 + turn) % 3]) < v_dot(normal[3 + turn], normal[(2 + turn) % 3]);
}

/* TRI_... of a whole under the marks of its edges. */
static uint8_t judge(const Pass *p, const Whole *w, int marks)
{
    Points at;
    find_points(p, w, &at);
    bool two = w->ntri == 1 && (marks == 3 || marks == 5 || marks == 6), other = two && prefers_other_diagonal(marks, at.normal);
    const uint8_t chosen = other ? TRI_OTHER_DIAGONAL : 0;
    const Pieces *uncut = whole_pieces(p, w, 0, false), *cut = whole_pieces(p, w, marks, other);
    double limit = aspect_limit(p, uncut, &at);
    int faults = faults_of_pieces(cut, &at, limit);
    bool inverted = !faults && is_any_inverted(p->field, cut, &at);
    if (!faults && !inverted) return chosen;
    int allowed = faults_of_pieces(uncut, &at, limit);
    if (two) {
        const Pieces *swapped = whole_pieces(p, w, marks, !other);
        if (!(faults_of_pieces(swapped, &at, limit) & ~allowed) && !is_any_inverted(p->field, swapped, &at)) return TRI_OTHER_DIAGONAL - chosen;
    }
    return inverted || (faults & ~allowed) || is_any_inverted(p->field, cut, &at) ? chosen | TRI_BAD : chosen;
}

static void judge_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int i = begin; i < end; i++) {
        int t = p->whole[i];
        if (!(p->state[t] & TRI_CHECK)) continue;
        Whole w = whole_of(p, t);
        int marks = whole_marks(p, &w);
        p->marks[i] = (uint8_t)marks;
        p->state[t] = (p->state[t] & TRI_LASTING) | (marks ? judge(p, &w, marks) : 0);
    }
}

/* Takes the marks of a whole back, or lays their midpoints flat. Returns whether there were any left. */
static bool withdraw(Pass *p, const Whole *w)
{
    bool any = false, keep = p->set->scheme == REFINE_SCHEME_RED_GREEN;
    for (int i = 3; i < WHOLE_POINTS; i++) {
        int e = w->edge[i];
        if (e == NONE || !p->marked[e] || (keep && p->mid_state[e] == MID_FLAT)) continue;
        if (keep) pass_flatten(p, e);
        else p->marked[e] = 0;
        any = true;
        for (int s = 0; s < 2; s++) p->state[whole_first(p, edge_side(p, e, s))] |= TRI_CHECK;
    }
    return any;
}

/* Those with a marked edge. */
static void find_wholes(Pass *p)
{
    p->nwhole = 0;
    if (2 * p->nlist > p->capwhole) {
        p->capwhole = 2 * p->nlist;
        RESIZE(p->whole, p->capwhole);
        RESIZE(p->marks, p->capwhole);
    }
    for (int i = 0; i < p->nlist; i++)
        for (int s = 0; s < 2; s++) {
            int t = whole_first(p, edge_side(p, p->list[i], s));
            if (p->state[t] & TRI_CHECK) continue;
            p->state[t] |= TRI_CHECK;
            p->whole[p->nwhole++] = t;
        }
}

void pass_withdraw(Pass *p)
{
    find_wholes(p);
    for (bool again = true; again;) {
        parallel_for(p->nwhole, LIST_GRAIN, judge_block, p);
        again = false;
        for (int i = 0; i < p->nwhole; i++) {
            if (!(p->state[p->whole[i]] & TRI_BAD)) continue;
            Whole w = whole_of(p, p->whole[i]);
            again = withdraw(p, &w) || again;
        }
    }
}
