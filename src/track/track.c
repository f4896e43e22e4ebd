/* track.c: the method on one page: predict, audit and mend, alter and relax, audit again, refine. */
#include "topology/remake.h"
#include "topology/speck.h"
#include "track/track_priv.h"

#include <math.h>
#include <string.h>

#define REST_RATIO 0.7      /* e_min 1 and e_max 2 keep edges between e-hat and 2 e-hat: their mean is about e-hat / 0.7 */
#define REST_RATIO_MIN 0.64
#define REST_RATIO_MAX 0.72
#define EDGE_LEAST_VOX 0.1  /* below it triangles could only multiply */
#define FLIP_GAIN 0.15      /* a tracked edge is flipped only for a clear gain: connectivity is worth keeping */
#define STILL_VOX 1e-4      /* a vertex that the field moves less than this, */
#define STILL_UNREST 2e-3   /* and whose forces want less than this (in edges), is at rest */

TrackSettings track_defaults(void)
{
    return (TrackSettings){
        .edge = 1.5, .edge_in_voxels = true, .e_min = 1, .e_max = 2, .eps_e = 0.1, .relax_steps = 3,
        .mech = mechanics_defaults(), .angle_deg = 20, .passes = 4, .deviation_vox = 0.1,
        .topology = TOPOLOGY_EXACT, .fps = 24,
    };
}

Track *track_open(const TrackSettings *set)
{
    Track *tr = NEW0(Track, 1);
    tr->set = *set;
    tr->rest_ratio = REST_RATIO;
    tr->edge = set->edge_in_voxels ? 0 : set->edge;
    mesh_init(&tr->mesh);
    return tr;
}

void track_close(Track *tr)
{
    if (!tr) return;
    mesh_free(&tr->mesh);
    mem_free(tr->unrest);
    mem_free(tr->frozen);
    mechanics_free(&tr->mech);
    refine_free(&tr->refine);
    refined_free(&tr->fine);
    mem_free(tr);
}

/* --- columns beside the mesh's vertices --------------------------------------------------------------------------------- */

/* Vertices from `from` on are new: not at rest, not frozen. */
static void add_columns(Track *tr, int from)
{
    int n = tr->mesh.nvert;
    if (n > tr->capcolumn) {
        tr->capcolumn = int_max(n, 2 * tr->capcolumn);
        RESIZE(tr->unrest, tr->capcolumn);
        RESIZE(tr->frozen, tr->capcolumn);
    }
    for (int v = from; v < n; v++) tr->unrest[v] = 1, tr->frozen[v] = 0;
}

static void move_columns(Track *tr, int n, const int32_t *to)
{
    for (int v = 0; v < n; v++)
        if (to[v] != NONE) tr->unrest[to[v]] = tr->unrest[v], tr->frozen[to[v]] = tr->frozen[v];
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

/* Ends of edges changed in this step are awake. */
static void wake_changed(Track *tr, int first_new)
{
    const Mesh *m = &tr->mesh;
    add_columns(tr, first_new);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!tri_is_dead(m, h / 3) && m->flag[h] & EDGE_FLAGGED) tr->unrest[he_from(m, h)] = 1, tr->frozen[he_from(m, h)] = 0;
}

/* Frozen: at rest, under a field that did not move it, and so are its neighbours. */
static void freeze(Track *tr, const Vec3 *was, FrameStat *stat)
{
    const Mesh *m = &tr->mesh;
    uint8_t *still = NEW(uint8_t, m->nvert);
    double limit = STILL_VOX * tr->field->voxel;
    for (int v = 0; v < m->nvert; v++) still[v] = tr->unrest[v] < STILL_UNREST && v_len2(v_sub(m->pos[v], was[v])) < limit * limit;
    memcpy(tr->frozen, still, (size_t)m->nvert);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!still[he_to(m, h)]) tr->frozen[he_from(m, h)] = 0;
    for (int v = 0; v < m->nvert; v++) stat->frozen_vertices += tr->frozen[v];
    mem_free(still);
}

/* --- steps ---------------------------------------------------------------------------------------------------------------- */

