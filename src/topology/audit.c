#include "topology/audit.h"

#include "topology/speck.h"

#include <string.h>

/* The coarse mesh of a small component loses much of its volume (an octahedron in a ball keeps a third of it), but must
 * not turn inside out, wither or lie elsewhere. */
#define VOLUME_RATIO_MIN 0.3
#define VOLUME_RATIO_MAX 2.0
#define BOX_MARGIN_VOX 0.3

/* --- where the vertices lie ------------------------------------------------------------------------------------------ */

enum { SAMPLE = 256 }; /* triangles of a component, evenly spread, whose corners tell where it lies; of a smaller one all */

enum { NOT_ASKED, UNSURE, SURE };

typedef struct Located {
    int32_t *comp;  /* [nvert] of the isosurface, or NONE */
    uint8_t *state; /* [nvert] NOT_ASKED, ... */
} Located;

/* Where vertex v lies, if that is as sure as wanted; else NONE. */
static int place_of(const IsoSurface *iso, const AuditMesh *mesh, Located *at, int v, int wanted)
{
    if (at->state[v] == NOT_ASKED) {
        bool sure;
        at->comp[v] = iso_component_at(iso, mesh->pos[v], &sure);
        at->state[v] = sure ? SURE : UNSURE;
    }
    return at->state[v] == wanted ? at->comp[v] : NONE;
}

static int32_t *find_strides(const AuditMesh *mesh)
{
    int32_t *stride = NEW0(int32_t, mesh->ncomp);
    for (int t = 0; t < mesh->ntri; t++) stride[mesh->tri_comp[t]]++;
    for (int c = 0; c < mesh->ncomp; c++) stride[c] = int_max(1, stride[c] / SAMPLE);
    return stride;
}

