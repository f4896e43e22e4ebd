/* sew.c: the patches take the place of what was dropped. */
#include "topology/graft_priv.h"

#define SURVIVOR_REACH_VOX 0.3
#define SURVIVOR_APART 0.5 /* of the edge wanted: nearer to another kept vertex a dropped one stays dropped */

int graft_pin_survivors(Graft *g)
{
    const Mesh *m = g->mesh;
    const double apart = SURVIVOR_APART * g->plan->edge, reach = SURVIVOR_REACH_VOX * g->iso->field->voxel;
    int n = 0;
    uint8_t *kept = NEW0(uint8_t, m->nvert);
    for (int h = 0; h < 3 * m->ntri; h++) kept[m->corner[h]] |= !g->drop[h / 3];
    for (int v = 0; v < m->nvert; v++) {
        if (kept[v] || g->plan->comp[v] == NONE) continue;
        if (g->pinned[v] >= 0) { /* a seam led through it */
            n += g->sheet.region[g->sheet.out[g->pinned[v]] / 3] != REGION_NONE;
            continue;
        }
        Vec3 normal;
        field_normals(g->iso->field, 1, &m->pos[v], &normal);
        n += sheet_pin(&g->sheet, v, m->pos[v], normal, g->plan->comp[v], reach, apart, true) != NONE;
    }
    mem_free(kept);
    return n;
}

typedef struct Cloth {
    int nvert, capvert, ntri, captri;
    Vec3 *pos;       /* [nvert] new vertices */
    int32_t *tri;    /* [3*ntri] mesh vertices; from mesh->nvert on the new ones */
    int32_t *as;     /* [sheet.nvert] mesh vertex or NONE */
} Cloth;

static int cloth_vertex(Graft *g, Cloth *c, int v)
{
    if (c->as[v] == NONE) {
        RESERVE(c->pos, c->capvert, c->nvert + 1);
        c->as[v] = g->mesh->nvert + c->nvert;
        c->pos[c->nvert++] = g->sheet.pos[v];
    }
    return c->as[v];
}

static void cloth_triangle(Cloth *c, int a, int b, int d)
{
    RESERVE(c->tri, c->captri, 3 * (c->ntri + 1));
    int32_t *t = c->tri + 3 * c->ntri++;
    t[0] = a, t[1] = b, t[2] = d;
}

/* A kept triangle whose sides are seams, as a fan over the seams' vertices: side k has seam[k], or NONE. */
static void sew_side(Graft *g, Cloth *c, const int corner[3], const int seam[3])
{
    int k = 0;
    while (k < 3 && seam[k] == NONE) k++;
    if (k == 3) {
        cloth_triangle(c, corner[0], corner[1], corner[2]);
        return;
    }
    const Seam *s = &g->seam[seam[k]];
    int b = corner[(k + 1) % 3], tip = corner[(k + 2) % 3], at = corner[k];
    for (int i = 0; i <= s->npath; i++) {
        int to = i < s->npath ? cloth_vertex(g, c, g->path[s->path + i]) : b;
        sew_side(g, c, (int[3]){at, to, tip}, (int[3]){NONE, i == s->npath ? seam[(k + 1) % 3] : NONE, i == 0 ? seam[(k + 2) % 3] : NONE});
        at = to;
    }
}

/* --- cuts mended ----------------------------------------------------------------------------------------------------------- */

#define STRAIGHT 1e-6 /* a cut's vertex is this near to the edge it was put on, in its lengths */
#define TURN_COS 0.8  /* cosine: a triangle turns no farther where a vertex is taken out */

/* Would no triangle around to(h), joined into from(h), turn much? */
static bool stays_flat(const Mesh *m, int h)
{
    int a = he_from(m, h), b = he_to(m, h), k = m->out[b];
    do {
        int p = he_to(m, k), q = m->corner[he_prev(k)];
        if (p == a || q == a) continue;
        Vec3 was = v_area2(m->pos[b], m->pos[p], m->pos[q]), is = v_area2(m->pos[a], m->pos[p], m->pos[q]);
        double d = v_dot(was, is);
        if (!(d > 0) || d * d < TURN_COS * TURN_COS * v_len2(was) * v_len2(is)) return false;
    } while ((k = he_around(m, k)) != m->out[b]);
    return true;
}

/* Joins b into a, its neighbour, where that does no harm. */
static bool try_join(Mesh *m, int a, int b)
{
    int h = mesh_find_edge(m, a, b);
    if (h == NONE || !stays_flat(m, h) || !mesh_can_collapse(m, h)) return false;
    mesh_collapse_edge(m, h, m->pos[a]);
    return true;
}

