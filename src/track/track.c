/* track.c: the method on one page: predict, audit and mend, alter and relax, audit again, refine. */
#include "base/thread.h"
#include "topology/speck.h"
#include "topology/start.h"
#include "track/track_priv.h"

#include <math.h>
#include <string.h>

enum { GRAIN = 512 };
#define REST_RATIO 0.74      /* e_min and e_max keep edges between about e-hat and 2 e-hat: their mean is about e-hat / 0.74 */
#define REST_RATIO_MIN 0.64
#define REST_RATIO_MAX 0.82
#define EDGE_LEAST_VOX 0.1  /* below it triangles could only multiply */
#define FLIP_GAIN 0.06      /* a tracked edge is flipped only for a clear gain: connectivity is worth keeping */
#define STILL_VOX 1e-4      /* a vertex that the field moves less than this, */
#define STILL_UNREST 2e-3   /* and whose forces want less than this (in edges), is at rest */

TrackSettings track_defaults(void)
{
    return (TrackSettings){
        .edge = 1.5, .edge_in_voxels = true, .e_min = 0.8, .e_max = 2, .eps_e = 0.1, .relax_steps = 3,
        .mech = mechanics_defaults(), .angle_deg = 20, .passes = 4, .deviation_vox = 0.085,
        .refine_by = REFINE_BY_NORMALS, .refine_scheme = REFINE_SCHEME_PAPERS, .min_aspect = 0, .topology = TOPOLOGY_EXACT, .fps = 24,
    };
}

Track *track_open(const TrackSettings *set)
{
    Track *tr = NEW0(Track, 1);
    tr->set = *set;
    tr->rest_ratio = REST_RATIO;
    tr->edge = set->edge_in_voxels ? 0 : set->edge;
    tr->next_midpoint = 1;
    mesh_init(&tr->mesh);
    return tr;
}

void track_close(Track *tr)
{
    if (!tr) return;
    mesh_free(&tr->mesh);
    mem_free(tr->unrest);
    mem_free(tr->frozen);
    mem_free(tr->moved);
    mem_free(tr->comp);
    mechanics_free(&tr->mech);
    refine_free(&tr->refine);
    refined_free(&tr->fine);
    iso_free(&tr->iso);
    crossings_free(&tr->crossings);
    mem_free(tr->mended.patch);
    mem_free(tr->changes.change);
    bodies_free(&tr->bodies);
    events_free(&tr->events);
    rest_free(&tr->rest);
    map_free(&tr->before_at);
    mem_free(tr->before);
    mem_free(tr);
}

const ChangeList *track_changes(const Track *tr) { return &tr->changes; }

/* --- columns beside the mesh's vertices --------------------------------------------------------------------------------- */

/* Vertices from `from` on are new: not at rest, not frozen. */
static void add_columns(Track *tr, int from)
{
    int n = tr->mesh.nvert;
    if (n > tr->capcolumn) {
        tr->capcolumn = mem_capacity(tr->capcolumn, n);
        RESIZE(tr->unrest, tr->capcolumn);
        RESIZE(tr->frozen, tr->capcolumn);
        RESIZE(tr->moved, tr->capcolumn);
    }
    for (int v = from; v < n; v++) tr->unrest[v] = 1, tr->frozen[v] = 0, tr->moved[v] = 1;
}

static void move_columns(Track *tr, int n, const int32_t *to)
{
    for (int v = 0; v < n; v++)
        if (to[v] != NONE) tr->unrest[to[v]] = tr->unrest[v], tr->frozen[to[v]] = tr->frozen[v], tr->moved[to[v]] = tr->moved[v];
}

static void compact(Track *tr, Remesh *r)
{
    int n = tr->mesh.nvert;
    int32_t *to = NEW(int32_t, n);
    if (r) remesh_compact(r, to);
    else mesh_compact(&tr->mesh, to);
    move_columns(tr, n, to);
    mem_free(to);
}

/* New vertices lie last in memory; before a frame, once they are many, they are put where their neighbours are. */
static void gather_strewn(Track *tr)
{
    Mesh *m = &tr->mesh;
    if (!tr->last_field || !remesh_is_strewn(m)) return;
    int32_t *to = NEW(int32_t, m->nvert);
    float *unrest = NEW(float, m->nvert);
    remesh_sort(m, tr->last_field, to);
    memcpy(unrest, tr->unrest, (size_t)m->nvert * sizeof *unrest);
    for (int v = 0; v < m->nvert; v++) tr->unrest[to[v]] = unrest[v]; /* the other columns are made anew in each frame */
    if (tr->set.rest) rest_sort(&tr->rest, to);
    mem_free(to);
    mem_free(unrest);
}

