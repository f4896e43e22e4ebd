/* match.c: which pieces of the mesh does the isosurface have? */
#include "base/sets.h"
#include "base/thread.h"
#include "topology/graft_priv.h"

#include <string.h>

/* --- parts ------------------------------------------------------------------------------------------------------------ */

/* beside[3 * ntri]: the triangle across each edge, or, where the edge parts, the edge's own. Triangles that `skip` marks (may be NULL),
 * behind such edges, are of no part. */
static Parts find_parts(int nvert, int ntri, const int32_t *corner, const int32_t *beside, const uint8_t *skip)
{
    Parts p = {.of = NEW(int32_t, ntri)};
    int32_t *stack = NEW(int32_t, ntri + 1), *seen = NEW(int32_t, nvert);
    int cap = 0;
    for (int t = 0; t < ntri; t++) p.of[t] = NONE;
    for (int v = 0; v < nvert; v++) seen[v] = NONE;
    for (int s = 0; s < ntri; s++) {
        if (p.of[s] != NONE || (skip && skip[s])) continue;
        int n = 0, twice = 0;
        stack[n++] = s;
        p.of[s] = p.n;
        while (n) {
            int t = stack[--n];
            twice += 2;
            for (int h = 3 * t; h < 3 * t + 3; h++) { /* an edge inside is met twice, one of the border once; no branch: none could be foretold */
                int u = beside[h];
                twice += 2 * (seen[corner[h]] != p.n) - 1 - (u == t);
                seen[corner[h]] = p.n;
                stack[n] = u;
                n += p.of[u] == NONE;
                p.of[u] = p.n;
            }
        }
        RESERVE(p.euler2, cap, p.n + 1);
        p.euler2[p.n++] = twice;
    }
    mem_free(stack);
    mem_free(seen);
    return p;
}

static void parts_free(Parts *p)
{
    mem_free(p->of);
    mem_free(p->euler2);
}

static Parts find_pieces(const Graft *g)
{
    const Mesh *m = g->mesh;
    int32_t *beside = NEW(int32_t, 3 * m->ntri);
    uint8_t *skip = NEW(uint8_t, m->ntri);
    for (int t = 0; t < m->ntri; t++) {
        skip[t] = g->label[t] == LABEL_FAR;
        for (int h = 3 * t; h < 3 * t + 3 && !skip[t]; h++) beside[h] = g->label[t] != g->label[m->opp[h] / 3] ? t : m->opp[h] / 3;
    }
    Parts p = find_parts(m->nvert, m->ntri, m->corner, beside, skip);
    mem_free(beside);
    mem_free(skip);
    return p;
}

/* The mesh's triangle beside half-edge h of the sheet, which is on a seam. */
static int mesh_side(const Graft *g, int h)
{
    int e = g->seam[g->sheet.seam[h] >> 1].half_edge;
    return (g->sheet.seam[h] & 1 ? g->mesh->opp[e] : e) / 3;
}

/* Of a seam inside a hole nothing is left. */
static bool is_border(const Graft *g, int h)
{
    int e = g->seam[g->sheet.seam[h] >> 1].half_edge;
    return g->label[e / 3] != LABEL_HOLE || g->label[g->mesh->opp[e] / 3] != LABEL_HOLE;
}

/* Also gathers the sheet's edges on seams and at its rim. */
static Parts find_regions(Graft *g)
{
    const Sheet *s = &g->sheet;
    int32_t *beside = NEW(int32_t, 3 * s->ntri);
    g->nedge = 0;
    for (int h = 0; h < 3 * s->ntri; h++) {
        beside[h] = s->opp[h] / 3;
        if (s->seam[h] == SEAM_NONE && s->opp[h] != NONE) continue;
        RESERVE(g->edge, g->capedge, g->nedge + 1);
        g->edge[g->nedge++] = h;
        if (s->opp[h] == NONE || is_border(g, h)) beside[h] = h / 3;
    }
    Parts p = find_parts(s->nvert, s->ntri, s->corner, beside, NULL);
    mem_free(beside);
    return p;
}

