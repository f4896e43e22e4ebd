#include "topology/mend.h"

#include "base/thread.h"
#include "remesh/remesh.h"
#include "topology/fault.h"
#include "topology/graft.h"
#include "topology/speck.h"

#include <string.h>

/* What each round coarsens its patches to, in edges wanted; 0: only healed; NONE: left as they are. */
static const double ROUND_EDGE[] = {1, 1, 1, 0.8, 0.6, 0, NONE};
enum {
    ROUNDS = sizeof ROUND_EDGE / sizeof *ROUND_EDGE,
    ROUND_WHOLE = 3,           /* from here on what does not match is made anew as a whole, */
    ROUND_STRICT = 3,          /* nothing survives inside patches, and triangles that are only far from the surface stay */
    ROUND_EXACT = 5,           /* from here on what matches stays */
    SMALL_LOOPS = 300,         /* smaller components are made anew from the second round on, those of a last mend at once */
    FLIP_ROUNDS = 3,
    EVEN_ROUNDS = 3,           /* of coarsened patches, */
    EVEN_ROUNDS_EARLY = 1,     /* or, where they are relaxed with the rest, */
    SPLITS_MAX = 4,
    FEW = 50,
};
#define SPLIT_LEAST_VOX 0.4    /* edges of triangles that cross others are not split below this */
#define MANY_SHARE 0.03        /* of all triangles: more that are turned over or crossed are tried once, */
#define FEW_SHARE 0.01         /* and more than this not with finer patches: they would do harm */
#define THOROUGH_SHARE 0.003   /* for fewer than this, or than FEW, all of their component is looked at, if need be */
#define ONCE_SHARE 0.05        /* where there were fewer, what the first round of an early mend leaves is the last mend's */
#define FAULTY_SHARE 0.4       /* a component that does not match and has more corners of faulty triangles, a loop, is made anew at once */

typedef struct Verdict {
    Faults faults;
    uint8_t *whole;     /* [iso->ncomp] to be made anew */
    uint8_t *wrong;     /* [iso->ncomp] does not match */
    int32_t *faulty;    /* [iso->ncomp] corners of faulty triangles, and uncovered cells */
    bool any;           /* something is to be done */
    bool crumbs;        /* all that is left to do are components below SMALL_LOOPS */
    bool thorough;      /* what is left is little: see GraftPlan */
} Verdict;

static void count_faulty(const IsoSurface *iso, const Mesh *m, Verdict *v)
{
    for (int h = 0; h < 3 * m->ntri; h++)
        if (v->faults.tri[h / 3] && v->faults.comp[m->corner[h]] != NONE) v->faulty[v->faults.comp[m->corner[h]]]++;
    for (int c = 0; c < iso->ncell; c++)
        for (int l = iso->cell_loop[c]; v->faults.cell[c] && l < iso->cell_loop[c + 1]; l++) v->faulty[iso_loop_component(iso, l)]++;
}

static bool has_area(const Mesh *m, int t) { return v_len2(mesh_tri_area2(m, t)) > 0; }

/* These faults, in components that match, stay. */
static void forgive(const IsoSurface *iso, const Mesh *m, int which, Verdict *v)
{
    for (int t = 0; t < m->ntri; t++) {
        int k = v->faults.comp[m->corner[3 * t]];
        if (k != NONE && !v->wrong[k]) v->faults.tri[t] &= (uint8_t)~which;
    }
    for (int c = 0; c < iso->ncell && which & FAULT_FAR; c++)
        if (!v->wrong[iso_loop_component(iso, iso->cell_loop[c])]) v->faults.cell[c] = 0;
}

/* Meshes that match stay as they are, whatever is faulty. comp[ntri] are the mesh's components, partner those they lie on. */
static void forgive_all(const Mesh *m, const int32_t *comp, const int32_t *partner, int kept, Verdict *v)
{
    for (int t = 0; t < m->ntri; t++) {
        int k = partner[comp[t]];
        if (k == NONE || v->wrong[k]) continue;
        v->faults.tri[t] &= (uint8_t)(FAULT_DEGENERATE | kept);
        for (int c = 0; c < 3; c++) v->faults.comp[m->corner[3 * t + c]] = k;
    }
}

