#include "topology/graft_priv.h"

#include "topology/speck.h"

#include <string.h>

enum { ROUNDS_MAX = 16, PATH_MAX = 24, ISLAND_TRIANGLES = 8, MARGIN_CELLS = 2, SAMPLES = 3, NEAR_CELLS = 1 };
#define PIN_REACH_VOX 0.6       /* a border vertex lies this near to the reference, or the border is moved on */
#define FOLLOWS_VOX 0.4         /* a triangle nearer to the surface than this */
#define FOLLOWS_COS 0.6         /* and turned like it follows it */

/* --- what to drop -------------------------------------------------------------------------------------------------- */

static bool is_one_component(const Graft *g, int t)
{
    const int32_t *c = g->mesh->corner + 3 * t, k = g->plan->comp[c[0]];
    return k != NONE && !g->whole[k] && k == g->plan->comp[c[1]] && k == g->plan->comp[c[2]];
}

static void drop_around(Graft *g, int v)
{
    const Mesh *m = g->mesh;
    int h = m->out[v];
    do g->drop[h / 3] = 1;
    while ((h = he_around(m, h)) != m->out[v]);
}

static void drop_ring(Graft *g)
{
    const Mesh *m = g->mesh;
    uint8_t *touched = NEW0(uint8_t, m->nvert);
    for (int h = 0; h < 3 * m->ntri; h++) touched[m->corner[h]] |= g->drop[h / 3];
    for (int h = 0; h < 3 * m->ntri; h++) g->drop[h / 3] |= touched[m->corner[h]];
    mem_free(touched);
}

/* How many separate fans of kept triangles are around v. */
static int kept_fans(const Graft *g, int v)
{
    const Mesh *m = g->mesh;
    int fans = 0, h = m->out[v];
    do fans += !g->drop[h / 3] && g->drop[m->opp[h] / 3];
    while ((h = he_around(m, h)) != m->out[v]);
    return fans;
}

/* A border passes each vertex once. */
static bool drop_pinches(Graft *g)
{
    bool any = false;
    for (int v = 0; v < g->mesh->nvert; v++) {
        if (kept_fans(g, v) < 2) continue;
        drop_around(g, v);
        any = true;
    }
    return any;
}

/* Kept triangles that hang together with only a few others. */
static bool drop_islands(Graft *g)
{
    const Mesh *m = g->mesh;
    int32_t *stack = NEW(int32_t, m->ntri);
    uint8_t *seen = NEW0(uint8_t, m->ntri);
    bool any = false;
    for (int s = 0; s < m->ntri; s++) {
        if (g->drop[s] || seen[s]) continue;
        int n = 0, at = 0;
        bool border = false;
        stack[n++] = s;
        seen[s] = 1;
        while (at < n) {
            int t = stack[at++];
            for (int k = 0; k < 3; k++) {
                int u = m->opp[3 * t + k] / 3;
                border |= g->drop[u];
                if (g->drop[u] || seen[u]) continue;
                seen[u] = 1;
                stack[n++] = u;
            }
        }
        if (!border || n > ISLAND_TRIANGLES) continue;
        for (int i = 0; i < n; i++) g->drop[stack[i]] = 1;
        any = true;
    }
    mem_free(stack);
    mem_free(seen);
    return any;
}

/* Components of which no triangle is kept are taken whole. */
static void find_missing(Graft *g)
{
    uint8_t *present = NEW0(uint8_t, g->iso->ncomp);
    for (int t = 0; t < g->mesh->ntri; t++)
        if (!g->drop[t]) present[g->plan->comp[g->mesh->corner[3 * t]]] = 1;
    for (int k = 0; k < g->iso->ncomp; k++) g->whole[k] = !present[k];
    mem_free(present);
}

/* Makes the kept part something a border can be traced around. */
static void settle_drops(Graft *g)
{
    const Mesh *m = g->mesh;
    for (int h = 0; h < 3 * m->ntri; h++) {
        int k = g->plan->comp[m->corner[h]];
        if (k != NONE && g->whole[k]) g->drop[h / 3] = 1;
    }
    bool again = true;
    while (again) {
        again = drop_pinches(g);
        again = drop_islands(g) || again;
    }
    find_missing(g);
}