/* --- the match -------------------------------------------------------------------------------------------------------- */

static void claim(int32_t *of, int who) { *of = *of == NOBODY || *of == who ? who : SEVERAL; }

static int owner_of(const Graft *g, const Parts *piece, const Claims *c, int t)
{
    return g->label[t] == LABEL_HOLE ? c->hole : g->label[t] == LABEL_FAR ? c->far : piece->of[t];
}

static Claims settle_claims(const Graft *g, const Parts *piece, const Parts *region)
{
    const Sheet *s = &g->sheet;
    Claims c = {piece->n, piece->n + 1, NEW(int32_t, region->n), NEW0(uint8_t, region->n), NEW(int32_t, piece->n + 2)};
    for (int r = 0; r < region->n; r++) c.owner[r] = NOBODY;
    for (int k = 0; k < piece->n + 2; k++) c.region[k] = NOBODY;
    for (int i = 0; i < g->nedge; i++) {
        int h = g->edge[i], r = region->of[h / 3];
        if (s->seam[h] == SEAM_NONE) c.open[r] = 1;
        if (s->seam[h] == SEAM_NONE || !is_border(g, h)) continue;
        int who = owner_of(g, piece, &c, mesh_side(g, h));
        claim(&c.owner[r], who);
        claim(&c.region[who], r);
        c.open[r] |= who == c.far;
    }
    return c;
}

static void claims_free(Claims *c)
{
    mem_free(c->owner);
    mem_free(c->open);
    mem_free(c->region);
}

/* leak[regions]: of holes, and run into what is not looked at, or are not like the holes they close. Holes and regions that share seams
 * belong together; in components that matched before the ones must have the topology of the others. */
static uint8_t *find_leaks(const Graft *g, const Parts *piece, const Parts *region, const Claims *c)
{
    const Sheet *s = &g->sheet;
    int n = piece->n + region->n;
    uint8_t *leak = NEW(uint8_t, region->n), *trusted = NEW0(uint8_t, region->n);
    int32_t *up = NEW(int32_t, n), *balance = NEW0(int32_t, n);
    for (int k = 0; k < n; k++) up[k] = k;
    for (int t = 0; t < s->ntri; t++) {
        int comp = s->home[s->corner[3 * t]];
        trusted[region->of[t]] = !g->checked[comp] && !g->plan->wrong[comp];
    }
    for (int i = 0; i < g->nedge; i++) {
        int h = g->edge[i], r = region->of[h / 3], t;
        if (s->seam[h] == SEAM_NONE || !is_border(g, h) || g->label[t = mesh_side(g, h)] != LABEL_HOLE) continue;
        set_join(up, piece->of[t], piece->n + r);
    }
    for (int k = 0; k < n; k++) balance[set_root(up, k)] += k < piece->n ? piece->euler2[k] : -region->euler2[k - piece->n];
    for (int r = 0; r < region->n; r++) {
        bool hole = c->owner[r] == c->hole;
        leak[r] = (c->open[r] && c->owner[r] != c->far && c->owner[r] != NOBODY) || (hole && trusted[r] && balance[set_root(up, piece->n + r)] != 0);
    }
    mem_free(up);
    mem_free(trusted);
    mem_free(balance);
    return leak;
}

/* A piece is sound if the region it owns is owned by it alone, and is like it. */
static uint8_t *find_sound(const Graft *g)
{
    const Claims *c = &g->claims;
    uint8_t *sound = NEW(uint8_t, g->piece.n);
    for (int k = 0; k < g->piece.n; k++) {
        int r = c->region[k];
        sound[k] = r >= 0 && c->owner[r] == k && g->region.euler2[r] == g->piece.euler2[k];
    }
    return sound;
}

/* Of the sheet all is a patch but what sound pieces stand for and what was not looked at. */
static uint8_t *find_patches(const Graft *g)
{
    const Sheet *s = &g->sheet;
    const Claims *c = &g->claims;
    uint8_t *patch = NEW(uint8_t, g->region.n);
    for (int t = 0; t < s->ntri; t++) {
        int r = g->region.of[t], who = c->owner[r], comp = s->home[s->corner[3 * t]];
        patch[r] = who == NOBODY ? g->checked[comp] || g->whole[comp] : who != c->far && !(who >= 0 && who < g->piece.n && g->sound[who]);
    }
    return patch;
}

