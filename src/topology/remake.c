#include "topology/remake.h"

#include "remesh/remesh.h"

#include <string.h>

/* Coarse components that do not sit on their surface any more; sets `again` for them and drops them from the mesh. */
static int drop_strayed(const IsoSurface *iso, const uint8_t *want, Mesh *m, uint8_t *again)
{
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL), strayed = 0;
    uint8_t *bad = NEW(uint8_t, n);
    AuditMesh a = {m->nvert, m->ntri, n, m->pos, m->corner, comp};
    audit_match(iso, &a, AUDIT_STRAYS, bad, again);
    for (int k = 0; k < iso->ncomp; k++) strayed += again[k] = again[k] && want[k];
    if (strayed) {
        mesh_drop_components(m, comp, bad);
        mesh_compact(m, NULL);
    }
    mem_free(comp);
    mem_free(bad);
    return strayed;
}

RemakeStat remake_components(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh)
{
    RemakeStat stat = {0};
    Mesh fresh;
    Remesh r;
    int found;
    for (int k = 0; k < iso->ncomp; k++) stat.components += want[k] != 0;
    if (stat.components == 0) return stat;
    mesh_init(&fresh);
    int32_t *home;
    iso_triangulate(iso, want, &fresh, &home);
    remesh_begin(&r, &fresh, iso->field, edge, &(Homes){iso_is_home, iso, home});
    mem_free(home);
    remesh_coarsen(&r);
    remesh_heal(&r, &found);
    remesh_rehome(&r);
    remesh_end(&r);
    mesh_compact(&fresh, NULL);
    uint8_t *again = NEW0(uint8_t, iso->ncomp);
    stat.raw_components = drop_strayed(iso, want, &fresh, again);
    mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
    stat.vertices = fresh.nvert;
    if (stat.raw_components) {
        mesh_clear(&fresh);
        iso_triangulate(iso, again, &fresh, NULL);
        mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
        stat.vertices += fresh.nvert;
    }
    mem_free(again);
    mesh_free(&fresh);
    return stat;
}
