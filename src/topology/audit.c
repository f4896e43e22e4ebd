#include "topology/audit.h"

#include "base/thread.h"
#include "topology/speck.h"

#include <string.h>

enum { GRAIN = 1024 };

/* A component is uncovered when more cells than this, and more than this share of its own, have no mesh in their 3^3
 * neighbourhood: a tip that a coarse triangle cuts off is for refinement to find, a lost limb is not. */
enum { UNCOVERED_CELLS_MAX = 24 };
#define UNCOVERED_SHARE_MAX 0.004

/* So is one when more of its triangles than these are farther than FAR_VOX from the surface: it was outrun. */
enum { FAR_TRIANGLES_MAX = 30 };
#define FAR_SHARE_MAX 0.02
#define FAR_VOX 0.8

/* The coarse mesh of a small component loses much of its volume (an octahedron in a ball keeps a third of it), but must
 * not turn inside out, wither or lie elsewhere. */
#define VOLUME_RATIO_MIN 0.3
#define VOLUME_RATIO_MAX 2.0
#define BOX_MARGIN_VOX 0.3

/* --- where the vertices lie ------------------------------------------------------------------------------------------ */

typedef struct LocateJob {
    const IsoSurface *iso;
    const AuditMesh *mesh;
    int32_t *comp; /* [nvert] of the isosurface, or NONE */
    uint8_t *sure; /* [nvert] */
} LocateJob;

static void locate_block(void *ctx, int begin, int end)
{
    LocateJob *job = ctx;
    for (int v = begin; v < end; v++) {
        bool sure;
        job->comp[v] = iso_component_at(job->iso, job->mesh->pos[v], &sure);
        job->sure[v] = sure;
    }
}

/* The component of the isosurface each mesh component sits on: where most of its sure vertices are. */
static void find_partners(const AuditMesh *mesh, const LocateJob *at, int32_t *partner)
{
    int32_t *votes = NEW0(int32_t, mesh->ncomp); /* majority vote in one sweep (Boyer and Moore), sure vertices first */
    for (int c = 0; c < mesh->ncomp; c++) partner[c] = NONE;
    for (int pass = 0; pass < 2; pass++)
        for (int h = 0; h < 3 * mesh->ntri; h++) {
            int v = mesh->tri[h], c = mesh->tri_comp[h / 3];
            if (at->comp[v] == NONE || (pass == 0) != at->sure[v] || (pass == 1 && partner[c] != NONE)) continue;
            if (votes[c] == 0) partner[c] = at->comp[v];
            votes[c] += partner[c] == at->comp[v] ? 1 : -1;
        }
    mem_free(votes);
}

/* --- Euler characteristic of each mesh component ------------------------------------------------------------------------ */

static void count_euler(const AuditMesh *mesh, int32_t *euler)
{
    uint8_t *seen = NEW0(uint8_t, mesh->nvert);
    int32_t *faces = NEW0(int32_t, mesh->ncomp);
    memset(euler, 0, (size_t)mesh->ncomp * sizeof *euler);
    for (int h = 0; h < 3 * mesh->ntri; h++) {
        int c = mesh->tri_comp[h / 3];
        if (h % 3 == 0) faces[c]++;
        if (seen[mesh->tri[h]]) continue;
        seen[mesh->tri[h]] = 1;
        euler[c]++;
    }
    for (int c = 0; c < mesh->ncomp; c++) euler[c] -= faces[c] / 2; /* closed: three half-edges a face, two an edge */
    mem_free(seen);
    mem_free(faces);
}

/* --- size ------------------------------------------------------------------------------------------------------------------ */

typedef struct Size {
    double volume; /* voxels */
    Vec3 lo, hi;   /* index space */
} Size;

static void measure_sizes(const IsoSurface *iso, const AuditMesh *mesh, Size *size)
{
    const Field *f = iso->field;
    for (int c = 0; c < mesh->ncomp; c++) size[c] = (Size){0, vec3(1e30, 1e30, 1e30), vec3(-1e30, -1e30, -1e30)};
    for (int t = 0; t < mesh->ntri; t++) {
        Size *s = &size[mesh->tri_comp[t]];
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            Vec3 q = p[k] = affine_to_index(&f->xform, mesh->pos[mesh->tri[3 * t + k]]);
            s->lo = vec3(real_min(s->lo.x, q.x), real_min(s->lo.y, q.y), real_min(s->lo.z, q.z));
            s->hi = vec3(real_max(s->hi.x, q.x), real_max(s->hi.y, q.y), real_max(s->hi.z, q.z));
        }
        Vec3 o = vec3(f->lo[0], f->lo[1], f->lo[2]);
        s->volume += v_dot(v_sub(p[0], o), v_cross(v_sub(p[1], o), v_sub(p[2], o))) / (f->mirrored ? -6 : 6);
    }
}