/* Seams between what is kept and what is not lead along kept triangles, these to their left; the others are no more. */
static void turn_seams(Graft *g)
{
    const Mesh *m = g->mesh;
    Sheet *s = &g->sheet;
    for (int i = 0; i < g->nseam; i++) {
        Seam *at = &g->seam[i];
        int h = at->half_edge;
        at->live = g->drop[h / 3] != g->drop[m->opp[h] / 3];
        if (!at->live || !g->drop[h / 3]) continue;
        *at = (Seam){m->opp[h], at->b, at->a, at->path, at->npath, true};
        for (int k = 0; k < at->npath / 2; k++) {
            int32_t *p = g->path + at->path + k, *q = g->path + at->path + at->npath - 1 - k, t = *p;
            *p = *q;
            *q = t;
        }
    }
    for (int v = 0; v < s->nvert; v++)
        if (s->pin[v] == PIN_SEAM) s->pin[v] = PIN_NONE;
    for (int h = 0; h < 3 * s->ntri; h++) {
        if (s->seam[h] == SEAM_NONE) continue;
        const Seam *at = &g->seam[s->seam[h] >> 1];
        if (!at->live) s->seam[h] = SEAM_NONE;
    }
    for (int i = 0; i < g->nseam; i++)
        for (int k = 0; k < g->seam[i].npath && g->seam[i].live; k++) s->pin[g->path[g->seam[i].path + k]] = PIN_SEAM;
}

/* The regions from here on are the patches. euler2[nregion]: twice their Euler characteristic; the caller frees it. */
static int32_t *number_patches(Graft *g)
{
    const uint8_t *patch = g->patch;
    const int32_t *of = g->region.of;
    Sheet *s = &g->sheet;
    int32_t *beside = NEW(int32_t, 3 * s->ntri);
    for (int h = 0; h < 3 * s->ntri; h++) beside[h] = s->opp[h] == NONE || patch[of[h / 3]] != patch[of[s->opp[h] / 3]] ? h / 3 : s->opp[h] / 3;
    Parts p = find_parts(s->nvert, s->ntri, s->corner, beside, NULL);
    int32_t *number = NEW(int32_t, p.n), *euler2 = NEW(int32_t, p.n);
    for (int k = 0; k < p.n; k++) number[k] = NONE;
    g->nregion = 0;
    for (int t = 0; t < s->ntri; t++) {
        int k = p.of[t];
        if (!patch[of[t]]) continue;
        if (number[k] == NONE) euler2[g->nregion] = p.euler2[k], number[k] = g->nregion++;
        s->region[t] = number[k];
    }
    mem_free(beside);
    mem_free(number);
    parts_free(&p);
    return euler2;
}

/* What each patch does to the mesh's Euler characteristic: holes and patches that share seams belong together. */
static void weigh_patches(Graft *g, const int32_t *euler2)
{
    const Mesh *m = g->mesh;
    const Sheet *s = &g->sheet;
    int32_t *beside = NEW(int32_t, 3 * m->ntri);
    uint8_t *kept = NEW(uint8_t, m->ntri);
    for (int h = 0; h < 3 * m->ntri; h++) beside[h] = g->drop[h / 3] != g->drop[m->opp[h] / 3] ? h / 3 : m->opp[h] / 3;
    for (int t = 0; t < m->ntri; t++) kept[t] = !g->drop[t];
    Parts hole = find_parts(m->nvert, m->ntri, m->corner, beside, kept);
    int n = g->nregion + hole.n;
    mem_free(kept);
    int32_t *up = NEW(int32_t, n);
    for (int k = 0; k < n; k++) up[k] = k;
    for (int h = 0; h < 3 * s->ntri; h++) {
        if (s->seam[h] == SEAM_NONE || s->region[h / 3] == REGION_NONE) continue;
        set_join(up, s->region[h / 3], g->nregion + hole.of[m->opp[g->seam[s->seam[h] >> 1].half_edge] / 3]);
    }
    g->euler = NEW0(int32_t, g->nregion);
    for (int k = 0; k < n; k++) /* a root is the least index: a patch, where there is one */
        if (set_root(up, k) < g->nregion) g->euler[set_root(up, k)] += k < g->nregion ? euler2[k] / 2 : -hole.euler2[k - g->nregion] / 2;
    mem_free(beside);
    mem_free(up);
    parts_free(&hole);
}

