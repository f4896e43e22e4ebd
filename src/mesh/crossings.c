#include "mesh/crossings.h"

#include <string.h>

enum { GONE_MAX = 256 }; /* vertices gone in a row; more are not found again, which costs time alone */

/* to[c->nvert]: where each vertex is now, if it is what it was; else NONE. Renumbering keeps order, and what is new comes last. */
static void find_verts(const Crossings *c, const Mesh *m, int32_t *to)
{
    int shift = 0;
    for (int i = 0; i < c->nvert; i++) to[i] = NONE;
    for (int v = 0; v < m->nvert; v++) {
        int end = int_min(c->nvert, v + shift + GONE_MAX), i = v + shift;
        while (i < end && c->id[i] != m->id[v]) i++;
        if (i >= end) continue;
        shift = i - v;
        if (v_len2(v_sub(c->pos[i], m->pos[v])) == 0) to[i] = v;
    }
}

/* The triangle a, b, c, or NONE. */
static int find_triangle(const Mesh *m, int a, int b, int c)
{
    int h = m->out[a];
    if (h == NONE) return NONE;
    do
        if (he_to(m, h) == b && m->corner[he_prev(h)] == c) return h / 3;
    while ((h = he_around(m, h)) != m->out[a]);
    return NONE;
}

/* to[c->ntri]: where each triangle is now, if it is what it was; else NONE. look[m->ntri]: those that were not there. Returns how many. */
static int find_tris(const Crossings *c, const Mesh *m, int32_t *to, uint8_t *look)
{
    int32_t *vert_to = NEW(int32_t, c->nvert);
    int count = 0;
    find_verts(c, m, vert_to);
    for (int t = 0; t < m->ntri; t++) count += look[t] = !tri_is_dead(m, t);
    for (int t = 0; t < c->ntri; t++) {
        const int32_t *q = c->corner + 3 * t;
        to[t] = NONE;
        if (q[0] == NONE || vert_to[q[0]] == NONE || vert_to[q[1]] == NONE || vert_to[q[2]] == NONE) continue;
        to[t] = find_triangle(m, vert_to[q[0]], vert_to[q[1]], vert_to[q[2]]);
        if (to[t] != NONE) count -= look[to[t]], look[to[t]] = 0;
    }
    mem_free(vert_to);
    return count;
}

static void remember(Crossings *c, const Mesh *m)
{
    c->nvert = m->nvert;
    c->ntri = m->ntri;
    if (m->ntri == 0) return;
    RESERVE(c->pos, c->cappos, m->nvert);
    RESERVE(c->id, c->capid, m->nvert);
    RESERVE(c->corner, c->capcorner, 3 * m->ntri);
    memcpy(c->pos, m->pos, (size_t)m->nvert * sizeof *c->pos);
    memcpy(c->id, m->id, (size_t)m->nvert * sizeof *c->id);
    memcpy(c->corner, m->corner, 3 * (size_t)m->ntri * sizeof *c->corner);
}

/* Keeps the pairs of triangles that are what they were. */
static void keep_pairs(Crossings *c, const int32_t *to)
{
    int n = 0;
    for (int i = 0; i < c->n; i++) {
        int a = to[c->pair[i].a], b = to[c->pair[i].b];
        if (a != NONE && b != NONE) c->pair[n++] = (TriPair){int_min(a, b), int_max(a, b)};
    }
    c->n = n;
}

static void add_pairs(Crossings *c, const Mesh *m, const uint8_t *look)
{
    TriPair *pair = NULL;
    int cap = 0, n = intersect_find(&(TriSoup){m->ntri, m->pos, m->corner}, look, &pair, &cap);
    RESERVE(c->pair, c->cap, c->n + n);
    if (n) memcpy(c->pair + c->n, pair, (size_t)n * sizeof *pair);
    c->n += n;
    mem_free(pair);
}

static bool is_same(const Crossings *c, const Mesh *m)
{
    if (c->nvert != m->nvert || c->ntri != m->ntri || m->ntri == 0) return false;
    return !memcmp(c->id, m->id, (size_t)m->nvert * sizeof *c->id) && !memcmp(c->corner, m->corner, 3 * (size_t)m->ntri * sizeof *c->corner) &&
           !memcmp(c->pos, m->pos, (size_t)m->nvert * sizeof *c->pos);
}

int crossings_find(Crossings *c, const Mesh *m)
{
    if (is_same(c, m)) return c->n;
    int32_t *to = NEW(int32_t, c->ntri);
    uint8_t *look = NEW(uint8_t, m->ntri);
    int fresh = find_tris(c, m, to, look);
    keep_pairs(c, to);
    if (fresh) add_pairs(c, m, fresh == m->ntri - m->deadtri ? NULL : look);
    pairs_sort(c->n, c->pair);
    remember(c, m);
    mem_free(to);
    mem_free(look);
    return c->n;
}

void crossings_free(Crossings *c)
{
    mem_free(c->pair);
    mem_free(c->pos);
    mem_free(c->id);
    mem_free(c->corner);
    *c = (Crossings){0};
}