/* Ends of edges changed in this step are awake. */
static void wake_changed(Track *tr, int first_new)
{
    const Mesh *m = &tr->mesh;
    add_columns(tr, first_new);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!tri_is_dead(m, h / 3) && m->flag[h] & EDGE_FLAGGED) tr->unrest[he_from(m, h)] = 1, tr->frozen[he_from(m, h)] = 0, tr->moved[he_from(m, h)] = 1;
}

/* Frozen: at rest, under a field that did not move it, and so are its neighbours. */
static void freeze(Track *tr, const Vec3 *was, FrameStat *stat)
{
    const Mesh *m = &tr->mesh;
    uint8_t *still = NEW(uint8_t, m->nvert);
    double limit = STILL_VOX * tr->field->voxel;
    for (int v = 0; v < m->nvert; v++) {
        tr->moved[v] = v_len2(v_sub(m->pos[v], was[v])) >= limit * limit;
        still[v] = tr->unrest[v] < STILL_UNREST && !tr->moved[v];
    }
    memcpy(tr->frozen, still, (size_t)m->nvert);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!still[he_to(m, h)]) tr->frozen[he_from(m, h)] = 0;
    for (int v = 0; v < m->nvert; v++) stat->frozen_vertices += tr->frozen[v];
    mem_free(still);
}

/* --- steps ---------------------------------------------------------------------------------------------------------------- */

void track_find_components(Track *tr)
{
    RESERVE(tr->comp, tr->capcomp, tr->mesh.ntri);
    tr->ncomp = mesh_components(&tr->mesh, tr->comp, NULL);
}

/* The component of the isosurface that each vertex belongs to, by those of the mesh; the caller frees it. The papers bind no
 * vertex: after a split a mesh lies on two components until it is cut. */
static int32_t *find_homes(const Track *tr, const IsoSurface *iso)
{
    const Mesh *m = &tr->mesh;
    int32_t *home = NEW(int32_t, m->nvert);
    audit_homes(iso, &(AuditMesh){m->nvert, m->ntri, tr->ncomp, m->pos, m->corner, tr->comp}, home);
    for (int v = 0; v < m->nvert && tr->set.topology == TOPOLOGY_PAPERS; v++) home[v] = NONE;
    return home;
}

/* What landing left astray or turned over is put right where that costs nothing, before it is mended. */
static void tidy_landing(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    Remesh r;
    int found, n = tr->mesh.nvert;
    int32_t *home = NEW(int32_t, n); /* which component a vertex belongs to is not known yet */
    memset(home, 0xff, (size_t)n * sizeof *home);
    remesh_begin(&r, &tr->mesh, tr->field, tr->edge, &(Homes){iso_is_home, iso, home});
    remesh_rehome(&r, tr->frozen);
    remesh_heal(&r, tr->frozen, &found);
    stat->inverted_found += found;
    wake_changed(tr, n);
    compact(tr, &r);
    remesh_end(&r);
    mem_free(home);
}

static void begin_edits(Track *tr, const IsoSurface *iso, Remesh *r)
{
    int32_t *home = find_homes(tr, iso);
    remesh_begin(r, &tr->mesh, tr->field, tr->edge, &(Homes){iso_is_home, iso, home});
    mem_free(home);
}

/* What stretched or shrank edges adds to the unrest of their ends; those of changed edges are awake already. */
static void stir_block(void *ctx, int begin, int end)
{
    Track *tr = ctx;
    const Mesh *m = &tr->mesh;
    for (int v = begin; v < end; v++) {
        double most = 0;
        int h = m->out[v];
        do
            if (m->length[h] >= 0) most = real_max(most, fabs(mesh_edge_length(m, h) - (double)m->length[h]));
        while ((h = he_around(m, h)) != m->out[v]);
        tr->unrest[v] += (float)(most / tr->edge);
    }
}

