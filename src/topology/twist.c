/* twist.c: does what is kept of the mesh meet the patches in the same order around every vertex? */
#include "topology/graft_priv.h"

#include <string.h>

/* The seams between what is kept and what is not, clockwise around a vertex. */
typedef struct Spokes {
    int n, cap;
    int32_t *seam;
    bool kept;    /* something is */
} Spokes;

static void add_spoke(Spokes *k, int seam)
{
    RESERVE(k->seam, k->cap, k->n + 1);
    k->seam[k->n++] = seam;
}

static void find_mesh_spokes(const Graft *g, int v, Spokes *k)
{
    const Mesh *m = g->mesh;
    int h = m->out[v];
    k->n = 0;
    k->kept = false;
    do {
        bool kept = graft_keeps(g, h / 3);
        k->kept = k->kept || kept;
        if (kept != graft_keeps(g, m->opp[h] / 3)) add_spoke(k, g->seam_of[h]);
    } while ((h = he_around(m, h)) != m->out[v]);
}

static void find_sheet_spokes(const Graft *g, int v, Spokes *k)
{
    const Sheet *s = &g->sheet;
    k->n = 0;
    k->kept = false;
    for (int h = s->out[v]; h != NONE; h = sheet_around(s, v, h)) {
        bool kept = !g->patch[g->region.of[h / 3]];
        k->kept = k->kept || kept;
        if (s->opp[h] != NONE && kept == g->patch[g->region.of[s->opp[h] / 3]]) add_spoke(k, s->seam[h] >> 1);
    }
}

static bool are_same_spokes(const Spokes *a, const Spokes *b)
{
    int turn = 0;
    if (a->n != b->n || a->kept != b->kept) return false;
    while (turn < b->n && b->seam[turn] != a->seam[0]) turn++;
    for (int i = 0; i < a->n; i++)
        if (a->seam[i] != b->seam[(turn + i) % b->n]) return false;
    return true;
}

/* A piece that comes to a vertex more than once may do so in another order on the sheet, where it is folded there: sewn, two umbrellas
 * would share the vertex. */
static bool is_twisted(const Graft *g, int v, Spokes *mesh, Spokes *sheet)
{
    find_mesh_spokes(g, v, mesh);
    if (!mesh->kept) return false;
    find_sheet_spokes(g, g->pinned[v], sheet);
    return !are_same_spokes(mesh, sheet);
}

bool graft_find_twisted(const Graft *g, uint8_t *around)
{
    const Mesh *m = g->mesh;
    bool any = false;
    Spokes mesh = {0}, sheet = {0};
    memset(around, 0, (size_t)m->ntri);
    for (int v = 0; v < m->nvert; v++) {
        if (g->pinned[v] < 0 || !is_twisted(g, v, &mesh, &sheet)) continue;
        int h = m->out[v];
        do around[h / 3] = 1;
        while ((h = he_around(m, h)) != m->out[v]);
        any = true;
    }
    mem_free(mesh.seam);
    mem_free(sheet.seam);
    return any;
}