/* The component of the isosurface that each vertex belongs to; the caller frees it. */
static int32_t *find_homes(const Track *tr, const IsoSurface *iso)
{
    const Mesh *m = &tr->mesh;
    int32_t *home = NEW(int32_t, m->nvert), *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL);
    audit_homes(iso, &(AuditMesh){m->nvert, m->ntri, n, m->pos, m->corner, comp}, home);
    mem_free(comp);
    return home;
}

static void begin_edits(Track *tr, const IsoSurface *iso, Remesh *r)
{
    int32_t *home = find_homes(tr, iso);
    remesh_begin(r, &tr->mesh, tr->field, tr->edge, &(Homes){iso_is_home, iso, home});
    mem_free(home);
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
    Remesh r;
    begin_edits(tr, iso, &r);
    remesh_rehome(&r, tr->frozen);
    wake_changed(tr, m->nvert);
    compact(tr, &r);
    remesh_end(&r);
    stat->seconds.predict += track_clock() - t0;
}

/* What is written is what the next frame starts from. */
static void round_positions(Track *tr)
{
    Mesh *m = &tr->mesh;
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_round32(m->pos[v]);
}

/* Specks are taken from the grid at every frame unless they did not move. Returns how many. */
static int renew_specks(const Track *tr, const IsoSurface *iso, const int32_t *tri_comp, const int32_t *partner, uint8_t *mesh_bad, uint8_t *iso_bad)
{
    const Mesh *m = &tr->mesh;
    int n = 0;
    for (int t = 0; t < m->ntri; t++) {
        int c = tri_comp[t], k = partner[c];
        if (tr->frozen[m->corner[3 * t]] || mesh_bad[c] || k == NONE || !speck_is(iso, k)) continue;
        mesh_bad[c] = iso_bad[k] = 1;
        n++;
    }
    return n;
}

/* Drops the components that do not match the grid and makes them anew. */
static void audit_and_mend(Track *tr, const IsoSurface *iso, int rules, Census *census, FrameStat *stat)
{
    double t0 = track_clock();
    Mesh *m = &tr->mesh;
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL);
    int32_t *partner = NEW(int32_t, n);
    uint8_t *mesh_bad = NEW(uint8_t, n), *iso_bad = NEW(uint8_t, iso->ncomp);
    AuditMesh a = {m->nvert, m->ntri, n, m->pos, m->corner, comp};
    AuditStat audit = audit_match(iso, &a, rules, mesh_bad, iso_bad, partner);
    int specks = renew_specks(tr, iso, comp, partner, mesh_bad, iso_bad);
    double t1 = track_clock();
    stat->seconds.audit += t1 - t0;
    census_mark_remade(census, m, comp, mesh_bad);
    if (audit.wrong_mesh + audit.wrong_iso + specks) {
        mesh_drop_components(m, comp, mesh_bad);
        compact(tr, NULL);
        int first = m->nvert;
        RemakeStat s = remake_components(iso, iso_bad, tr->edge * tr->rest_ratio / REST_RATIO, m);
        add_columns(tr, first);
        for (int v = s.first_plain; v < m->nvert; v++) tr->frozen[v] = 1;
        stat->remade_components += s.components;
        stat->remade_vertices += s.vertices;
        stat->raw_components += s.raw_components;
    }
    mem_free(comp);
    mem_free(mesh_bad);
    mem_free(iso_bad);
    mem_free(partner);
    round_positions(tr);
    stat->seconds.mend += track_clock() - t1;
}

static void alter(Track *tr, Remesh *r, FrameStat *stat)
{
    double t0 = track_clock();
    AlterRules rules = {tr->rest_ratio * tr->edge, tr->set.e_min, tr->set.e_max, tr->set.eps_e};
    int n = tr->mesh.nvert;
    RemeshStat s = remesh_alter(r, &rules);
    stat->splits += s.splits;
    stat->collapses += s.collapses;
    stat->flips += remesh_flip(r, FLIP_GAIN);
    wake_changed(tr, n);
    compact(tr, r); /* the kernels want dense columns */
    stat->seconds.alter += track_clock() - t0;
}

