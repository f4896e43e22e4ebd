#include "topology/remake.h"

#include "remesh/remesh.h"
#include "topology/speck.h"


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

static void append_reference(const IsoSurface *iso, const uint8_t *want, Mesh *mesh)
{
    Mesh raw;
    mesh_init(&raw);
    iso_triangulate(iso, want, &raw, NULL);
    mesh_append(mesh, raw.nvert, raw.pos, NULL, raw.ntri, raw.corner);
    mesh_free(&raw);
}

/* Appends the components coarsened; again[] is set for those that have to stay as they are. */
static int append_coarse(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh, uint8_t *again)
{
    Mesh fresh;
    Remesh r;
    int found, failed;
    int32_t *home;
    mesh_init(&fresh);
    iso_triangulate(iso, want, &fresh, &home);
    remesh_begin(&r, &fresh, iso->field, edge, &(Homes){iso_is_home, iso, home});
    mem_free(home);
    remesh_coarsen(&r);
    remesh_heal(&r, NULL, &found);
    remesh_rehome(&r);
    remesh_end(&r);
    mesh_compact(&fresh, NULL);
    failed = drop_strayed(iso, want, &fresh, again);
    mesh_append(mesh, fresh.nvert, fresh.pos, NULL, fresh.ntri, fresh.corner);
    mesh_free(&fresh);
    return failed;
}

RemakeStat remake_components(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh)
{
    RemakeStat stat = {0};
    int before = mesh->nvert - mesh->deadvert, specks = 0;
    uint8_t *coarse = NEW0(uint8_t, iso->ncomp), *speck = NEW0(uint8_t, iso->ncomp), *again = NEW0(uint8_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) {
        if (!want[k]) continue;
        stat.components++;
        *(speck_is(iso, k) ? &speck[k] : &coarse[k]) = 1;
        specks += speck[k];
    }
    if (stat.components > specks) stat.raw_components = append_coarse(iso, coarse, edge, mesh, again);
    stat.first_plain = mesh->nvert;
    if (specks) speck_append(iso, speck, mesh);
    if (stat.raw_components) append_reference(iso, again, mesh);
    stat.vertices = mesh->nvert - mesh->deadvert - before;
    mem_free(coarse);
    mem_free(speck);
    mem_free(again);
    return stat;
}
