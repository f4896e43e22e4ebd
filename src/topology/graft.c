#include "topology/graft_priv.h"

#include "topology/fault.h"
#include "topology/speck.h"

#include <string.h>

enum {
    PIECE_MOST = 40,   /* triangles of a piece at first; if it is not sound it is cut into single ones */
    PIECE_LEAST = 6,   /* a smaller one goes to a neighbour */
    WIDENINGS_MAX = 2, /* of holes that cannot be closed */
    MARGIN_CELLS = 3,  /* of the sheet around holes, */
    MARGIN_NEAR = 2,   /* and around what is looked at */
    NEAR_CELLS = 2,    /* around what may be wrong, and a ring of triangles around those there */
    LOOKS_MAX = 3,     /* farther around places where that was too near */
    TRIALS_MAX = 50,   /* three have been seen */
    EDGE_RINGS = 3,    /* around what is dropped: edges farther away are not flipped when patches are coarsened */
    UNTRIED = -2       /* to be pinned when a seam comes there */
};
#define NEAR_SHARE 0.3    /* of a component's triangles: with more that may be wrong it is looked at as a whole */
#define PIN_REACH_VOX 0.6 /* a border vertex lies this near to the reference, or the pieces beside it are not kept */

/* --- what to drop -------------------------------------------------------------------------------------------------- */

static int component_of(const Graft *g, int t) { return g->plan->comp[g->mesh->corner[3 * t]]; }

static bool is_one_component(const Graft *g, int t)
{
    const int32_t *c = g->mesh->corner + 3 * t, k = g->plan->comp[c[0]];
    return k != NONE && !g->plan->whole[k] && k == g->plan->comp[c[1]] && k == g->plan->comp[c[2]];
}

/* Adds the triangles around those marked. */
static void add_ring(const Mesh *m, uint8_t *mark)
{
    uint8_t *touched = NEW0(uint8_t, m->nvert);
    for (int t = 0; t < m->ntri; t++)
        for (int h = 3 * t; h < 3 * t + 3 && mark[t]; h++) touched[m->corner[h]] = 1;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        mark[t] = touched[c[0]] | touched[c[1]] | touched[c[2]];
    }
    mem_free(touched);
}

/* Is triangle t looked at, where it is not dropped? */
static bool is_checked(const Graft *g, int t)
{
    int k = component_of(g, t);
    return k == NONE || g->checked[k] || g->near[t];
}

/* Sets near for what has a corner near the cells of hit[ncell], with a ring around it, of components that do not match: cells, because what
 * comes near to a place, and shall be joined with it, may be far along the mesh. Was any of it not set? */
static bool look_near(Graft *g, const uint8_t *hit)
{
    const Mesh *m = g->mesh;
    bool any = false;
    uint8_t *cell = NEW0(uint8_t, g->iso->ncell), *mark = NEW0(uint8_t, m->ntri);
    for (int c = 0; c < g->iso->ncell; c++)
        if (hit[c]) iso_mark_beside(g->iso, c, NEAR_CELLS, cell);
    for (int v = 0; v < m->nvert; v++) {
        int c = iso_cell_near(g->iso, m->pos[v]), h = m->out[v];
        if (c == NONE || !cell[c]) continue;
        do mark[h / 3] = 1;
        while ((h = he_around(m, h)) != m->out[v]);
    }
    add_ring(m, mark);
    for (int t = 0; t < m->ntri; t++) {
        int k = component_of(g, t);
        if (!mark[t] || g->near[t] || k == NONE || !g->plan->wrong[k]) continue;
        g->near[t] = 1;
        any = true;
    }
    mem_free(cell);
    mem_free(mark);
    return any;
}

/* What may be wrong with components that do not match: faulty triangles, and those that lean, and what is near them. */
static void find_near(Graft *g)
{
    const Mesh *m = g->mesh;
    uint8_t *hit = NEW0(uint8_t, g->iso->ncell);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        int k = component_of(g, t);
        if (k != NONE && g->plan->wrong[k] && (g->plan->drop[t] || g->plan->lean[t])) iso_mark_cells(g->iso, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]], hit);
    }
    look_near(g, hit);
    mem_free(hit);
}