/* --- the sheet -------------------------------------------------------------------------------------------------------- */

static void want_around(const IsoSurface *iso, int cell, int margin, uint8_t *want)
{
    for (int z = -margin; z <= margin; z++)
        for (int y = -margin; y <= margin; y++)
            for (int x = -margin; x <= margin; x++) {
                int c = iso_cell_beside(iso, cell, x, y, z);
                if (c != NONE) want[c] = 1;
            }
}

static void mark_triangle(const Graft *g, int t, uint8_t *hit)
{
    const Mesh *m = g->mesh;
    iso_mark_cells(g->iso, m->pos[m->corner[3 * t]], m->pos[m->corner[3 * t + 1]], m->pos[m->corner[3 * t + 2]], hit);
}

static void build_sheet(Graft *g)
{
    const Mesh *m = g->mesh;
    uint8_t *hit = NEW0(uint8_t, g->iso->ncell), *want = NEW0(uint8_t, g->iso->ncell);
    memcpy(hit, g->plan->cell, (size_t)g->iso->ncell);
    for (int t = 0; t < m->ntri; t++)
        if (g->drop[t]) mark_triangle(g, t, hit);
    for (int c = 0; c < g->iso->ncell; c++)
        if (hit[c]) want_around(g->iso, c, MARGIN_CELLS, want);
    sheet_build(&g->sheet, g->iso, g->whole, want);
    mem_free(hit);
    mem_free(want);
}

/* --- borders ------------------------------------------------------------------------------------------------------------ */

static int pin_border(Graft *g, int v)
{
    if (g->pinned[v] == NONE && !g->grow[v]) {
        Vec3 n, p = g->mesh->pos[v];
        field_normals(g->iso->field, 1, &p, &n);
        g->pinned[v] = sheet_pin(&g->sheet, v, p, n, g->plan->comp[v], PIN_REACH_VOX * g->iso->field->voxel, 0, false);
        g->grow[v] = g->pinned[v] == NONE;
    }
    return g->grow[v];
}

static int find_borders(Graft *g)
{
    const Mesh *m = g->mesh;
    int failed = 0;
    g->nseam = g->npath = 0;
    for (int h = 0; h < 3 * m->ntri; h++) {
        g->seam_at[h] = NONE;
        if (g->drop[h / 3] || !g->drop[m->opp[h] / 3]) continue;
        RESERVE(g->seam, g->capseam, g->nseam + 1);
        g->seam_at[h] = g->nseam;
        g->seam[g->nseam++] = (Seam){h, he_from(m, h), he_to(m, h), 0, 0};
        failed += pin_border(g, he_from(m, h));
    }
    return failed;
}

static int trace_borders(Graft *g)
{
    int failed = 0;
    for (int i = 0; i < g->nseam; i++) {
        Seam *s = &g->seam[i];
        if (g->grow[s->a] || g->grow[s->b]) continue;
        RESERVE(g->path, g->cappath, g->npath + PATH_MAX);
        s->path = g->npath;
        s->npath = sheet_trace(&g->sheet, i, g->pinned[s->a], g->pinned[s->b], PATH_MAX, g->path + g->npath);
        if (s->npath == NONE) g->grow[s->a] = g->grow[s->b] = 1, failed++;
        else g->npath += s->npath;
    }
    return failed;
}

/* The cells with a single loop whose surface a kept triangle follows. */
static void mark_kept(const Graft *g, int t, uint8_t *kept)
{
    const Mesh *m = g->mesh;
    const Field *f = g->iso->field;
    Vec3 a = m->pos[m->corner[3 * t]], b = m->pos[m->corner[3 * t + 1]], c = m->pos[m->corner[3 * t + 2]], n = v_unit(v_area2(a, b, c));
    for (int i = 0; i <= SAMPLES; i++)
        for (int j = 0; j <= SAMPLES - i; j++) {
            Vec3 grad, p = v_axpy(v_axpy(a, (double)i / SAMPLES, v_sub(b, a)), (double)j / SAMPLES, v_sub(c, a));
            int cell = iso_cell_near(g->iso, p);
            if (cell == NONE || g->iso->cell_loop[cell + 1] != g->iso->cell_loop[cell] + 1) continue;
            double F = field_value(f, p, &grad, NULL), l = v_len(grad);
            if (fabs(F) < FOLLOWS_VOX * f->voxel * l && v_dot(n, grad) < -FOLLOWS_COS * l) kept[cell] = 1;
        }
}