/* Specks are taken from the grid at every frame unless they did not move. */
static void renew_specks(const IsoSurface *iso, const Mesh *m, const uint8_t *frozen, Verdict *v)
{
    for (int i = 0; i < m->nvert; i++) {
        int k = v->faults.comp[i];
        if (k != NONE && !frozen[i] && speck_is(iso, k)) v->whole[k] = 1;
    }
}

static bool is_large_wrong(const IsoSurface *iso, const uint8_t *wrong)
{
    bool any = false;
    for (int k = 0; k < iso->ncomp; k++) any = any || (wrong[k] && iso->comp_loops[k] >= SMALL_LOOPS);
    return any;
}

/* The audit, and what it went by. */
typedef struct Match {
    int32_t *comp;      /* [m->ntri] of the mesh's components */
    int32_t *partner;   /* the component of the isosurface that each of those lies on, or NONE */
    uint8_t *wrong;     /* [iso->ncomp] */
    bool all;           /* none is wrong, neither here nor there */
} Match;

static Match find_match(const IsoSurface *iso, const Mesh *m)
{
    Match a = {.comp = NEW(int32_t, m->ntri), .wrong = NEW(uint8_t, iso->ncomp)};
    int n = mesh_components(m, a.comp, NULL);
    uint8_t *mesh_bad = NEW(uint8_t, n);
    a.partner = NEW(int32_t, n);
    AuditStat s = audit_match(iso, &(AuditMesh){m->nvert, m->ntri, n, m->pos, m->corner, a.comp}, true, mesh_bad, a.wrong, a.partner);
    a.all = s.wrong_mesh + s.wrong_iso == 0;
    mem_free(mesh_bad);
    return a;
}

static void match_free(Match *a)
{
    mem_free(a->comp);
    mem_free(a->partner);
    mem_free(a->wrong);
}

typedef struct Look {
    const IsoSurface *iso;
    const Mesh *mesh;
    Crossings *crossings;
    Faults faults;
    Match match;
} Look;

/* The match is found on one thread, and meanwhile the faults on all others. */
static void look_block(void *ctx, int begin, int end)
{
    Look *l = ctx;
    (void)end;
    if (begin == 0) faults_find(l->iso, l->mesh, l->crossings, &l->faults);
    else l->match = find_match(l->iso, l->mesh);
}

static void judge(const IsoSurface *iso, const MendOptions *opt, const Mesh *m, int round, Verdict *v)
{
    Look look = {.iso = iso, .mesh = m, .crossings = opt->crossings};
    parallel_for(2, 1, look_block, &look);
    Match a = look.match;
    *v = (Verdict){.faults = look.faults, .whole = NEW0(uint8_t, iso->ncomp), .wrong = a.wrong, .faulty = NEW0(int32_t, iso->ncomp)};
    a.wrong = NULL;
    Faults *f = &v->faults;
    int bad = f->inverted + f->crossed;
    v->thorough = round > 0 && round < ROUND_WHOLE && bad < real_max(FEW, THOROUGH_SHARE * m->ntri);
    bool many = round > 0 && bad >= (round < ROUND_STRICT ? MANY_SHARE : FEW_SHARE) * m->ntri;
    forgive(iso, m, (round < ROUND_STRICT ? 0 : FAULT_FAR) | (many ? FAULT_INVERTED | FAULT_CROSSED : 0), v);
    if (round >= ROUND_EXACT) forgive_all(m, a.comp, a.partner, round == ROUND_EXACT && f->crossed < FEW ? FAULT_CROSSED : 0, v);
    v->any = false;
    for (int t = 0; t < m->ntri; t++) v->any = v->any || f->tri[t];
    for (int c = 0; c < iso->ncell; c++) v->any = v->any || f->cell[c];
    v->crumbs = !v->any && !is_large_wrong(iso, v->wrong);
    v->any = v->any || !a.all;
    count_faulty(iso, m, v);
    if (round == 0) renew_specks(iso, m, opt->frozen, v);
    for (int k = 0; k < iso->ncomp; k++) {
        bool lost = round == 0 && v->faulty[k] > FAULTY_SHARE * iso->comp_loops[k];
        if (v->wrong[k] && (lost || round >= ROUND_WHOLE || ((round > 0 || !opt->early) && iso->comp_loops[k] < SMALL_LOOPS))) v->whole[k] = 1;
        v->any = v->any || v->whole[k];
    }
    match_free(&a);
}