static bool is_like(const Size *s, double volume, const Vec3 box[2])
{
    double ratio = s->volume / volume;
    if (!(ratio >= VOLUME_RATIO_MIN && ratio <= VOLUME_RATIO_MAX)) return false;
    for (int a = 0; a < 3; a++)
        if (v_get(s->lo, a) < v_get(box[0], a) - BOX_MARGIN_VOX || v_get(s->hi, a) > v_get(box[1], a) + BOX_MARGIN_VOX) return false;
    return true;
}

/* --- coverage ------------------------------------------------------------------------------------------------------------- */

static void mark_hit(const IsoSurface *iso, Vec3 p, uint8_t *hit)
{
    int c = iso_cell_at(iso, p);
    if (c != NONE) hit[c] = 1;
}

/* Samples the triangles at most about a voxel apart. */
static void mark_triangles(const IsoSurface *iso, const AuditMesh *mesh, uint8_t *hit)
{
    double voxel = iso->field->voxel;
    for (int t = 0; t < mesh->ntri; t++) {
        Vec3 a = mesh->pos[mesh->tri[3 * t]], b = mesh->pos[mesh->tri[3 * t + 1]], c = mesh->pos[mesh->tri[3 * t + 2]];
        double longest = sqrt(real_max(v_len2(v_sub(b, a)), real_max(v_len2(v_sub(c, b)), v_len2(v_sub(a, c)))));
        int n = int_clamp((int)(longest / voxel) + 1, 1, 16);
        for (int i = 0; i <= n; i++)
            for (int j = 0; j <= n - i; j++) mark_hit(iso, v_axpy(v_axpy(a, (double)i / n, v_sub(b, a)), (double)j / n, v_sub(c, a)), hit);
    }
}

static bool is_near_hit(const IsoSurface *iso, int cell, const uint8_t *hit)
{
    const Field *f = iso->field;
    int at = iso->cell_at[cell], brick = at / GRID_CELLS, local = at % GRID_CELLS;
    int x = f->origin[brick][0] + (local & 7), y = f->origin[brick][1] + (local >> 3 & 7), z = f->origin[brick][2] + (local >> 6);
    for (int k = 0; k < 27; k++) {
        int i = x + k % 3 - 1, j = y + k / 3 % 3 - 1, l = z + k / 9 - 1, b = field_brick(f, i, j, l);
        int c = b == NONE ? NONE : iso->cell_index[b * GRID_CELLS + ((l & 7) * 8 + (j & 7)) * 8 + (i & 7)];
        if (c != NONE && hit[c]) return true;
    }
    return false;
}

/* Uncovered cells of each component; returns their number. */
static int count_uncovered(const IsoSurface *iso, const AuditMesh *mesh, int32_t *uncovered)
{
    uint8_t *hit = NEW0(uint8_t, iso->ncell);
    int n = 0;
    mark_triangles(iso, mesh, hit);
    for (int c = 0; c < iso->ncell; c++) {
        if (hit[c] || is_near_hit(iso, c, hit)) continue;
        n++;
        for (int l = iso->cell_loop[c]; l < iso->cell_loop[c + 1]; l++) uncovered[iso_loop_component(iso, l)]++;
    }
    mem_free(hit);
    return n;
}

/* --- the match ------------------------------------------------------------------------------------------------------------- */

static int count_strayed(const AuditMesh *mesh, const LocateJob *at, const int32_t *partner, uint8_t *mesh_bad)
{
    int strayed = 0;
    uint8_t *seen = NEW0(uint8_t, mesh->nvert);
    for (int h = 0; h < 3 * mesh->ntri; h++) {
        int v = mesh->tri[h], c = mesh->tri_comp[h / 3];
        if (seen[v]) continue;
        seen[v] = 1;
        if (at->comp[v] != NONE && (at->comp[v] == partner[c] || !at->sure[v])) continue;
        if (mesh_bad) mesh_bad[c] = 1;
        strayed++;
    }
    mem_free(seen);
    return strayed;
}

/* Marks the components whose mesh the surface has outrun; returns the number of triangles far away. */
static int count_far(const Field *f, const AuditMesh *mesh, uint8_t *mesh_bad)
{
    int32_t *far = NEW0(int32_t, mesh->ncomp), *all = NEW0(int32_t, mesh->ncomp);
    int n = 0;
    for (int t = 0; t < mesh->ntri; t++) {
        const int32_t *c = mesh->tri + 3 * t;
        Vec3 g, p = v_scale(v_add(v_add(mesh->pos[c[0]], mesh->pos[c[1]]), mesh->pos[c[2]]), 1.0 / 3);
        double F = field_value(f, p, &g, NULL);
        bool is_far = fabs(F) > FAR_VOX * f->voxel * v_len(g);
        far[mesh->tri_comp[t]] += is_far;
        all[mesh->tri_comp[t]]++;
        n += is_far;
    }
    for (int c = 0; c < mesh->ncomp; c++)
        if (far[c] > FAR_TRIANGLES_MAX && far[c] > FAR_SHARE_MAX * all[c]) mesh_bad[c] = 1;
    mem_free(far);
    mem_free(all);
    return n;
}