static bool is_over_sheet(const Graft *g, int t)
{
    for (int k = 0; k < 3; k++) {
        int c = iso_cell_near(g->iso, g->mesh->pos[g->mesh->corner[3 * t + k]]);
        if (c != NONE && g->sheet.first[c] != NONE) return true;
    }
    return false;
}

/* Where a patch ran into what is kept, that has to go as well: it is the other side of a new neck, say. */
static int fill_patches(Graft *g)
{
    if (g->nseam == 0) return 0;
    const IsoSurface *iso = g->iso;
    uint8_t *kept = NEW0(uint8_t, iso->ncell), *gone = NEW0(uint8_t, iso->ncell), *conflict = NEW0(uint8_t, iso->ncell);
    memcpy(gone, g->plan->cell, (size_t)iso->ncell);
    for (int t = 0; t < g->mesh->ntri; t++)
        if (g->drop[t]) mark_triangle(g, t, gone);
    for (int t = 0; t < g->mesh->ntri; t++)
        if (!g->drop[t] && is_over_sheet(g, t)) mark_kept(g, t, kept);
    for (int c = 0; c < iso->ncell; c++) kept[c] = kept[c] && !gone[c];
    int failed = sheet_fill(&g->sheet, kept, conflict, &g->nregion);
    if (failed) {
        memset(kept, 0, (size_t)iso->ncell);
        for (int c = 0; c < iso->ncell; c++)
            if (conflict[c]) want_around(iso, c, NEAR_CELLS, kept);
        for (int v = 0; v < g->mesh->nvert; v++) {
            int c = iso_cell_near(iso, g->mesh->pos[v]);
            if (c != NONE && kept[c]) g->grow[v] = 1;
        }
    }
    mem_free(kept);
    mem_free(gone);
    mem_free(conflict);
    return failed;
}

/* One attempt at the whole plan; false: what g->grow marks could not be sewn. */
static bool cut_patches(Graft *g)
{
    for (int v = 0; v < g->mesh->nvert; v++) g->pinned[v] = NONE, g->grow[v] = 0;
    build_sheet(g);
    int failed = find_borders(g);
    failed += trace_borders(g); /* also where pins are missing: the more is known to fail, the fewer attempts */
    return failed == 0 && fill_patches(g) == 0 && graft_compare(g) == 0;
}

static void widen(Graft *g)
{
    for (int v = 0; v < g->mesh->nvert; v++)
        if (g->grow[v]) drop_around(g, v);
    settle_drops(g);
}

/* The dropped triangles that hang together with those around v stay after all. False, and nothing done, where that cannot be:
 * some are torn. */
static bool spare_around(Graft *g, int v, int32_t *stack)
{
    const Mesh *m = g->mesh;
    int n = 0, h = m->out[v];
    bool good = true;
    do
        if (g->drop[h / 3]) g->drop[h / 3] = 0, stack[n++] = h / 3;
    while ((h = he_around(m, h)) != m->out[v]);
    for (int at = 0; at < n; at++)
        for (int k = 3 * stack[at]; k < 3 * stack[at] + 3; k++) {
            int u = m->opp[k] / 3;
            if (g->drop[u]) g->drop[u] = 0, stack[n++] = u;
        }
    for (int i = 0; i < n; i++) good = good && is_one_component(g, stack[i]);
    for (int i = 0; i < n && !good; i++) g->drop[stack[i]] = 1;
    return good;
}