/* The vertices between a live seam's ends are joined, one after the other, into what is left before or behind them: where all go, the
 * kept triangle is again what it was. */
static void straighten_seam(const Graft *g, const Seam *s, const int32_t *as)
{
    Mesh *m = g->mesh;
    int n = s->npath, at[SEAM_MAX + 2];
    for (int i = 0; i < n; i++) at[i + 1] = as[g->path[s->path + i]];
    at[0] = s->a, at[n + 1] = s->b;
    for (int pass = 0; pass < 2; pass++) {
        int k = 1;
        for (int i = 1; i <= n; i++)
            if (!try_join(m, at[k - 1], at[i]) && !try_join(m, at[i + 1], at[i])) at[k++] = at[i];
        at[k] = s->b;
        n = k - 1;
    }
}

static void straighten_seams(const Graft *g, const int32_t *as)
{
    for (int i = 0; i < g->nseam; i++)
        if (g->seam[i].live && g->seam[i].npath > 0) straighten_seam(g, &g->seam[i], as);
}

/* If v, with four neighbours, lies on the straight line between two opposite ones, the half-edge from one of them to v; or NONE. */
static int find_cut_edge(const Mesh *m, int v)
{
    int h = m->out[v];
    for (int k = 0; k < 2; k++, h = he_around(m, h)) {
        Vec3 a = m->pos[he_to(m, h)], b = m->pos[he_to(m, he_around(m, he_around(m, h)))], d = v_sub(b, a);
        if (v_len2(v_cross(v_sub(m->pos[v], a), d)) <= STRAIGHT * STRAIGHT * v_len2(d) * v_len2(d)) return m->opp[h];
    }
    return NONE;
}

/* Seams, those too that came to nothing, have left the patches full of small triangles: vertices that were put on edges are taken out of
 * them again, last come, first go. */
static void undo_cuts(const Graft *g, const int32_t *as)
{
    const Sheet *s = &g->sheet;
    Mesh *m = g->mesh;
    for (int v = s->nvert; v-- > s->nbuilt;) {
        if (as[v] == NONE || s->pin[v] != PIN_NONE || vert_is_dead(m, as[v])) continue;
        int h = m->out[as[v]], n = mesh_valence(m, as[v]), edge = n == 4 ? find_cut_edge(m, as[v]) : NONE;
        if (edge != NONE && mesh_can_collapse(m, edge)) mesh_collapse_edge(m, edge, m->pos[he_from(m, edge)]);
        else
            for (int k = 0; k < n && !try_join(m, he_to(m, h), as[v]); k++) h = he_around(m, h);
    }
}

void graft_sew(Graft *g)
{
    Mesh *m = g->mesh;
    Sheet *s = &g->sheet;
    sheet_split_chords(s);
    Cloth c = {.as = NEW(int32_t, s->nvert)};
    for (int v = 0; v < s->nvert; v++) c.as[v] = s->pin[v] >= 0 ? s->pin[v] : NONE;
    for (int t = 0; t < s->ntri; t++)
        if (s->region[t] != REGION_NONE) {
            int v[3]; /* one after the other: they are numbered as they are met */
            for (int k = 0; k < 3; k++) v[k] = cloth_vertex(g, &c, s->corner[3 * t + k]);
            cloth_triangle(&c, v[0], v[1], v[2]);
        }
    int32_t *seam_at = NEW(int32_t, 3 * m->ntri); /* of kept half-edges */
    for (int h = 0; h < 3 * m->ntri; h++) seam_at[h] = NONE;
    for (int i = 0; i < g->nseam; i++)
        if (g->seam[i].live && g->seam[i].npath > 0) seam_at[g->seam[i].half_edge] = i;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *at = seam_at + 3 * t;
        if (g->drop[t] || (at[0] == NONE && at[1] == NONE && at[2] == NONE)) continue;
        sew_side(g, &c, (int[3]){m->corner[3 * t], m->corner[3 * t + 1], m->corner[3 * t + 2]}, (int[3]){at[0], at[1], at[2]});
        g->drop[t] = 1;
    }
    mesh_patch(m, g->drop, c.nvert, c.pos, c.ntri, c.tri);
    undo_cuts(g, c.as);
    straighten_seams(g, c.as);
    undo_cuts(g, c.as); /* those that the seams held */
    mem_free(seam_at);
    mem_free(c.pos);
    mem_free(c.tri);
    mem_free(c.as);
}
