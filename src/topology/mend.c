#include "topology/mend.h"

#include "remesh/remesh.h"
#include "topology/fault.h"
#include "topology/graft.h"
#include "topology/speck.h"

#include <string.h>

/* What each round coarsens its patches to, in edges wanted; 0: only healed; NONE: left as they are. */
static const double ROUND_EDGE[] = {1, 1, 0.8, 0.6, 0, NONE};
enum {
    ROUNDS = sizeof ROUND_EDGE / sizeof *ROUND_EDGE,
    ROUND_WHOLE = 1,           /* from here on what does not match is made anew as a whole */
    ROUND_STRICT = 2,          /* from here on only what should not be is mended, and nothing survives inside patches */
    ROUND_EXACT = 4,           /* from here on only what must not be, and once more the others if they are few: */
    FEW = 50,                  /* finer patches for many would do more harm than good */
    SWALLOWED_TRIANGLES = 400, /* a smaller component on another's surface is dropped at once */
    FLIP_ROUNDS = 3,
};
/* A component with more faults than this, and than this share of its loops, that does not match is made anew at once. */
#define FAULTY_MANY 600
#define FAULTY_SHARE 0.02

typedef struct Verdict {
    Faults faults;
    uint8_t *whole;     /* [iso->ncomp] to be made anew */
    uint8_t *wrong;     /* [iso->ncomp] does not match */
    int32_t *faulty;    /* [iso->ncomp] corners of faulty triangles, and uncovered cells */
    bool any;           /* something is to be done */
} Verdict;

static void count_faulty(const IsoSurface *iso, const Mesh *m, Verdict *v)
{
    for (int h = 0; h < 3 * m->ntri; h++)
        if (v->faults.tri[h / 3] && v->faults.comp[m->corner[h]] != NONE) v->faulty[v->faults.comp[m->corner[h]]]++;
    for (int c = 0; c < iso->ncell; c++)
        for (int l = iso->cell_loop[c]; v->faults.cell[c] && l < iso->cell_loop[c + 1]; l++) v->faulty[iso_loop_component(iso, l)]++;
}

static bool has_area(const Mesh *m, int t) { return v_len2(mesh_tri_area2(m, t)) > 0; }

/* Faults that are none of topology, in components that match, stay. */
static void forgive(const Mesh *m, Verdict *v)
{
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t, *comp = v->faults.comp;
        int k = comp[c[0]];
        if (v->faults.degenerate && !has_area(m, t)) continue;
        if (k != NONE && !v->wrong[k] && k == comp[c[1]] && k == comp[c[2]]) v->faults.tri[t] = 0;
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

/* Of several mesh components on one of the isosurface the small ones were swallowed; from the second round on, all but the
 * largest. */
static void drop_swallowed(const IsoSurface *iso, const Mesh *m, const int32_t *comp, int ncomp, const int32_t *partner, int round, Verdict *v)
{
    int32_t *size = NEW0(int32_t, ncomp), *largest = NEW(int32_t, iso->ncomp);
    for (int t = 0; t < m->ntri; t++) size[comp[t]]++;
    for (int k = 0; k < iso->ncomp; k++) largest[k] = NONE;
    for (int c = 0; c < ncomp; c++) {
        int k = partner[c];
        if (k != NONE && (largest[k] == NONE || size[c] > size[largest[k]])) largest[k] = c;
    }
    for (int t = 0; t < m->ntri; t++) {
        int c = comp[t], k = partner[c];
        if (k != NONE && largest[k] != c && (round > 0 || size[c] < SWALLOWED_TRIANGLES)) v->faults.tri[t] = 1;
    }
    mem_free(size);
    mem_free(largest);
}

static bool must_be_whole(const IsoSurface *iso, const Verdict *v, int k, int round)
{
    bool many = v->faulty[k] > FAULTY_MANY && v->faulty[k] > FAULTY_SHARE * iso->comp_loops[k];
    return v->wrong[k] && (round >= ROUND_WHOLE || v->faulty[k] == 0 || many);
}

static void judge(const IsoSurface *iso, const MendOptions *opt, const Mesh *m, int round, Verdict *v)
{
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL);
    int32_t *partner = NEW(int32_t, n);
    uint8_t *mesh_bad = NEW(uint8_t, n);
    *v = (Verdict){.whole = NEW0(uint8_t, iso->ncomp), .wrong = NEW(uint8_t, iso->ncomp), .faulty = NEW0(int32_t, iso->ncomp)};
    AuditStat a = audit_match(iso, &(AuditMesh){m->nvert, m->ntri, n, m->pos, m->corner, comp}, true, mesh_bad, v->wrong, partner);
    Faults *f = &v->faults;
    faults_find(iso, m, v->wrong, opt->crossings, f);
    bool few = round < ROUND_EXACT || (round == ROUND_EXACT && f->inverted + f->crossed < FEW);
    v->any = a.wrong_mesh + a.wrong_iso + f->strays + f->torn + f->degenerate + (round < ROUND_STRICT ? f->any : few ? f->inverted + f->crossed : 0);
    if (!few) forgive(m, v);
    drop_swallowed(iso, m, comp, n, partner, round, v);
    count_faulty(iso, m, v);
    if (round == 0) renew_specks(iso, m, opt->frozen, v);
    for (int k = 0; k < iso->ncomp; k++) {
        if (must_be_whole(iso, v, k, round)) v->whole[k] = 1;
        v->any = v->any || v->whole[k];
    }
    mem_free(comp);
    mem_free(mesh_bad);
    mem_free(partner);
}