/* Last frame's mesh onto this frame's surface. */
static void predict(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    double t0 = track_clock(), limit = STILL_VOX * tr->field->voxel;
    Mesh *m = &tr->mesh;
    Vec3 *was = NEW(Vec3, m->nvert);
    memcpy(was, m->pos, (size_t)m->nvert * sizeof *was);
    stat->projections_lost = track_predict(tr, m->nvert, m->pos, NULL, &stat->predict_substeps);
    for (int v = 0; v < m->nvert; v++) /* what the surface did not move stays to the bit */
        if (v_len2(v_sub(m->pos[v], was[v])) < limit * limit) m->pos[v] = was[v];
    freeze(tr, was, stat);
    mem_free(was);
    if (tr->set.rest) rest_carry(tr);
    if (tr->set.topology == TOPOLOGY_PAPERS) { /* while what has lost its surface still lies where it lost it */
        int first = m->nvert;
        track_papers_deaths(tr);
        track_papers_rejoin(tr);
        wake_changed(tr, first);
        compact(tr, NULL);
    }
    tidy_landing(tr, iso, stat);
    parallel_for(m->nvert, GRAIN, stir_block, tr);
    stat->seconds.predict += track_clock() - t0;
}

/* The edge length to make triangles of that relaxing brings to the one wanted. */
static double edge_made(const Track *tr) { return tr->edge * tr->rest_ratio / REST_RATIO; }

/* Where there was no mesh. The papers' rules begin with the exact one. */
static void start(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    double t0 = track_clock();
    start_mesh(iso, edge_made(tr), &tr->mesh);
    add_columns(tr, 0);
    stat->seconds.mend += track_clock() - t0;
}

/* What is written is what the next frame starts from. */
static void round_positions(Track *tr)
{
    Mesh *m = &tr->mesh;
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_round32(m->pos[v]);
}

/* The columns of vertices that are still there go with them; the others are new. */
static void carry_columns(Track *tr, int n, const int32_t *id, const float *unrest, const uint8_t *frozen, const uint8_t *moved)
{
    const Mesh *m = &tr->mesh;
    Map at;
    map_init(&at, n);
    for (int i = 0; i < n; i++) map_put(&at, (uint64_t)id[i], i);
    add_columns(tr, 0);
    for (int v = 0; v < m->nvert; v++) {
        int i = map_get(&at, (uint64_t)m->id[v]);
        if (i != NONE) tr->unrest[v] = unrest[i], tr->frozen[v] = frozen[i], tr->moved[v] = moved[i];
    }
    map_free(&at);
}

/* Brings the mesh to the isosurface's topology: before it is relaxed, and after, when what that may have spoilt is mended too. Where there
 * was no mesh the first mend is no early one: all of it would be patches evened less. */
static void audit_and_mend(Track *tr, const IsoSurface *iso, bool relaxed, FrameStat *stat)
{
    double t0 = track_clock();
    Mesh *m = &tr->mesh;
    int n = m->nvert, rounds = tr->mended.rounds;
    int32_t *id = NEW(int32_t, n);
    float *unrest = NEW(float, n);
    uint8_t *frozen = NEW(uint8_t, n), *moved = NEW(uint8_t, n);
    for (int v = 0; v < n; v++) id[v] = m->id[v], unrest[v] = tr->unrest[v], frozen[v] = tr->frozen[v], moved[v] = tr->moved[v];
    mend_mesh(iso, &(MendOptions){edge_made(tr), frozen, relaxed ? &tr->crossings : NULL, !relaxed && m->ntri > 0}, m, &tr->mended);
    if (tr->mended.rounds > rounds) carry_columns(tr, n, id, unrest, frozen, moved);
    mem_free(id);
    mem_free(unrest);
    mem_free(frozen);
    mem_free(moved);
    stat->seconds.mend += track_clock() - t0;
}

/* Does nothing that the prediction met, nor the count of components and of their holes, speak against the mesh matching? Then relaxing
 * may start from it as it is. */
static bool may_match(const Track *tr, const IsoSurface *iso, const FrameStat *stat)
{
    const Mesh *m = &tr->mesh;
    return stat->projections_lost + stat->inverted_found == 0 && m->nvert - m->ntri / 2 == stat->audit_euler && tr->ncomp == iso->ncomp;
}