/* Components that do not match are looked at as a whole where there is no telling what is near, or that is much of them. */
static void choose_checked(Graft *g)
{
    int32_t *near = NEW0(int32_t, g->iso->ncomp), *all = NEW0(int32_t, g->iso->ncomp);
    for (int t = 0; t < g->mesh->ntri; t++) {
        int k = component_of(g, t);
        if (k != NONE) all[k]++, near[k] += g->near[t];
    }
    for (int k = 0; k < g->iso->ncomp; k++)
        if (g->plan->wrong[k] && (!g->plan->locally || near[k] == 0 || near[k] > NEAR_SHARE * all[k])) g->checked[k] = 1;
    mem_free(near);
    mem_free(all);
}

/* What is not checked is dropped with a ring around it: a border through what is faulty would be hard to trace. */
static void find_drops(Graft *g)
{
    const Mesh *m = g->mesh;
    for (int t = 0; t < m->ntri; t++) g->drop[t] = g->plan->drop[t] && !is_checked(g, t);
    add_ring(m, g->drop);
    for (int t = 0; t < m->ntri; t++) g->drop[t] = g->drop[t] || g->plan->drop[t];
    for (int t = 0; t < m->ntri; t++) g->drop[t] = g->drop[t] || !is_one_component(g, t);
}

/* Components of which no triangle is kept. Are there any that were not known, nor looked at as a whole? */
static bool find_whole(Graft *g)
{
    const Mesh *m = g->mesh;
    bool any = false;
    uint8_t *kept = NEW0(uint8_t, g->iso->ncomp);
    for (int t = 0; t < m->ntri; t++)
        if (!g->drop[t]) kept[component_of(g, t)] = 1;
    for (int k = 0; k < g->iso->ncomp; k++) {
        any = any || (!kept[k] && !g->whole[k] && !g->checked[k]);
        g->whole[k] = !kept[k];
    }
    mem_free(kept);
    return any;
}

/* --- pieces ----------------------------------------------------------------------------------------------------------- */

/* Gives `most` of the unlabelled triangles around t a label. A crumb goes to a piece beside it, where that may be. */
static void grow_piece(Graft *g, int t, int most, bool merge, int32_t *queue)
{
    const Mesh *m = g->mesh;
    int n = 0, beside = NONE, label = g->nlabel++;
    queue[n++] = t;
    g->label[t] = label;
    for (int at = 0; at < n; at++)
        for (int h = 3 * queue[at]; h < 3 * queue[at] + 3; h++) {
            int u = m->opp[h] / 3;
            if (g->label[u] >= 0 && g->label[u] != label) beside = g->label[u];
            if (g->label[u] != LABEL_NEAR || n == most) continue;
            g->label[u] = label;
            queue[n++] = u;
        }
    for (int i = 0; i < n && merge && n < PIECE_LEAST && beside != NONE; i++) g->label[queue[i]] = beside;
}

static void cut_pieces(Graft *g, int most, bool merge)
{
    int32_t *queue = NEW(int32_t, most);
    for (int t = 0; t < g->mesh->ntri; t++)
        if (g->label[t] == LABEL_NEAR) grow_piece(g, t, most, merge, queue);
    mem_free(queue);
}

static void label_pieces(Graft *g)
{
    g->nlabel = 0;
    for (int t = 0; t < g->mesh->ntri; t++) g->label[t] = g->drop[t] ? LABEL_HOLE : is_checked(g, t) ? LABEL_NEAR : LABEL_FAR;
    cut_pieces(g, PIECE_MOST, true);
}

/* --- the sheet and its seams -------------------------------------------------------------------------------------------- */

/* Are the triangle's corners on components of which the sheet has all cells? */
static bool lies_within(const Graft *g, int t, const uint8_t *all)
{
    const int32_t *c = g->mesh->corner + 3 * t;
    for (int k = 0; k < 3; k++)
        if (g->plan->comp[c[k]] == NONE || !all[g->plan->comp[c[k]]]) return false;
    return true;
}

/* Is all that crosses the cell of components of which the sheet has all cells? */
static bool cell_lies_within(const IsoSurface *iso, int cell, const uint8_t *all)
{
    for (int l = iso->cell_loop[cell]; l < iso->cell_loop[cell + 1]; l++)
        if (!all[iso_loop_component(iso, l)]) return false;
    return true;
}

/* Wants the cells around hit[] that `all` leaves open. */
static void want_margin(const IsoSurface *iso, const uint8_t *hit, const uint8_t *all, int margin, uint8_t *want)
{
    for (int c = 0; c < iso->ncell; c++)
        if (hit[c] && !cell_lies_within(iso, c, all)) iso_mark_beside(iso, c, margin, want);
}