static void verdict_free(Verdict *v)
{
    faults_free(&v->faults);
    mem_free(v->whole);
    mem_free(v->wrong);
    mem_free(v->faulty);
}

/* The edges of the triangles that were sound: what is made anew shall look like them. */
static void remember_edges(const Mesh *m, const Faults *f, Map *edges)
{
    map_init(edges, 3 * m->ntri / 2);
    for (int h = 0; h < 3 * m->ntri; h++) {
        int a = m->id[he_from(m, h)], b = m->id[he_to(m, h)];
        if (!f->tri[h / 3] && a < b) map_put(edges, key_pair(a, b), 0);
    }
}

/* Brings the vertices from `first` on to the edge length (0: only heals). */
static void work_patches(const IsoSurface *iso, Mesh *m, int first, double edge, const Map *edges)
{
    Remesh r;
    int found;
    int32_t *home = NEW(int32_t, m->nvert), *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL);
    audit_homes(iso, &(AuditMesh){m->nvert, m->ntri, n, m->pos, m->corner, comp}, home);
    remesh_begin(&r, m, iso->field, edge > 0 ? edge : iso->field->voxel, &(Homes){iso_is_home, iso, home});
    remesh_confine(&r, first);
    if (edge > 0) {
        remesh_coarsen(&r);
        for (int k = 0; k < FLIP_ROUNDS && remesh_flip_towards(&r, edges); k++) {}
    }
    remesh_heal(&r, NULL, &found);
    remesh_rehome(&r, NULL);
    remesh_end(&r);
    mem_free(home);
    mem_free(comp);
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
    for (int k = 0; k < iso->ncomp; k++) n += v->whole[k] || v->faulty[k];
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

static void mend_round(const IsoSurface *iso, const MendOptions *opt, Mesh *m, int round, const Verdict *v, MendStat *stat)
{
    Map edges;
    int first = m->nvert;
    uint8_t *speck = NEW(uint8_t, iso->ncomp);
    GraftPlan plan = {v->faults.comp, v->faults.tri, v->faults.cell, v->whole, v->wrong, opt->edge, round < ROUND_STRICT};
    remember_edges(m, &v->faults, &edges);
    stat->whole += count_whole(iso, m, v->faults.comp, v->whole);
    graft_patches(iso, &plan, m, speck, stat);
    first = compact_new(m, first);
    if (ROUND_EDGE[round] != NONE) work_patches(iso, m, first, ROUND_EDGE[round] * opt->edge, &edges);
    else stat->raw += count_raw(iso, v);
    speck_append(iso, speck, m);
    for (int i = 0; i < m->nvert; i++) m->pos[i] = v_round32(m->pos[i]);
    give_area(m);
    mem_free(speck);
    map_free(&edges);
}

void mend_mesh(const IsoSurface *iso, const MendOptions *opt, Mesh *m, MendStat *stat)
{
    bool again = true;
    for (int round = 0; again && round < ROUNDS; round++) {
        Verdict v;
        judge(iso, opt, m, round, &v);
        again = v.any;
        if (round == 0) stat->faults += v.faults.any;
        if (again) mend_round(iso, opt, m, round, &v, stat);
        stat->rounds += again;
        verdict_free(&v);
    }
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
    work_patches(iso, &fresh, 0, edge, &none);
    mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
    speck_append(iso, speck, mesh);
    mesh_free(&fresh);
    mem_free(speck);
    mem_free(coarse);
}