/* Specks stay as they are drawn. */
static void hold_specks(Track *tr, const IsoSurface *iso, const Remesh *r)
{
    for (int v = 0; v < tr->mesh.nvert; v++)
        if (r->home[v] != NONE && speck_is(iso, r->home[v])) tr->frozen[v] = 1;
}

/* held: of the last step in this frame, NULL before the first. */
static void alter(Track *tr, Remesh *r, const uint8_t *held, FrameStat *stat)
{
    AlterRules rules = {tr->rest_ratio * tr->edge, tr->set.e_min, tr->set.e_max, tr->set.eps_e};
    int n = tr->mesh.nvert;
    if (held) remesh_narrow(r, held);
    RemeshStat s = remesh_alter(r, &rules);
    stat->splits += s.splits;
    stat->collapses += s.collapses;
    stat->flips += remesh_flip(r, FLIP_GAIN);
    wake_changed(tr, n);
    compact(tr, r); /* the kernels want dense columns */
}

/* Poor triangles, where the field moves or edges were changed: elsewhere the forces alone come to rest. To the papers' rules poor
 * triangles tell where the surface tears. */
static void improve(const Track *tr, Remesh *r)
{
    if (tr->set.topology == TOPOLOGY_PAPERS) return;
    uint8_t *held = NEW(uint8_t, tr->mesh.nvert);
    for (int v = 0; v < tr->mesh.nvert; v++) held[v] = tr->frozen[v] || !tr->moved[v];
    remesh_improve(r, held);
    mem_free(held);
}

static void alter_and_relax(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    double began = track_clock();
    Mesh *m = &tr->mesh;
    Remesh r;
    int awake = 0;
    for (int v = 0; v < m->nvert; v++) awake += !tr->frozen[v];
    if (awake == 0) return;
    begin_edits(tr, iso, &r);
    hold_specks(tr, iso, &r);
    uint8_t *held = NULL;
    for (int k = 0; k < tr->set.relax_steps; k++) {
        alter(tr, &r, held, stat);
        double t0 = track_clock();
        mem_free(held);
        held = track_relax(tr, &r, k, stat);
        stat->seconds.relax += track_clock() - t0;
    }
    mem_free(held);
    improve(tr, &r);
    int found;
    remesh_heal(&r, tr->frozen, &found);
    stat->inverted_found += found;
    remesh_rehome(&r, tr->frozen);
    if (tr->set.topology == TOPOLOGY_EXACT) remesh_uncross(&r, &tr->crossings);
    wake_changed(tr, m->nvert);
    compact(tr, &r);
    remesh_end(&r);
    stat->seconds.alter += track_clock() - began - stat->seconds.relax;
}

static void refine(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    double t0 = track_clock();
    RefineSettings set = {.angle_deg = tr->set.angle_deg, .passes = tr->set.passes, .deviation_vox = tr->set.deviation_vox,
                          .by = tr->set.refine_by, .scheme = tr->set.refine_scheme, .min_aspect = tr->set.min_aspect};
    track_find_components(tr);
    int32_t *home = find_homes(tr, iso);
    stat->projections_lost += refine_build(&tr->refine, &tr->mesh, tr->field, &set, &(Homes){iso_is_home, iso, home}, &tr->next_midpoint, &tr->fine);
    mem_free(home);
    stat->seconds.refine += track_clock() - t0;
}

/* After the mechanical mesh's topology was changed. */
static void refine_changed(Track *tr, const IsoSurface *iso, int first_new, FrameStat *stat)
{
    wake_changed(tr, first_new);
    compact(tr, NULL);
    round_positions(tr);
    refine(tr, iso, stat);
}

/* RR-6128 section 4: the mechanical mesh changed until the geometric one shows no more events. */
static void follow_papers(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    Mesh *m = &tr->mesh;
    int first = m->nvert, done = 1;
    track_remember_places(tr);
    track_papers_deaths(tr);
    track_papers_births(tr, iso);
    refine_changed(tr, iso, first, stat);
    for (int k = 0; k < track_papers_rounds() && done; k++) {
        first = m->nvert;
        done = track_papers_events(tr);
        if (m->nvert > first || m->deadtri) refine_changed(tr, iso, first, stat); /* also by what came to nothing */
    }
    if (track_papers_leftovers(tr, iso)) refine_changed(tr, iso, m->nvert, stat);
    tr->refined = true;
}