static void build_sheet(Graft *g)
{
    const IsoSurface *iso = g->iso;
    const Mesh *m = g->mesh;
    uint8_t *hole = NEW(uint8_t, iso->ncell), *near = NEW0(uint8_t, iso->ncell), *want = NEW0(uint8_t, iso->ncell), *all = NEW(uint8_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) all[k] = g->whole[k] || g->checked[k];
    memcpy(hole, g->plan->cell, (size_t)iso->ncell);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        if (g->label[t] != LABEL_FAR && !lies_within(g, t, all)) iso_mark_cells(iso, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]], g->label[t] == LABEL_HOLE ? hole : near);
    }
    want_margin(iso, hole, all, MARGIN_CELLS, want);
    want_margin(iso, near, all, MARGIN_NEAR, want);
    sheet_build(&g->sheet, iso, all, want);
    mem_free(hole);
    mem_free(near);
    mem_free(want);
    mem_free(all);
}

static void add_seam(Graft *g, int h)
{
    const Mesh *m = g->mesh;
    if (g->seam_of[h] != NONE) return;
    RESERVE(g->seam, g->capseam, g->nseam + 1);
    g->seam_of[h] = g->seam_of[m->opp[h]] = g->nseam;
    g->seam[g->nseam++] = (Seam){h, he_from(m, h), he_to(m, h), 0, NONE, false};
}

static void add_seams(Graft *g)
{
    const Mesh *m = g->mesh;
    for (int h = 0; h < 3 * m->ntri; h++)
        if (g->label[h / 3] != g->label[m->opp[h] / 3]) add_seam(g, h);
}

static int pin_end(Graft *g, int v)
{
    if (g->pinned[v] == UNTRIED) {
        Vec3 n, p = g->mesh->pos[v];
        field_normals(g->iso->field, 1, &p, &n);
        g->pinned[v] = sheet_pin(&g->sheet, v, p, n, g->plan->comp[v], PIN_REACH_VOX * g->iso->field->voxel, 0, false);
    }
    return g->pinned[v];
}

static void trace_seam(Graft *g, int i)
{
    Seam *s = &g->seam[i];
    int a = pin_end(g, s->a), b = pin_end(g, s->b);
    if (a == NONE || b == NONE) return;
    RESERVE(g->path, g->cappath, g->npath + SEAM_MAX);
    s->path = g->npath;
    s->npath = sheet_trace(&g->sheet, i, a, b, SEAM_MAX, g->path + g->npath);
    if (s->npath != NONE) g->npath += s->npath;
}

/* A triangle with an edge that cannot be traced goes. */
static void give_up_triangle(Graft *g, int t)
{
    const Mesh *m = g->mesh;
    const int32_t *c = m->corner + 3 * t;
    if (g->label[t] == LABEL_HOLE) return;
    bool on_sheet = g->label[t] != LABEL_FAR || (pin_end(g, c[0]) != NONE && pin_end(g, c[1]) != NONE && pin_end(g, c[2]) != NONE);
    if (!on_sheet) return;
    g->label[t] = LABEL_HOLE;
    g->drop[t] = 1;
    for (int h = 3 * t; h < 3 * t + 3; h++)
        if (g->label[m->opp[h] / 3] != LABEL_HOLE) add_seam(g, h);
}

/* Traces the borders of all pieces, from seam number `first` on. */
static void trace_seams(Graft *g, int first)
{
    const Mesh *m = g->mesh;
    add_seams(g);
    for (int i = first; i < g->nseam; i++) { /* grows on the way */
        int h = g->seam[i].half_edge;
        if (g->label[h / 3] == LABEL_HOLE && g->label[m->opp[h] / 3] == LABEL_HOLE) continue;
        trace_seam(g, i);
        if (g->seam[i].npath != NONE) continue;
        give_up_triangle(g, h / 3);
        give_up_triangle(g, m->opp[h] / 3);
    }
}

static void forget_seams(Graft *g)
{
    const Mesh *m = g->mesh;
    g->nseam = g->npath = 0;
    for (int h = 0; h < 3 * m->ntri; h++) g->seam_of[h] = NONE;
    for (int v = 0; v < m->nvert; v++) g->pinned[v] = g->plan->comp[v] == NONE ? NONE : UNTRIED;
}

