#include "topology/remake.h"

#include "remesh/remesh.h"
#include "topology/speck.h"

#include <string.h>

#define DROPLET_EDGE 0.6 /* of the edge wanted, for components that the full length spoils */


/* Coarse components that do not sit on their surface any more; sets `again` for them and drops them from the mesh. */
static int drop_strayed(const IsoSurface *iso, const uint8_t *want, Mesh *m, uint8_t *again)
{
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL), strayed = 0;
    uint8_t *bad = NEW(uint8_t, n);
    AuditMesh a = {m->nvert, m->ntri, n, m->pos, m->corner, comp};
    audit_match(iso, &a, AUDIT_STRAYS | AUDIT_SIZE, bad, again, NULL);
    for (int k = 0; k < iso->ncomp; k++) strayed += again[k] = again[k] && want[k];
    if (strayed) {
        mesh_drop_components(m, comp, bad);
        mesh_compact(m, NULL);
    }
    mem_free(comp);
    mem_free(bad);
    return strayed;
}

/* Appends the components from the reference, coarsened to `edge` (0: only healed); again[] is set for those, not appended,
 * that do not sit on their surface afterwards. Returns how many. */
static int append_worked(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh, uint8_t *again)
{
    Mesh fresh;
    Remesh r;
    int found;
    int32_t *home;
    mesh_init(&fresh);
    iso_triangulate(iso, want, &fresh, &home);
    remesh_begin(&r, &fresh, iso->field, edge > 0 ? edge : iso->field->voxel, &(Homes){iso_is_home, iso, home});
    mem_free(home);
    if (edge > 0) remesh_coarsen(&r);
    remesh_heal(&r, NULL, &found);
    remesh_rehome(&r, NULL);
    remesh_end(&r);
    mesh_compact(&fresh, NULL);
    int failed = drop_strayed(iso, want, &fresh, again);
    mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
    mesh_free(&fresh);
    return failed;
}

static void append_reference(const IsoSurface *iso, const uint8_t *want, Mesh *mesh)
{
    Mesh raw;
    mesh_init(&raw);
    iso_triangulate(iso, want, &raw, NULL);
    mesh_append(mesh, raw.nvert, raw.pos, NULL, raw.ntri, raw.corner);
    mesh_free(&raw);
}

RemakeStat remake_components(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh)
{
    RemakeStat stat = {0};
    int before = mesh->nvert - mesh->deadvert, specks = 0, plain = NONE;
    uint8_t *coarse = NEW0(uint8_t, iso->ncomp), *speck = NEW0(uint8_t, iso->ncomp), *again = NEW0(uint8_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) {
        if (!want[k]) continue;
        stat.components++;
        *(speck_is(iso, k) ? &speck[k] : &coarse[k]) = 1;
        specks += speck[k];
    }
    /* a droplet that loses too much of itself gets finer triangles; what nothing helps stays marching cubes' */
    if (stat.components > specks && append_worked(iso, coarse, edge, mesh, again)) {
        memcpy(coarse, again, (size_t)iso->ncomp);
        if (append_worked(iso, coarse, DROPLET_EDGE * edge, mesh, again)) {
            memcpy(coarse, again, (size_t)iso->ncomp);
            plain = mesh->nvert;
            stat.raw_components = append_worked(iso, coarse, 0, mesh, again);
            if (stat.raw_components) append_reference(iso, again, mesh);
        }
    }
    stat.first_plain = plain == NONE ? mesh->nvert : plain;
    if (specks) speck_append(iso, speck, mesh);
    stat.vertices = mesh->nvert - mesh->deadvert - before;
    mem_free(coarse);
    mem_free(speck);
    mem_free(again);
    return stat;
}