/* The pieces and the regions, beside one another. */
static void find_block(void *ctx, int begin, int end)
{
    Graft *g = ctx;
    for (int k = begin; k < end; k++)
        if (k == 0) g->region = find_regions(g);
        else g->piece = find_pieces(g);
}

void graft_look(Graft *g)
{
    graft_forget(g);
    parallel_for(2, 1, find_block, g);
    g->claims = settle_claims(g, &g->piece, &g->region);
    g->sound = find_sound(g);
    g->patch = find_patches(g);
}

void graft_forget(Graft *g)
{
    claims_free(&g->claims);
    parts_free(&g->piece);
    parts_free(&g->region);
    mem_free(g->sound);
    mem_free(g->patch);
    g->sound = g->patch = NULL;
    g->claims = (Claims){0};
    g->piece = g->region = (Parts){0};
}

/* Is t a piece of its own? */
static bool is_single(const Graft *g, int t)
{
    const int32_t *o = g->mesh->opp + 3 * t, *of = g->piece.of;
    return of[o[0] / 3] != of[t] && of[o[1] / 3] != of[t] && of[o[2] / 3] != of[t];
}

bool graft_find_unsound(Graft *g)
{
    bool any = false;
    for (int t = 0; t < g->mesh->ntri; t++) {
        if (g->label[t] < 0 || g->sound[g->piece.of[t]] || is_single(g, t)) continue;
        any = true;
        g->label[t] = LABEL_NEAR;
    }
    return any;
}

bool graft_find_leaks(Graft *g, uint8_t *beside)
{
    const Sheet *s = &g->sheet;
    uint8_t *leak = find_leaks(g, &g->piece, &g->region, &g->claims);
    bool any = false;
    memset(beside, 0, (size_t)g->mesh->ntri);
    for (int i = 0; i < g->nedge; i++) {
        int h = g->edge[i];
        if (s->seam[h] == SEAM_NONE || !is_border(g, h) || !leak[g->region.of[h / 3]]) continue;
        int e = g->seam[s->seam[h] >> 1].half_edge, t = mesh_side(g, h), u = (e / 3) + g->mesh->opp[e] / 3 - t;
        if (g->label[t] == LABEL_FAR || g->label[u] != LABEL_FAR) continue;
        beside[t] = beside[u] = 1;
        any = true;
    }
    for (int i = 0; i < g->nseam; i++) { /* a border with a gap */
        int t = g->seam[i].half_edge / 3, u = g->mesh->opp[g->seam[i].half_edge] / 3;
        if (g->seam[i].npath != NONE || (g->label[t] == LABEL_HOLE && g->label[u] == LABEL_HOLE)) continue;
        beside[t] = beside[u] = 1;
        any = true;
    }
    mem_free(leak);
    return any;
}

/* Does half-edge h of the sheet, which may be NONE, belong to what was looked at? */
static bool is_looked_at(const Graft *g, int h)
{
    int who = h == NONE ? NOBODY : g->claims.owner[g->region.of[h / 3]];
    return who != NOBODY && who != g->claims.far;
}

/* euler2[ncomp]: twice the Euler characteristic that each would have: of what of the mesh is not looked at, its borders with it, and of the
 * sheet between those. */