static int count_degenerate(const AuditMesh *mesh, uint8_t *mesh_bad)
{
    int n = 0;
    for (int t = 0; t < mesh->ntri; t++) {
        const int32_t *c = mesh->tri + 3 * t;
        if (v_len2(v_area2(mesh->pos[c[0]], mesh->pos[c[1]], mesh->pos[c[2]])) > 0) continue;
        mesh_bad[mesh->tri_comp[t]] = 1;
        n++;
    }
    return n;
}

AuditStat audit_match(const IsoSurface *iso, const AuditMesh *mesh, int rules, uint8_t *mesh_bad, uint8_t *iso_bad, int32_t *partner_out)
{
    AuditStat stat = {0};
    int32_t *partner = NEW(int32_t, mesh->ncomp), *euler = NEW(int32_t, mesh->ncomp);
    int32_t *taken = NEW(int32_t, iso->ncomp), *uncovered = NEW0(int32_t, iso->ncomp);
    LocateJob at = {iso, mesh, NEW(int32_t, mesh->nvert), NEW(uint8_t, mesh->nvert)};
    memset(mesh_bad, 0, (size_t)mesh->ncomp);
    memset(iso_bad, 0, (size_t)iso->ncomp);
    parallel_for(mesh->nvert, GRAIN, locate_block, &at);
    find_partners(mesh, &at, partner);
    count_euler(mesh, euler);
    Size *size = mem_alloc((size_t)mesh->ncomp, sizeof *size);
    measure_sizes(iso, mesh, size);
    stat.strayed = count_strayed(mesh, &at, partner, rules & AUDIT_STRAYS ? mesh_bad : NULL);
    if (rules & AUDIT_STRAYS) stat.degenerate = count_degenerate(mesh, mesh_bad);
    if (rules & AUDIT_FAR) stat.far_triangles = count_far(iso->field, mesh, mesh_bad);
    if (rules & AUDIT_COVERAGE) stat.uncovered_cells = count_uncovered(iso, mesh, uncovered);
    for (int k = 0; k < iso->ncomp; k++) taken[k] = NONE;
    for (int c = 0; c < mesh->ncomp; c++) {
        int k = partner[c];
        if (k == NONE) {
            mesh_bad[c] = 1;
            continue;
        }
        if (euler[c] != iso->comp_euler[k]) mesh_bad[c] = 1, stat.euler_errors++;
        if (rules & AUDIT_SIZE && !speck_is(iso, k) && !is_like(&size[c], iso->comp_volume[k], iso->comp_box[k])) mesh_bad[c] = 1, stat.size_errors++;
        if (uncovered[k] > UNCOVERED_CELLS_MAX && uncovered[k] > UNCOVERED_SHARE_MAX * iso->comp_loops[k]) mesh_bad[c] = 1;
        if (taken[k] != NONE) mesh_bad[c] = mesh_bad[taken[k]] = 1; /* two on one: neither is trusted */
        else taken[k] = c;
    }
    for (int k = 0; k < iso->ncomp; k++) {
        iso_bad[k] = taken[k] == NONE || mesh_bad[taken[k]];
        stat.wrong_iso += iso_bad[k];
    }
    for (int c = 0; c < mesh->ncomp; c++) stat.wrong_mesh += mesh_bad[c];
    if (partner_out) memcpy(partner_out, partner, (size_t)mesh->ncomp * sizeof *partner);
    mem_free(partner);
    mem_free(euler);
    mem_free(taken);
    mem_free(uncovered);
    mem_free(size);
    mem_free(at.comp);
    mem_free(at.sure);
    return stat;
}

void audit_homes(const IsoSurface *iso, const AuditMesh *mesh, int32_t *home)
{
    int32_t *partner = NEW(int32_t, mesh->ncomp);
    LocateJob at = {iso, mesh, NEW(int32_t, mesh->nvert), NEW(uint8_t, mesh->nvert)};
    parallel_for(mesh->nvert, GRAIN, locate_block, &at);
    find_partners(mesh, &at, partner);
    for (int v = 0; v < mesh->nvert; v++) home[v] = NONE;
    for (int h = 0; h < 3 * mesh->ntri; h++) home[mesh->tri[h]] = partner[mesh->tri_comp[h / 3]];
    mem_free(partner);
    mem_free(at.comp);
    mem_free(at.sure);
}