static void alter_and_relax(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    Mesh *m = &tr->mesh;
    Remesh r;
    int awake = 0;
    for (int v = 0; v < m->nvert; v++) awake += !tr->frozen[v];
    if (awake == 0) return;
    begin_edits(tr, iso, &r);
    for (int k = 0; k < tr->set.relax_steps; k++) {
        alter(tr, &r, stat);
        double t0 = track_clock();
        track_relax(tr, &r, stat);
        remesh_remember_lengths(m);
        stat->seconds.relax += track_clock() - t0;
    }
    stat->inverted_left = remesh_heal(&r, tr->frozen, &stat->inverted_found);
    remesh_rehome(&r, tr->frozen);
    wake_changed(tr, m->nvert);
    compact(tr, &r);
    remesh_end(&r);
}

static void refine(Track *tr, const IsoSurface *iso, FrameStat *stat)
{
    double t0 = track_clock();
    RefineSettings set = {tr->set.angle_deg, tr->set.passes, tr->set.deviation_vox};
    int32_t *home = find_homes(tr, iso);
    RefineStat s = refine_build(&tr->refine, &tr->mesh, tr->field, &set, &(Homes){iso_is_home, iso, home}, &tr->mesh.next_id, &tr->fine);
    mem_free(home);
    stat->projections_lost += s.lost;
    stat->distance_mean_vox = s.mean_vox;
    stat->distance_max_vox = s.max_vox;
    stat->inverted_left_geometric = s.inverted;
    stat->seconds.refine += track_clock() - t0;
}

/* The geometric mesh must match the grid as well: what is left wrong after all mending is reported. */
static int audit_geometric(const Track *tr, const IsoSurface *iso)
{
    const RefinedMesh *f = &tr->fine;
    int32_t *mech_comp = NEW(int32_t, tr->mesh.ntri), *comp = NEW(int32_t, f->ntri);
    int n = mesh_components(&tr->mesh, mech_comp, NULL);
    uint8_t *mesh_bad = NEW(uint8_t, n), *iso_bad = NEW(uint8_t, iso->ncomp);
    for (int t = 0; t < f->ntri; t++) comp[t] = mech_comp[f->parent[t]];
    AuditMesh a = {f->nvert, f->ntri, n, f->pos, f->tri, comp};
    AuditStat s = audit_match(iso, &a, 0, mesh_bad, iso_bad, NULL);
    mem_free(mech_comp);
    mem_free(comp);
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

bool track_frame(Track *tr, const Field *field, const Grid *velocity, double frames, FrameStat *stat, Err *err)
{
    *stat = (FrameStat){0};
    if (field->nbrick && tr->edge == 0) tr->edge = tr->set.edge * field->voxel;
    if (field->nbrick && tr->edge < EDGE_LEAST_VOX * field->voxel)
        return fail(err, ERR_USAGE, "an edge of %g is less than a tenth of the frame's voxels (%g); give it in voxels, such as --edge 1.5v", tr->edge, field->voxel);
    tr->last_field = tr->field;
    tr->last_velocity = tr->velocity;
    tr->field = field;
    tr->velocity = velocity;
    tr->span_s = frames / tr->set.fps;
    if (field->nbrick == 0) mesh_clear(&tr->mesh);
    adapt_rest(tr);
    Census census;
    census_take(&census, &tr->mesh);
    double t0 = track_clock();
    IsoSurface iso;
    iso_build(&iso, field);
    stat->audit_components = iso.ncomp;
    for (int k = 0; k < iso.ncomp; k++) stat->audit_euler += iso.comp_euler[k];
    stat->seconds.audit += track_clock() - t0;
    bool mend = tr->set.topology == TOPOLOGY_EXACT || tr->mesh.ntri == 0;
    if (tr->mesh.ntri) predict(tr, &iso, stat);
    const int rules = AUDIT_COVERAGE | AUDIT_STRAYS | AUDIT_SIZE;
    if (mend) audit_and_mend(tr, &iso, rules, &census, stat);
    alter_and_relax(tr, &iso, stat);
    round_positions(tr);
    if (mend) audit_and_mend(tr, &iso, rules | AUDIT_FAR, &census, stat); /* what relaxing may have spoilt */
    remesh_remember_lengths(&tr->mesh);
    refine(tr, &iso, stat);
    t0 = track_clock();
    stat->wrong_components = audit_geometric(tr, &iso);
    iso_free(&iso);
    stat->seconds.audit += track_clock() - t0;
    stat->ids_kept = census_share_kept(&census, &tr->mesh);
    census_free(&census);
    track_measure(tr, stat);
    return true;
}