static void count_euler(const Graft *g, int32_t *euler2)
{
    const Mesh *m = g->mesh;
    const Sheet *s = &g->sheet;
    uint8_t *seen = NEW0(uint8_t, int_max(m->nvert, s->nvert));
    for (int h = 0; h < 3 * m->ntri; h++) {
        int v = m->corner[h];
        if (g->label[h / 3] != LABEL_FAR) continue;
        euler2[g->plan->comp[v]] += (h % 3 ? 0 : 2) - (g->label[m->opp[h] / 3] == LABEL_FAR ? 1 : 2) + (seen[v] ? 0 : 2);
        seen[v] = 1;
    }
    memset(seen, 0, (size_t)s->nvert);
    for (int h = 0; h < 3 * s->ntri; h++)
        if (is_looked_at(g, h) && !is_looked_at(g, s->opp[h])) seen[s->corner[h]] = seen[s->corner[he_next(h)]] = 1;
    for (int h = 0; h < 3 * s->ntri; h++) {
        int v = s->corner[h];
        if (!is_looked_at(g, h)) continue;
        euler2[s->home[v]] += (h % 3 ? 0 : 2) - (is_looked_at(g, s->opp[h]) ? 1 : 0) + (seen[v] ? 0 : 2);
        seen[v] = 1;
    }
    mem_free(seen);
}

bool graft_looks_in_part(const Graft *g, int comp) { return g->plan->wrong[comp] && !g->checked[comp] && !g->whole[comp]; }

static bool any_looked_at_in_part(const Graft *g)
{
    bool any = false;
    for (int k = 0; k < g->iso->ncomp; k++) any = any || graft_looks_in_part(g, k);
    return any;
}

bool graft_find_ends(const Graft *g, uint8_t *farther)
{
    const Sheet *s = &g->sheet;
    bool any = false;
    for (int i = 0; i < g->nedge; i++) {
        int h = g->edge[i];
        if (s->opp[h] != NONE || !is_looked_at(g, h) || !graft_looks_in_part(g, s->home[s->corner[h]])) continue;
        farther[s->cell[h / 3]] = 1;
        any = true;
    }
    return any;
}

bool graft_find_unbalanced(Graft *g)
{
    bool any = false;
    if (!any_looked_at_in_part(g)) return false;
    int32_t *euler2 = NEW0(int32_t, g->iso->ncomp);
    count_euler(g, euler2);
    for (int k = 0; k < g->iso->ncomp; k++) {
        if (!graft_looks_in_part(g, k) || euler2[k] == 2 * g->iso->comp_euler[k]) continue;
        g->checked[k] = 1;
        any = true;
    }
    mem_free(euler2);
    return any;
}

/* The component is looked at as a whole; if it was already, it goes. */
static void distrust(Graft *g, int comp)
{
    for (int t = 0; t < g->mesh->ntri && g->checked[comp]; t++)
        if (g->plan->comp[g->mesh->corner[3 * t]] == comp) g->drop[t] = 1;
    g->checked[comp] = 1;
}

bool graft_keeps(const Graft *g, int t)
{
    return g->label[t] == LABEL_FAR || (g->label[t] >= 0 && g->sound[g->piece.of[t]]);
}

bool graft_find_torn(Graft *g, uint8_t *farther)
{
    const Sheet *s = &g->sheet;
    uint8_t *torn = NEW0(uint8_t, g->iso->ncomp);
    bool any = false;
    for (int i = 0; i < g->nedge; i++) {
        int h = g->edge[i], k = s->home[s->corner[h]];
        if (s->seam[h] == SEAM_NONE || !is_border(g, h) || graft_keeps(g, mesh_side(g, h)) != g->patch[g->region.of[h / 3]]) continue;
        if (graft_looks_in_part(g, k)) farther[s->cell[h / 3]] = 1;
        else torn[k] = 1;
        any = true;
    }
    for (int k = 0; k < g->iso->ncomp; k++)
        if (torn[k]) distrust(g, k);
    mem_free(torn);
    return any;
}

void graft_take(Graft *g)
{
    for (int t = 0; t < g->mesh->ntri; t++)
        if (g->label[t] >= 0 && !g->sound[g->piece.of[t]]) g->drop[t] = 1;
    turn_seams(g);
    int32_t *euler2 = number_patches(g);
    weigh_patches(g, euler2);
    mem_free(euler2);
}
