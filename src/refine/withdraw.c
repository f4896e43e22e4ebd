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

/* Faults of a triangle, as bits: a whole that has one lets its pieces have it too. */
enum { TURNED = 1, NEEDLE = 2, INVERTED = 4, SLIM = 8 };

static int faults_of(const Field *f, const Vec3 q[3], const Vec3 n[3], double min_aspect)
{
    Vec3 a = v_area2(q[0], q[1], q[2]);
    double area2 = v_len(a), sum = v_len2(v_sub(q[1], q[0])) + v_len2(v_sub(q[2], q[1])) + v_len2(v_sub(q[0], q[2]));
    int faults = v_dot(a, v_add(v_add(n[0], n[1]), n[2])) < 3 * FACING_MIN * area2 ? TURNED : 0;
    if (area2 < QUALITY_MIN * sum) faults |= NEEDLE;
    if (!(area2 > 0) || field_triangle_inverted(f, q[0], q[1], q[2])) faults |= INVERTED;
    if (min_aspect > 0 && aspect(q) < min_aspect) faults |= SLIM;
    return faults;
}

/* A whole's corners and landed midpoints. */
typedef struct Points {
    Vec3 pos[WHOLE_POINTS], normal[WHOLE_POINTS];
} Points;

static Points points_of(const Pass *p, const Whole *w)
{
    Points at;
    for (int i = 0; i < WHOLE_POINTS; i++) {
        int v = w->vert[i], e = w->edge[i];
        at.pos[i] = v != NONE ? p->m->pos[v] : e != NONE ? p->mid_pos[e] : vec3(0, 0, 0);
        at.normal[i] = v != NONE ? p->m->normal[v] : e != NONE ? p->mid_normal[e] : vec3(0, 0, 0);
    }
    return at;
}

static void take_corners(const Points *at, const uint8_t c[3], Vec3 pos[3], Vec3 normal[3])
{
    for (int k = 0; k < 3; k++) pos[k] = at->pos[c[k]], normal[k] = at->normal[c[k]];
}

/* Of all pieces together. */
static int faults_of_pieces(const Field *f, const Pieces *q, const Points *at, double min_aspect)
{
    int faults = 0;
    for (int i = 0; i < q->n; i++) {
        Vec3 pos[3], normal[3];
        take_corners(at, q->corner[i], pos, normal);
        faults |= faults_of(f, pos, normal, min_aspect);
    }
    return faults;
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
    Points at = points_of(p, w);
    bool two = w->ntri == 1 && (marks == 3 || marks == 5 || marks == 6), other = two && prefers_other_diagonal(marks, at.normal);
    Pieces uncut = whole_pieces(p, w, 0, false), cut = whole_pieces(p, w, marks, other), swapped;
    double limit = aspect_limit(p, &uncut, &at);
    int faults = faults_of_pieces(p->field, &cut, &at, limit);
    uint8_t state = 0;
    if (faults) {
        int allowed = faults_of_pieces(p->field, &uncut, &at, limit) & ~INVERTED;
        if (two) swapped = whole_pieces(p, w, marks, !other);
        if (two && !(faults_of_pieces(p->field, &swapped, &at, limit) & ~allowed)) other = !other;
        else if (faults & ~allowed) state = TRI_BAD;
    }
    return other ? state | TRI_OTHER_DIAGONAL : state;
}

static void judge_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        if (!(p->state[t] & TRI_CHECK)) continue;
        Whole w = whole_of(p, t);
        int marks = whole_marks(p, &w);
        p->state[t] = marks ? judge(p, &w, marks) : 0;
    }
}

/* The triangles of the whole that t belongs to are to be judged again. */
static void call_again(Pass *p, int t)
{
    Whole w = whole_of(p, t);
    for (int i = 0; i < w.ntri; i++) p->state[w.first + i] |= TRI_CHECK;
}

/* Takes the marks of a whole back, or lays their midpoints flat. Returns whether there were any left. */
static bool withdraw(Pass *p, const Whole *w)
{
    bool any = false, keep = p->set->scheme == REFINE_SCHEME_RED_GREEN;
    for (int h = 3 * w->first; h < 3 * (w->first + w->ntri); h++) {
        int e = p->edge_of[h];
        if (!p->marked[e] || (keep && p->mid_state[e] == MID_FLAT)) continue;
        if (keep) pass_flatten(p, e);
        else p->marked[e] = 0;
        any = true;
        for (int s = 0; s < 2; s++) call_again(p, p->side[e][s]);
    }
    return any;
}

void pass_withdraw(Pass *p)
{
    int n = p->m->ntri;
    for (int t = 0; t < n; t++) p->state[t] = TRI_CHECK;
    for (bool again = true; again;) {
        parallel_for(n, GRAIN, judge_block, p);
        again = false;
        for (int t = 0; t < n; t++) {
            if (!(p->state[t] & TRI_BAD)) continue;
            Whole w = whole_of(p, t);
            again = withdraw(p, &w) || again;
        }
    }
}
