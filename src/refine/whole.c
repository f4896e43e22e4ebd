/* whole.c: what is cut as one, and into what. */
#include "refine/refine_priv.h"

enum { MARK_01 = 1, MARK_12 = 2, MARK_20 = 4, MARK_03 = 8, MARK_31 = 16 };

static Whole plain_of(const Pass *p, int t)
{
    const int32_t *v = p->tri + 3 * t, *e = p->edge_of + 3 * t;
    return (Whole){1, {t, NONE}, {v[0], v[1], v[2], NONE, NONE, NONE, NONE, NONE}, {NONE, NONE, NONE, e[0], e[1], e[2], NONE, NONE}};
}

/* The halves of a green triangle are (0 3 2) and (3 1 2): each other's neighbours over 3-2. */
static int other_half(const Pass *p, int t)
{
    int h = 3 * t + (p->green[t] == 1 ? 1 : 2), e = p->edge_of[h];
    return p->half[e][p->half[e][0] == h] / 3;
}

static Whole green_of(const Pass *p, int first)
{
    int second = other_half(p, first);
    const int32_t *v = p->tri + 3 * first, *w = p->tri + 3 * second, *e = p->edge_of + 3 * first, *f = p->edge_of + 3 * second;
    ASSERT(p->green[first] == 1 && p->green[second] == 2 && v[1] == w[0] && v[2] == w[2]);
    return (Whole){2, {first, second}, {v[0], w[1], v[2], v[1], NONE, NONE, NONE, NONE}, {NONE, NONE, NONE, NONE, f[1], e[2], e[0], f[0]}};
}

int whole_first(const Pass *p, int t) { return p->green[t] == 2 ? other_half(p, t) : t; }

Whole whole_of(const Pass *p, int t) { return p->green[t] ? green_of(p, whole_first(p, t)) : plain_of(p, t); }

int whole_marks(const Pass *p, const Whole *w)
{
    int marks = 0;
    for (int i = 3; i < WHOLE_POINTS; i++)
        if (w->edge[i] != NONE) marks |= (p->marked[w->edge[i]] != 0) << (i - 3);
    return marks;
}

/* What takes a triangle's place, by the marks of edges 0-1 (1), 1-2 (2) and 2-0 (4); of the two diagonals that two marks leave, either. */
static const Pieces PLAIN[8][2] = {
    {{1, {{0, 1, 2}}, {0}}, {1, {{0, 1, 2}}, {0}}},
    {{2, {{0, 3, 2}, {3, 1, 2}}, {0}}, {2, {{0, 3, 2}, {3, 1, 2}}, {0}}},
    {{2, {{1, 4, 0}, {4, 2, 0}}, {0}}, {2, {{1, 4, 0}, {4, 2, 0}}, {0}}},
    {{3, {{3, 1, 4}, {0, 3, 4}, {0, 4, 2}}, {0}},
     {3, {{3, 1, 4}, {0, 3, 2}, {3, 4, 2}}, {0}}},
    {{2, {{2, 5, 1}, {5, 0, 1}}, {0}}, {2, {{2, 5, 1}, {5, 0, 1}}, {0}}},
    {{3, {{5, 0, 3}, {2, 5, 3}, {2, 3, 1}}, {0}},
     {3, {{5, 0, 3}, {2, 5, 1}, {5, 3, 1}}, {0}}},
    {{3, {{4, 2, 5}, {1, 4, 5}, {1, 5, 0}}, {0}},
     {3, {{4, 2, 5}, {1, 4, 0}, {4, 5, 0}}, {0}}},
    {{4, {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}, {0}},
     {4, {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}, {0}}},
};

/* Red-green: a triangle with one mark is green then. */
static const Pieces HALVED[3] = {
    {2, {{0, 3, 2}, {3, 1, 2}}, {1, 2}}, {2, {{1, 4, 0}, {4, 2, 0}}, {1, 2}}, {2, {{2, 5, 1}, {5, 0, 1}}, {1, 2}},
};

/* A green triangle: its halves as they are, or, by the marks of its own, four, of which two may be green again. */
static const Pieces GREEN = {2, {{0, 3, 2}, {3, 1, 2}}, {1, 2}};
static const Pieces QUARTERED[4] = {
    {4, {{5, 4, 2}, {3, 4, 5}, {0, 3, 5}, {3, 1, 4}}, {0}},
    {5, {{5, 4, 2}, {3, 4, 5}, {0, 6, 5}, {6, 3, 5}, {3, 1, 4}}, {0, 0, 1, 2, 0}},
    {5, {{5, 4, 2}, {3, 4, 5}, {0, 3, 5}, {3, 7, 4}, {7, 1, 4}}, {0, 0, 0, 1, 2}},
    {6, {{5, 4, 2}, {3, 4, 5}, {0, 6, 5}, {6, 3, 5}, {3, 7, 4}, {7, 1, 4}}, {0, 0, 1, 2, 1, 2}},
};

const Pieces *whole_pieces(const Pass *p, const Whole *w, int marks, bool other_diagonal)
{
    if (w->ntri == 2) return marks & MARK_12 ? &QUARTERED[marks >> 3] : &GREEN;
    bool one = marks == MARK_01 || marks == MARK_12 || marks == MARK_20;
    return one && p->set->scheme == REFINE_SCHEME_RED_GREEN ? &HALVED[marks >> 1] : &PLAIN[marks][other_diagonal];
}

bool whole_is_closed(const Whole *w, int marks)
{
    if (w->ntri == 1) return marks != 3 && marks != 5 && marks != 6;
    return marks == 0 || (marks & (MARK_12 | MARK_20)) == (MARK_12 | MARK_20);
}
