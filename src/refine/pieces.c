/* pieces.c: what takes a triangle's place, and whether that would do harm. */
#include "refine/refine_priv.h"

#include "base/thread.h"

#define FACING_MIN 0.1        /* mean cosine of a piece's normal to the surface's; a triangle is not cut into less */
#define QUALITY_MIN 0.03      /* |2 area| / (sum of squared edges) of a piece; 0.29 is equilateral */

int pieces_pattern(int marks, bool other_diagonal, uint8_t out[4][3])
{
    static const uint8_t ONE[2][3] = {{0, 3, 2}, {3, 1, 2}};
    static const uint8_t TWO[2][3][3] = {{{3, 1, 4}, {0, 3, 4}, {0, 4, 2}}, {{3, 1, 4}, {0, 3, 2}, {3, 4, 2}}};
    static const uint8_t ALL[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    static const uint8_t TURN[8] = {0, 0, 1, 0, 2, 2, 1, 0}; /* turns that bring the marks to edge 0, or to edges 0 and 1 */
    int n = marks == 0 ? 1 : marks == 7 ? 4 : marks == 1 || marks == 2 || marks == 4 ? 2 : 3, turn = TURN[marks];
    if (n == 1) {
        out[0][0] = 0, out[0][1] = 1, out[0][2] = 2;
        return 1;
    }
    const uint8_t(*from)[3] = n == 2 ? ONE : n == 3 ? TWO[other_diagonal] : ALL;
    for (int t = 0; t < n; t++)
        for (int k = 0; k < 3; k++) out[t][k] = (uint8_t)(from[t][k] < 3 ? (from[t][k] + turn) % 3 : 3 + (from[t][k] - 3 + turn) % 3);
    return n;
}

int pass_marks_of(const Pass *p, int t)
{
    int marks = 0;
    for (int k = 0; k < 3; k++) marks |= (p->marked[p->edge_of[3 * t + k]] != 0) << k;
    return marks;
}

/* Faults of a triangle, as bits: a whole that has one lets its pieces have it too. */
enum { TURNED = 1, NEEDLE = 2, INVERTED = 4 };

static int faults_of(const Field *f, const Vec3 q[3], const Vec3 n[3])
{
    Vec3 a = v_area2(q[0], q[1], q[2]);
    double area2 = v_len(a), sum = v_len2(v_sub(q[1], q[0])) + v_len2(v_sub(q[2], q[1])) + v_len2(v_sub(q[0], q[2]));
    int faults = v_dot(a, v_add(v_add(n[0], n[1]), n[2])) < 3 * FACING_MIN * area2 ? TURNED : 0;
    if (area2 < QUALITY_MIN * sum) faults |= NEEDLE;
    if (!(area2 > 0) || field_triangle_inverted(f, q[0], q[1], q[2])) faults |= INVERTED;
    return faults;
}

/* A triangle's corners and landed midpoints. */
static void six_points(const Pass *p, int t, Vec3 pos[6], Vec3 normal[6])
{
    for (int k = 0; k < 3; k++) {
        int v = p->m->tri[3 * t + k], e = p->edge_of[3 * t + k];
        pos[k] = p->m->pos[v], normal[k] = p->m->normal[v];
        pos[3 + k] = p->mid_pos[e], normal[3 + k] = p->mid_normal[e];
    }
}

static int faults_of_pattern(const Field *f, int marks, bool other, const Vec3 pos[6], const Vec3 normal[6])
{
    uint8_t part[4][3];
    int n = pieces_pattern(marks, other, part), faults = 0;
    for (int i = 0; i < n; i++) {
        const uint8_t *c = part[i];
        faults |= faults_of(f, (Vec3[3]){pos[c[0]], pos[c[1]], pos[c[2]]}, (Vec3[3]){normal[c[0]], normal[c[1]], normal[c[2]]});
    }
    return faults;
}

/* Of the two diagonals the one between the more alike normals lies along the lesser curvature (GI'07 section 3). */
static bool prefers_other_diagonal(int marks, const Vec3 normal[6])
{
    int turn = marks == 6 ? 1 : marks == 5 ? 2 : 0; /* diagonals: corner 0 - midpoint 4, midpoint 3 - corner 2 */
    return v_dot(normal[turn], normal[3 + (1 + turn) % 3]) < v_dot(normal[3 + turn], normal[(2 + turn) % 3]);
}

static void check_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        int marks = pass_marks_of(p, t);
        if (!(p->state[t] & TRI_CHECK)) continue;
        p->state[t] = 0;
        if (marks == 0) continue;
        Vec3 pos[6], normal[6];
        six_points(p, t, pos, normal);
        bool other = prefers_other_diagonal(marks, normal), two = marks == 3 || marks == 5 || marks == 6;
        int faults = faults_of_pattern(p->field, marks, other, pos, normal);
        if (faults) {
            int allowed = faults_of(p->field, pos, normal) & ~INVERTED;
            if (two && !(faults_of_pattern(p->field, marks, !other, pos, normal) & ~allowed)) other = !other;
            else if (faults & ~allowed) p->state[t] |= TRI_BAD;
        }
        if (other) p->state[t] |= TRI_OTHER_DIAGONAL;
    }
}

void pass_withdraw(Pass *p)
{
    int n = p->m->ntri;
    for (int t = 0; t < n; t++) p->state[t] = TRI_CHECK;
    for (bool again = true; again;) {
        parallel_for(n, GRAIN, check_block, p);
        again = false;
        for (int t = 0; t < n; t++) {
            if (!(p->state[t] & TRI_BAD)) continue;
            for (int k = 0; k < 3; k++) {
                int e = p->edge_of[3 * t + k];
                if (!p->marked[e]) continue;
                p->marked[e] = 0;
                again = true;
                p->state[p->side[e][0]] |= TRI_CHECK;
                p->state[p->side[e][1]] |= TRI_CHECK;
            }
        }
    }
}