/* Traces the borders of all pieces that have none yet, and looks at what came of it. */
static void trace_and_look(Graft *g, int first)
{
    trace_seams(g, first);
    graft_look(g);
}

/* Cuts what is not sound into single triangles. */
static void match_closely(Graft *g)
{
    int first = g->nseam;
    if (!graft_find_unsound(g)) return;
    cut_pieces(g, 1, false);
    trace_and_look(g, first);
}

/* Widens the holes whose patches leak, `left` more times, as far as the sheet goes. False: some leak all the same. */
static bool stop_leaks(Graft *g, uint8_t *beside, int *left)
{
    while (graft_find_leaks(g, beside)) {
        int first = g->nseam;
        if ((*left)-- <= 0) return false;
        for (int t = 0; t < g->mesh->ntri; t++)
            if (beside[t]) give_up_triangle(g, t);
        if (g->nseam == first) return false;
        trace_and_look(g, first);
    }
    return true;
}

/* Gives up what is around twisted vertices. False: it is dropped, and all of its component is to be looked at, so that what is around it can
 * be closed. That is always so where a hole may be spared: it would be again and again. */
static bool untwist(Graft *g, const uint8_t *around)
{
    int first = g->nseam;
    bool done = true;
    for (int t = 0; t < g->mesh->ntri; t++) {
        if (!around[t]) continue;
        int k = component_of(g, t);
        if (k == NONE || g->plan->wrong[k] || g->checked[k]) give_up_triangle(g, t);
        if (g->label[t] == LABEL_HOLE) continue;
        g->drop[t] = g->checked[k] = 1;
        done = false;
    }
    if (done) trace_and_look(g, first);
    return done;
}

/* What may not stay: a triangle that is only far from the surface may. */
static bool is_severe(const Graft *g, int t) { return g->plan->drop[t] & (FAULT_INVERTED | FAULT_CROSSED); }

/* The hole around triangle t stays as it was; or, where that cannot be, all of its component is looked at. */
static void spare_hole(Graft *g, int t, int32_t *stack)
{
    const Mesh *m = g->mesh;
    int n = 0;
    bool good = true;
    g->drop[t] = 0;
    stack[n++] = t;
    for (int at = 0; at < n; at++) {
        good = good && is_one_component(g, stack[at]) && !g->plan->wrong[component_of(g, stack[at])] && !(g->plan->thorough && is_severe(g, stack[at]));
        for (int h = 3 * stack[at]; h < 3 * stack[at] + 3; h++) {
            int u = m->opp[h] / 3;
            if (g->drop[u]) g->drop[u] = 0, stack[n++] = u;
        }
    }
    for (int i = 0; i < n && !good; i++) {
        g->drop[stack[i]] = 1;
        for (int h = 3 * stack[i]; h < 3 * stack[i] + 3; h++) {
            int k = g->plan->comp[m->corner[h]];
            if (k != NONE) g->checked[k] = 1;
        }
    }
}

/* How a match goes on after one that failed. */
typedef struct Trial {
    int widenings, looks; /* left */
    uint8_t *beside;      /* [ntri] */
    uint8_t *farther;     /* [ncell] near these more is to be looked at */
    int32_t *stack;       /* [ntri] */
} Trial;

/* Of components looked at in part more is; other holes are widened, then spared. */
static void go_beyond_leaks(Graft *g, Trial *x)
{
    for (int t = 0; t < g->mesh->ntri; t++) {
        if (!x->beside[t]) continue;
        int v = g->mesh->corner[3 * t], k = g->plan->comp[v];
        if (k != NONE && graft_looks_in_part(g, k)) x->farther[iso_cell_near(g->iso, g->mesh->pos[v])] = 1; /* it has one, being on a component */
        else if (x->widenings > 0) g->drop[t] = 1;
        else if (g->drop[t]) spare_hole(g, t, x->stack);
    }
}

/* False: more is dropped, or a hole is gone, or more is looked at, or will be. */
static bool try_match(Graft *g, Trial *x)
{
    find_whole(g);
    label_pieces(g);
    build_sheet(g);
    forget_seams(g);
    trace_and_look(g, 0);
    match_closely(g);
    for (;;) {
        if (!stop_leaks(g, x->beside, &x->widenings)) {
            go_beyond_leaks(g, x);
            return false;
        }
        if (graft_find_ends(g, x->farther) || find_whole(g) || graft_find_torn(g, x->farther)) return false;
        if (!graft_find_twisted(g, x->beside)) return !graft_find_unbalanced(g);
        if (!untwist(g, x->beside)) return false;
        match_closely(g);
    }
}

