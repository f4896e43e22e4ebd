/* balance.c: do patches have the topology of what they replace? */
#include "topology/graft_priv.h"

/* Twice V - E + F, summed over sets of triangles: an edge inside a set is met twice, one of its border once. */
static void add_euler(int32_t *twice, int set, bool border, bool new_vertex, bool new_triangle)
{
    twice[set] += 2 * (new_vertex + new_triangle) - (border ? 2 : 1);
}

/* The dropped triangles that hang together are a hole, numbered from 0; of[ntri]. Adds up each one's Euler characteristic. */
static int number_holes(const Graft *g, int32_t *of, int32_t *twice)
{
    const Mesh *m = g->mesh;
    int32_t *stack = NEW(int32_t, m->ntri), *seen = NEW(int32_t, m->nvert);
    int holes = 0;
    for (int t = 0; t < m->ntri; t++) of[t] = NONE;
    for (int v = 0; v < m->nvert; v++) seen[v] = NONE;
    for (int s = 0; s < m->ntri; s++) {
        if (!g->drop[s] || of[s] != NONE) continue;
        int n = 0;
        stack[n++] = s;
        of[s] = holes;
        twice[holes] = 0;
        while (n) {
            int t = stack[--n];
            for (int h = 3 * t; h < 3 * t + 3; h++) {
                int u = m->opp[h] / 3, v = m->corner[h];
                add_euler(twice, holes, !g->drop[u], seen[v] != holes, h == 3 * t);
                seen[v] = holes;
                if (!g->drop[u] || of[u] != NONE) continue;
                of[u] = holes;
                stack[n++] = u;
            }
        }
        holes++;
    }
    mem_free(stack);
    mem_free(seen);
    return holes;
}

static int root_of(int32_t *up, int a)
{
    while (up[a] != a) a = up[a] = up[up[a]];
    return a;
}

int graft_compare(Graft *g)
{
    const Mesh *m = g->mesh;
    const Sheet *s = &g->sheet;
    int32_t *hole_of = NEW(int32_t, m->ntri), *twice = NEW0(int32_t, m->ntri + g->nregion), *seen = NEW(int32_t, s->nvert);
    int holes = number_holes(g, hole_of, twice), n = holes + g->nregion, failed = 0;
    int32_t *up = NEW(int32_t, n), *balance = NEW0(int32_t, n);
    for (int k = 0; k < n; k++) up[k] = k;
    for (int k = holes; k < n; k++) twice[k] = 0;
    for (int v = 0; v < s->nvert; v++) seen[v] = NONE;
    for (int t = 0; t < s->ntri; t++)
        for (int h = 3 * t; h < 3 * t + 3 && s->region[t] != REGION_NONE; h++) {
            int k = holes + s->region[t], v = s->corner[h];
            add_euler(twice, k, s->seam[h] != SEAM_NONE, seen[v] != k, h == 3 * t);
            seen[v] = k;
            if (s->seam[h] == SEAM_NONE) continue;
            int a = root_of(up, k), b = root_of(up, hole_of[m->opp[g->seam[s->seam[h] >> 1].half_edge] / 3]);
            up[int_max(a, b)] = int_min(a, b);
        }
    for (int k = 0; k < n; k++) balance[root_of(up, k)] += k < holes ? twice[k] : -twice[k];
    for (int i = 0; i < g->nseam; i++) {
        int a = g->seam[i].a, b = g->seam[i].b;
        if (g->plan->wrong[g->plan->comp[a]] || balance[root_of(up, hole_of[m->opp[g->seam[i].half_edge] / 3])] == 0) continue;
        g->grow[a] = g->grow[b] = 1;
        failed++;
    }
    mem_free(hole_of);
    mem_free(twice);
    mem_free(seen);
    mem_free(up);
    mem_free(balance);
    return failed;
}