/* What cannot be sewn in a component that matches stays as it is, faults and all; others are made anew as a whole. */
static void give_up(Graft *g)
{
    int32_t *stack = NEW(int32_t, g->mesh->ntri);
    for (int v = 0; v < g->mesh->nvert; v++) {
        int k = g->plan->comp[v];
        if (g->grow[v] && k != NONE && (g->plan->wrong[k] || !spare_around(g, v, stack))) g->whole[k] = 1;
    }
    mem_free(stack);
    settle_drops(g);
}

/* Whatever has a border is made anew as a whole: then there is none. */
static void take_bordered_whole(Graft *g)
{
    for (int i = 0; i < g->nseam; i++) g->whole[g->plan->comp[g->seam[i].a]] = 1;
    settle_drops(g);
}

/* --- all of it ------------------------------------------------------------------------------------------------------------ */

static int count_dropped(const Graft *g)
{
    const Mesh *m = g->mesh;
    int n = 0;
    uint8_t *kept = NEW0(uint8_t, m->nvert);
    for (int h = 0; h < 3 * m->ntri; h++) kept[m->corner[h]] |= !g->drop[h / 3];
    for (int v = 0; v < m->nvert; v++) n += !kept[v];
    mem_free(kept);
    return n;
}

static void report_patches(Graft *g, MendStat *stat)
{
    const Sheet *s = &g->sheet;
    int first = stat->npatch;
    RESERVE(stat->patch, stat->cappatch, first + g->nregion);
    stat->npatch += g->nregion;
    for (int k = first; k < stat->npatch; k++) stat->patch[k] = (MendPatch){{0, 0, 0}, NONE, 0, false};
    int32_t *seen = NEW(int32_t, s->nvert);
    for (int v = 0; v < s->nvert; v++) seen[v] = NONE;
    for (int h = 0; h < 3 * s->ntri; h++) {
        int v = s->corner[h], k = s->region[h / 3];
        if (k == REGION_NONE || seen[v] == k || s->pin[v] >= 0) continue;
        MendPatch *p = &stat->patch[first + k];
        seen[v] = k;
        p->comp = s->home[v];
        p->whole = g->whole[p->comp];
        p->place = v_mix(p->place, s->pos[v], 1.0 / ++p->vertices);
    }
    mem_free(seen);
}

static void graft_free(Graft *g)
{
    sheet_free(&g->sheet);
    mem_free(g->drop);
    mem_free(g->whole);
    mem_free(g->grow);
    mem_free(g->pinned);
    mem_free(g->seam_at);
    mem_free(g->seam);
    mem_free(g->path);
}

void graft_patches(const IsoSurface *iso, const GraftPlan *plan, Mesh *mesh, uint8_t *speck, MendStat *stat)
{
    Graft g = {.iso = iso, .plan = plan, .mesh = mesh, .drop = NEW(uint8_t, mesh->ntri), .whole = NEW(uint8_t, iso->ncomp),
               .grow = NEW(uint8_t, mesh->nvert), .pinned = NEW(int32_t, mesh->nvert), .seam_at = NEW(int32_t, 3 * mesh->ntri)};
    memcpy(g.drop, plan->drop, (size_t)mesh->ntri);
    memcpy(g.whole, plan->whole, (size_t)iso->ncomp);
    drop_ring(&g);
    for (int t = 0; t < mesh->ntri; t++)
        if (!is_one_component(&g, t)) g.drop[t] = 1;
    settle_drops(&g);
    for (int round = 1; !cut_patches(&g); round++) {
        sheet_free(&g.sheet);
        if (round < ROUNDS_MAX) widen(&g);
        else if (round < 2 * ROUNDS_MAX) give_up(&g);
        else take_bordered_whole(&g); /* what is spared may be dropped again for its shape: this ends it */
    }
    for (int k = 0; k < iso->ncomp; k++) {
        speck[k] = g.whole[k] && speck_is(iso, k);
        if (g.whole[k] && !speck[k]) sheet_take_component(&g.sheet, k, g.nregion++);
    }
    stat->dropped += count_dropped(&g);
    if (plan->survivors) stat->survived += graft_pin_survivors(&g);
    report_patches(&g, stat);
    graft_sew(&g);
    graft_free(&g);
}