/* The component of the isosurface each mesh component sits on: where most of its sure vertices are. */
static void locate_partners(const IsoSurface *iso, const AuditMesh *mesh, int32_t *partner)
{
    Located at = {NEW(int32_t, mesh->nvert), NEW0(uint8_t, mesh->nvert)};
    int32_t *stride = find_strides(mesh), *rank = NEW(int32_t, mesh->ncomp);
    int32_t *votes = NEW0(int32_t, mesh->ncomp); /* majority vote in one sweep (Boyer and Moore), sure vertices first */
    for (int c = 0; c < mesh->ncomp; c++) partner[c] = NONE;
    for (int pass = 0; pass < 2; pass++) {
        for (int c = 0; c < mesh->ncomp; c++) rank[c] = 0;
        for (int t = 0; t < mesh->ntri; t++) {
            int c = mesh->tri_comp[t];
            if (rank[c]++ % stride[c]) continue;
            for (int k = 0; k < 3; k++) {
                if (pass == 1 && partner[c] != NONE) continue;
                int place = place_of(iso, mesh, &at, mesh->tri[3 * t + k], pass == 0 ? SURE : UNSURE);
                if (place == NONE) continue;
                if (votes[c] == 0) partner[c] = place;
                votes[c] += partner[c] == place ? 1 : -1;
            }
        }
    }
    mem_free(at.comp);
    mem_free(at.state);
    mem_free(stride);
    mem_free(rank);
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

static Vec3 lower(Vec3 a, Vec3 b) { return vec3(real_min(a.x, b.x), real_min(a.y, b.y), real_min(a.z, b.z)); }
static Vec3 upper(Vec3 a, Vec3 b) { return vec3(real_max(a.x, b.x), real_max(a.y, b.y), real_max(a.z, b.z)); }

static void measure_sizes(const IsoSurface *iso, const AuditMesh *mesh, Size *size)
{
    const Field *f = iso->field;
    const Vec3 corner = vec3(f->lo[0], f->lo[1], f->lo[2]);
    for (int c = 0; c < mesh->ncomp; c++) size[c] = (Size){0, vec3(1e30, 1e30, 1e30), vec3(-1e30, -1e30, -1e30)};
    Vec3 *at = NEW(Vec3, mesh->nvert); /* from the volume's corner */
    for (int v = 0; v < mesh->nvert; v++) at[v] = v_sub(affine_to_index(&f->xform, mesh->pos[v]), corner);
    for (int t = 0; t < mesh->ntri; t++) {
        Size *s = &size[mesh->tri_comp[t]];
        Vec3 p = at[mesh->tri[3 * t]], q = at[mesh->tri[3 * t + 1]], r = at[mesh->tri[3 * t + 2]];
        s->lo = lower(s->lo, lower(p, lower(q, r)));
        s->hi = upper(s->hi, upper(p, upper(q, r)));
        s->volume += v_dot(p, v_cross(q, r)) / (f->mirrored ? -6 : 6);
    }
    for (int c = 0; c < mesh->ncomp; c++) size[c].lo = v_add(size[c].lo, corner), size[c].hi = v_add(size[c].hi, corner);
    mem_free(at);
}

static bool is_like(const Size *s, double volume, const Vec3 box[2])
{
    double ratio = s->volume / volume;
    if (!(ratio >= VOLUME_RATIO_MIN && ratio <= VOLUME_RATIO_MAX)) return false;
    for (int a = 0; a < 3; a++)
        if (v_get(s->lo, a) < v_get(box[0], a) - BOX_MARGIN_VOX || v_get(s->hi, a) > v_get(box[1], a) + BOX_MARGIN_VOX) return false;
    return true;
}

/* --- the match ------------------------------------------------------------------------------------------------------------- */

AuditStat audit_match(const IsoSurface *iso, const AuditMesh *mesh, bool sizes, uint8_t *mesh_bad, uint8_t *iso_bad, int32_t *partner)
{
    AuditStat stat = {0};
    int32_t *euler = NEW(int32_t, mesh->ncomp), *taken = NEW(int32_t, iso->ncomp);
    Size *size = mem_alloc((size_t)mesh->ncomp, sizeof *size);
    memset(mesh_bad, 0, (size_t)mesh->ncomp);
    locate_partners(iso, mesh, partner);
    count_euler(mesh, euler);
    if (sizes) measure_sizes(iso, mesh, size);
    for (int k = 0; k < iso->ncomp; k++) taken[k] = NONE;
    for (int c = 0; c < mesh->ncomp; c++) {
        int k = partner[c];
        if (k == NONE) {
            mesh_bad[c] = 1;
            continue;
        }
        if (euler[c] != iso->comp_euler[k]) mesh_bad[c] = 1, stat.euler_errors++;
        if (sizes && !speck_is(iso, k) && !is_like(&size[c], iso->comp_volume[k], iso->comp_box[k])) mesh_bad[c] = 1, stat.size_errors++;
        if (taken[k] != NONE) mesh_bad[c] = mesh_bad[taken[k]] = 1; /* two on one: neither is trusted */
        else taken[k] = c;
    }
    for (int k = 0; k < iso->ncomp; k++) {
        iso_bad[k] = taken[k] == NONE || mesh_bad[taken[k]];
        stat.wrong_iso += iso_bad[k];
    }
    for (int c = 0; c < mesh->ncomp; c++) stat.wrong_mesh += mesh_bad[c];
    mem_free(euler);
    mem_free(taken);
    mem_free(size);
    return stat;
}

void audit_homes(const IsoSurface *iso, const AuditMesh *mesh, int32_t *home)
{
    int32_t *partner = NEW(int32_t, mesh->ncomp);
    locate_partners(iso, mesh, partner);
    for (int v = 0; v < mesh->nvert; v++) home[v] = NONE;
    for (int h = 0; h < 3 * mesh->ntri; h++) home[mesh->tri[h]] = partner[mesh->tri_comp[h / 3]];
    mem_free(partner);
}

int32_t *audit_mesh_homes(const IsoSurface *iso, const Mesh *mesh)
{
    int32_t *home = NEW(int32_t, mesh->nvert), *comp = NEW(int32_t, mesh->ntri);
    int n = mesh_components(mesh, comp, NULL);
    audit_homes(iso, &(AuditMesh){mesh->nvert, mesh->ntri, n, mesh->pos, mesh->corner, comp}, home);
    mem_free(comp);
    return home;
}