/* The geometric mesh as it is written. An exact copy of the mechanical one stays one. */
static void finish(Track *tr, FrameStat *stat)
{
    double t0 = track_clock();
    RefinedMesh *f = &tr->fine;
    Vec3 *landed = tr->set.angle_deg < 180 && tr->set.deviation_vox > 0 ? refine_balance(f, tr->field) : NULL;
    crossings_find(&tr->crossings, &tr->mesh);
    stat->self_intersections = refine_untangle(f, tr->field, landed, &tr->crossings, &stat->flattened);
    RefineFigures s = refine_measure(f, tr->field);
    stat->distance_mean_vox = s.mean_vox;
    stat->distance_max_vox = s.max_vox;
    stat->inverted_left_geometric = s.inverted;
    mem_free(landed);
    stat->seconds.refine += track_clock() - t0;
}

/* The geometric mesh must match the grid as well: what is left wrong after all mending is reported. */
static int audit_geometric(const Track *tr, const IsoSurface *iso)
{
    const RefinedMesh *f = &tr->fine;
    int32_t *comp = NEW(int32_t, f->ntri), *partner = NEW(int32_t, tr->ncomp);
    uint8_t *mesh_bad = NEW(uint8_t, tr->ncomp), *iso_bad = NEW(uint8_t, iso->ncomp);
    for (int t = 0; t < f->ntri; t++) comp[t] = tr->comp[f->parent[t]];
    AuditMesh a = {f->nvert, f->ntri, tr->ncomp, f->pos, f->tri, comp};
    AuditStat s = audit_match(iso, &a, false, mesh_bad, iso_bad, partner);
    mem_free(comp);
    mem_free(partner);
    mem_free(mesh_bad);
    mem_free(iso_bad);
    return int_max(s.euler_errors, s.wrong_iso);
}

/* --- a frame ------------------------------------------------------------------------------------------------------------- */

static void adapt_rest(Track *tr)
{
    const Mesh *m = &tr->mesh;
    double sum = 0;
    for (int h = 0; h < 3 * m->ntri; h++) sum += mesh_edge_length(m, h);
    double ratio = m->ntri ? tr->edge / (sum / (3 * m->ntri)) : 1;
    tr->rest_ratio = real_clamp(tr->rest_ratio * real_clamp(sqrt(ratio), 0.97, 1.03), REST_RATIO_MIN, REST_RATIO_MAX);
    tr->set.mech.rest = tr->rest_ratio * tr->edge;
}

static void report_mending(const Track *tr, FrameStat *stat)
{
    const MendStat *s = &tr->mended;
    stat->mend_faults = s->faults;
    stat->mend_patches = s->npatch;
    stat->replaced_vertices = s->dropped - s->survived;
    stat->remade_components = s->whole;
    stat->raw_components = s->raw;
}

/* Is the surface last frame's, to the bit, and nothing there to move what is on it? Then the meshes are too. */
static bool stands_still(const Track *tr, const Field *field, const Grid *velocity)
{
    return tr->begun && tr->set.topology == TOPOLOGY_EXACT && !velocity && !tr->velocity && field_is_same(tr->field, field);
}

/* A new frame begins. */
static void begin_frame(Track *tr, const Field *field, const Grid *velocity, double frames)
{
    tr->still = stands_still(tr, field, velocity);
    tr->changes.n = 0;
    tr->last_field = tr->field;
    tr->last_velocity = tr->velocity;
    tr->field = field;
    tr->velocity = velocity;
    tr->span_s = frames / tr->set.fps;
    if (tr->begun) tr->rest.now += (int64_t)frames;
    tr->begun = true;
    tr->refined = false;
    tr->mended = (MendStat){.patch = tr->mended.patch, .cappatch = tr->mended.cappatch};
}

static void find_surface(Track *tr, FrameStat *stat)
{
    double t0 = track_clock();
    IsoSurface *iso = &tr->iso;
    iso_free(iso);
    iso_build(iso, tr->field);
    stat->audit_components = iso->ncomp;
    for (int k = 0; k < iso->ncomp; k++) stat->audit_euler += iso->comp_euler[k];
    stat->seconds.audit += track_clock() - t0;
}