static void look_farther(Graft *g, Trial *x)
{
    if (!memchr(x->farther, 1, (size_t)g->iso->ncell)) return;
    bool more = x->looks-- > 0 && look_near(g, x->farther);
    for (int k = 0; k < g->iso->ncomp && !more; k++)
        if (graft_looks_in_part(g, k)) g->checked[k] = 1;
    choose_checked(g);
    memset(x->farther, 0, (size_t)g->iso->ncell);
}

static void match_pieces(Graft *g)
{
    int ntri = g->mesh->ntri;
    Trial x = {WIDENINGS_MAX, LOOKS_MAX, NEW(uint8_t, ntri), NEW0(uint8_t, g->iso->ncell), NEW(int32_t, ntri)};
    for (int trial = 0; !try_match(g, &x); trial++) {
        if (trial == TRIALS_MAX) memset(g->drop, 1, (size_t)ntri); /* all anew, rather than for ever */
        look_farther(g, &x);
        sheet_free(&g->sheet);
    }
    graft_take(g);
    graft_forget(g);
    mem_free(x.beside);
    mem_free(x.farther);
    mem_free(x.stack);
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
    for (int k = first; k < stat->npatch; k++) stat->patch[k] = (MendPatch){{0, 0, 0}, NONE, 0, g->euler[k - first], false};
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

static void remember_edges(const Graft *g, Map *edges)
{
    const Mesh *m = g->mesh;
    int n = 0;
    uint8_t *near = NEW(uint8_t, m->ntri);
    memcpy(near, g->drop, (size_t)m->ntri);
    for (int k = 0; k < EDGE_RINGS; k++) add_ring(m, near);
    for (int t = 0; t < m->ntri; t++) n += near[t];
    map_init(edges, 3 * n);
    for (int h = 0; h < 3 * m->ntri; h++) {
        int v = m->id[he_from(m, h)], w = m->id[he_to(m, h)];
        if (!g->plan->drop[h / 3] && v < w && (near[h / 3] || near[m->opp[h] / 3])) map_put(edges, key_pair(v, w), 0);
    }
    mem_free(near);
}

static void graft_free(Graft *g)
{
    sheet_free(&g->sheet);
    mem_free(g->drop);
    mem_free(g->near);
    mem_free(g->whole);
    mem_free(g->checked);
    mem_free(g->label);
    mem_free(g->pinned);
    mem_free(g->seam_of);
    mem_free(g->euler);
    mem_free(g->seam);
    mem_free(g->path);
    mem_free(g->edge);
}

/* Specks are drawn, not cut out. */
static void leave_out_specks(Graft *g, uint8_t *speck)
{
    Sheet *s = &g->sheet;
    for (int k = 0; k < g->iso->ncomp; k++) speck[k] = g->whole[k] && speck_is(g->iso, k);
    for (int t = 0; t < s->ntri; t++)
        if (speck[s->home[s->corner[3 * t]]]) s->region[t] = REGION_NONE;
}

void graft_patches(const IsoSurface *iso, const GraftPlan *plan, Mesh *mesh, uint8_t *speck, Map *edges, MendStat *stat)
{
    Graft g = {.iso = iso, .plan = plan, .mesh = mesh, .drop = NEW(uint8_t, mesh->ntri), .near = NEW0(uint8_t, mesh->ntri), .whole = NEW(uint8_t, iso->ncomp),
               .checked = NEW0(uint8_t, iso->ncomp), .label = NEW(int32_t, mesh->ntri),
               .pinned = NEW(int32_t, mesh->nvert), .seam_of = NEW(int32_t, 3 * mesh->ntri)};
    find_near(&g);
    choose_checked(&g);
    find_drops(&g);
    match_pieces(&g);
    leave_out_specks(&g, speck);
    if (edges) remember_edges(&g, edges);
    stat->dropped += count_dropped(&g);
    if (plan->survivors) stat->survived += graft_pin_survivors(&g);
    report_patches(&g, stat);
    graft_sew(&g);
    graft_free(&g);
}