/* After the exact round: would that judge find nothing? */
static bool is_mended(const IsoSurface *iso, const Mesh *m)
{
    Match a = find_match(iso, m);
    bool mended = a.all;
    for (int t = 0; t < m->ntri && mended; t++) mended = has_area(m, t);
    match_free(&a);
    return mended;
}

static void verdict_free(Verdict *v)
{
    faults_free(&v->faults);
    mem_free(v->whole);
    mem_free(v->wrong);
    mem_free(v->faulty);
}

/* Brings the vertices from `first` on to the edge length (0: only heals), and evens them in so many rounds. */
static void work_patches(const IsoSurface *iso, Mesh *m, int first, double edge, int rounds, const Map *edges)
{
    Remesh r;
    int found;
    int32_t *home = audit_mesh_homes(iso, m);
    remesh_begin_confined(&r, m, iso->field, edge > 0 ? edge : iso->field->voxel, &(Homes){iso_is_home, iso, home}, first);
    if (edge > 0) {
        remesh_coarsen(&r, rounds);
        for (int k = 0; k < FLIP_ROUNDS && remesh_flip_towards(&r, edges); k++) {}
    }
    remesh_heal(&r, NULL, &found);
    remesh_rehome(&r, NULL);
    remesh_end(&r);
    mem_free(home);
    mesh_compact(m, NULL);
}

/* Drops the dead; returns the first of the vertices that were new. */
static int compact_new(Mesh *m, int first_new)
{
    int dead = 0;
    for (int v = 0; v < first_new; v++) dead += vert_is_dead(m, v);
    mesh_compact(m, NULL);
    return first_new - dead;
}

/* Large components that had a mesh and lose all of it. */
static int count_whole(const IsoSurface *iso, const Mesh *m, const int32_t *comp, const uint8_t *whole)
{
    int32_t *had = NEW0(int32_t, iso->ncomp);
    int n = 0;
    for (int t = 0; t < m->ntri; t++)
        if (comp[m->corner[3 * t]] != NONE) had[comp[m->corner[3 * t]]]++;
    for (int k = 0; k < iso->ncomp; k++) n += whole[k] && had[k] > WHOLE_TRIANGLES;
    mem_free(had);
    return n;
}

static int count_raw(const IsoSurface *iso, const Verdict *v)
{
    int n = 0;
    for (int k = 0; k < iso->ncomp; k++) n += v->whole[k];
    return n;
}

static bool ring_has_area(const Mesh *m, int v)
{
    int h = m->out[v];
    do
        if (!has_area(m, h / 3)) return false;
    while ((h = he_around(m, h)) != m->out[v]);
    return true;
}

/* Rounding may leave the reference's smallest triangles without area: a corner goes a little towards its neighbours' mean. */
static void give_area(Mesh *m)
{
    for (int t = 0; t < m->ntri; t++)
        for (int k = 0; k < 9 && !has_area(m, t); k++) {
            int v = m->corner[3 * t + k % 3];
            Vec3 was = m->pos[v];
            m->pos[v] = v_round32(v_mix(was, mesh_ring_mean(m, v), 0.15 * (1 + k / 3)));
            if (!ring_has_area(m, v)) m->pos[v] = was;
        }
}

/* To what files hold. */
static void round_positions(Mesh *m)
{
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_round32(m->pos[v]);
    give_area(m);
}

static void mend_round(const IsoSurface *iso, const MendOptions *opt, Mesh *m, int round, const Verdict *v, MendStat *stat)
{
    Map edges = {0};
    int first = m->nvert;
    uint8_t *speck = NEW(uint8_t, iso->ncomp);
    GraftPlan plan = {.comp = v->faults.comp, .drop = v->faults.tri, .cell = v->faults.cell, .whole = v->whole, .wrong = v->wrong, .locally = round == 0,
                      .lean = v->faults.lean, .edge = opt->edge, .survivors = round < ROUND_STRICT, .thorough = v->thorough};
    stat->whole += count_whole(iso, m, v->faults.comp, v->whole);
    graft_patches(iso, &plan, m, speck, ROUND_EDGE[round] > 0 ? &edges : NULL, stat);
    first = compact_new(m, first);
    if (ROUND_EDGE[round] != NONE) work_patches(iso, m, first, ROUND_EDGE[round] * opt->edge, opt->early ? EVEN_ROUNDS_EARLY : EVEN_ROUNDS, &edges);
    else stat->raw += count_raw(iso, v);
    speck_append(iso, speck, m);
    round_positions(m);
    mem_free(speck);
    map_free(&edges);
}