bool track_solve(Track *tr, const Field *field, const Grid *velocity, double frames, FrameStat *stat, Err *err)
{
    *stat = (FrameStat){0};
    if (field->nbrick && tr->edge == 0) tr->edge = tr->set.edge * field->voxel;
    if (field->nbrick && tr->edge < EDGE_LEAST_VOX * field->voxel)
        return fail(err, ERR_USAGE, "an edge of %g is less than a tenth of the frame's voxels (%g); give it in voxels, such as --edge 1.5v", tr->edge, field->voxel);
    begin_frame(tr, field, velocity, frames);
    if (tr->still) return true;
    if (field->nbrick == 0) mesh_clear(&tr->mesh);
    gather_strewn(tr);
    adapt_rest(tr);
    Census census;
    census_take(&census, &tr->mesh);
    find_surface(tr, stat);
    const IsoSurface *iso = &tr->iso;
    bool mend = tr->set.topology == TOPOLOGY_EXACT || tr->mesh.ntri == 0;
    if (tr->mesh.ntri) predict(tr, iso, stat);
    else if (tr->set.topology == TOPOLOGY_EXACT) start(tr, iso, stat);
    track_find_components(tr);
    if (mend && !may_match(tr, iso, stat)) {
        audit_and_mend(tr, iso, false, stat);
        track_find_components(tr);
    }
    alter_and_relax(tr, iso, stat);
    round_positions(tr);
    if (mend) audit_and_mend(tr, iso, true, stat);
    remesh_remember_lengths(&tr->mesh, NULL);
    if (tr->set.topology == TOPOLOGY_PAPERS && !mend) follow_papers(tr, iso, stat); /* a mesh just made has had no events */
    if (tr->set.rest) rest_settle(tr);
    stat->ids_kept = census_share_kept(&census, &tr->mesh);
    census_free(&census);
    report_mending(tr, stat);
    return true;
}

void track_pass_on(Track *from, Track *to)
{
    ASSERT(from->set.topology != TOPOLOGY_PAPERS);
    const Mesh *m = &from->mesh;
    mesh_copy(&to->mesh, m);
    add_columns(to, m->nvert);
    for (int v = 0; v < m->nvert; v++) to->unrest[v] = from->unrest[v];
    to->edge = from->edge;
    to->rest_ratio = from->rest_ratio;
    to->begun = from->begun;
    to->field = from->field, to->last_field = from->last_field;
    to->velocity = from->velocity, to->last_velocity = from->last_velocity;
    to->span_s = from->span_s;
    to->still = from->still;
    rest_copy(&to->rest, &from->rest);
    iso_free(&to->iso);
    to->iso = from->iso;
    from->iso = (IsoSurface){0};
    MendStat mended = to->mended;
    to->mended = from->mended;
    from->mended = mended;
    Crossings crossings = to->crossings;
    to->crossings = from->crossings;
    from->crossings = crossings;
}

/* What the figures of a frame are in the next one, if nothing changes. */
static FrameStat figures_still(const FrameStat *last)
{
    FrameStat s = *last;
    s.splits = s.collapses = s.flips = s.relax_steps = s.cg_iterations = s.predict_substeps = 0;
    s.projections_lost = s.inverted_found = s.flattened = 0;
    s.mend_faults = s.mend_patches = s.replaced_vertices = s.remade_components = 0;
    s.cg_residual = 0;
    s.frozen_vertices = s.vertices_mechanical;
    s.ids_kept = s.vertices_mechanical ? 1 : NAN;
    memset(s.events, 0, sizeof s.events);
    memset(&s.seconds, 0, sizeof s.seconds);
    return s;
}

void track_complete(Track *tr, FrameStat *stat)
{
    if (tr->still) {
        track_remember_places(tr);
        track_find_no_events(tr);
        *stat = tr->last = figures_still(&tr->last);
        return;
    }
    if (!tr->refined) {
        track_remember_places(tr);
        refine(tr, &tr->iso, stat);
    }
    finish(tr, stat);
    double t0 = track_clock();
    stat->wrong_components = audit_geometric(tr, &tr->iso);
    track_find_events(tr, stat);
    iso_free(&tr->iso);
    track_measure(tr, stat);
    stat->seconds.audit += track_clock() - t0;
    tr->last = *stat;
}

bool track_frame(Track *tr, const Field *field, const Grid *velocity, double frames, FrameStat *stat, Err *err)
{
    if (!track_solve(tr, field, velocity, frames, stat, err)) return false;
    track_complete(tr, stat);
    return true;
}