/* Splits what n pairs of triangles that run through one another hold. False: it is all too small. */
static bool split_pairs(const IsoSurface *iso, Mesh *m, int n, const TriPair *pair)
{
    Remesh r;
    uint8_t *mark = NEW0(uint8_t, m->ntri);
    int32_t *home = audit_mesh_homes(iso, m);
    for (int i = 0; i < n; i++) mark[pair[i].a] = mark[pair[i].b] = 1;
    remesh_begin(&r, m, iso->field, iso->field->voxel, &(Homes){iso_is_home, iso, home});
    int splits = remesh_split_marked(&r, mark, SPLIT_LEAST_VOX * iso->field->voxel);
    remesh_end(&r);
    round_positions(m);
    mem_free(mark);
    mem_free(home);
    return splits > 0;
}

/* Turns inverted triangles back and takes those that run through one another apart; returns how many pairs are left. */
static int untangle(const IsoSurface *iso, Mesh *m, double edge, Crossings *c)
{
    Remesh r;
    int found;
    int32_t *home = audit_mesh_homes(iso, m);
    remesh_begin(&r, m, iso->field, edge, &(Homes){iso_is_home, iso, home});
    remesh_heal(&r, NULL, &found);
    int left = remesh_uncross(&r, c);
    if (m->deadtri) remesh_compact(&r, NULL);
    remesh_end(&r);
    mem_free(home);
    return left;
}

/* Triangles that run through one another between surfaces too near for their size are split, as far as that helps. */
static void split_crossed(const IsoSurface *iso, Mesh *m, double edge, Crossings *c)
{
    int n = crossings_find(c, m);
    for (int k = 0; k < SPLITS_MAX && n > 0; k++) {
        Mesh trial = {0};
        mesh_copy(&trial, m);
        bool split = split_pairs(iso, &trial, n, c->pair);
        int left = split ? untangle(iso, &trial, edge, c) : n;
        if (left < n) {
            Mesh was = *m;
            *m = trial;
            trial = was;
        }
        mesh_free(&trial);
        if (left >= n) break;
        n = crossings_find(c, m);
    }
}

void mend_mesh(const IsoSurface *iso, const MendOptions *opt, Mesh *m, MendStat *stat)
{
    bool again = true, crossed = true;
    for (int round = 0; again && round < ROUNDS; round++) {
        Verdict v;
        judge(iso, opt, m, round, &v);
        again = v.any;
        crossed = again || v.faults.crossed > 0;
        if (v.crumbs && round > (opt->early ? 1 : 0)) round = int_max(round, ROUND_EXACT); /* coarser they did not match */
        if (round == 0) stat->faults += v.faults.any;
        int patches = stat->npatch;
        if (again) mend_round(iso, opt, m, round, &v, stat);
        if (again && opt->crossings) untangle(iso, m, opt->edge, opt->crossings);
        stat->rounds += again;
        if (stat->npatch == patches && round > 0 && round < ROUND_WHOLE - 1) round = ROUND_WHOLE - 1; /* once more would be the same */
        if (again && round >= ROUND_EXACT) again = !is_mended(iso, m);
        if (opt->early && v.faults.any < real_max(FEW, ONCE_SHARE * m->ntri)) again = false;
        verdict_free(&v);
    }
    if (opt->crossings && crossed) split_crossed(iso, m, opt->edge, opt->crossings);
}

void mend_append(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh)
{
    Mesh fresh;
    Map none = {0};
    uint8_t *speck = NEW(uint8_t, iso->ncomp), *coarse = NEW(uint8_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) {
        speck[k] = want[k] && speck_is(iso, k);
        coarse[k] = want[k] && !speck[k];
    }
    mesh_init(&fresh);
    iso_triangulate(iso, coarse, &fresh, NULL);
    work_patches(iso, &fresh, 0, edge, EVEN_ROUNDS, &none);
    mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
    speck_append(iso, speck, mesh);
    mesh_free(&fresh);
    mem_free(speck);
    mem_free(coarse);
}
