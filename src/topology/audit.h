/* audit.h: a tracked mesh against the frame's exact isosurface, component by component. */
#pragma once
#include "topology/iso.h"

/* A mesh to audit: positions and triangles, and the connected component of each triangle. */
typedef struct AuditMesh {
    int nvert, ntri, ncomp;
    const Vec3 *pos;
    const int32_t *tri;       /* [3*ntri] */
    const int32_t *tri_comp;  /* [ntri] 0 ... ncomp-1 */
} AuditMesh;

typedef struct AuditStat {
    int wrong_mesh;       /* mesh components that match nothing, or wrongly */
    int wrong_iso;        /* components of the isosurface without their right mesh */
    int euler_errors;     /* pairs whose Euler characteristics differ */
    int size_errors;      /* pairs whose volumes or extents have nothing to do with each other */
} AuditStat;

/* Matches the components one to one. mesh_bad[mesh->ncomp] and iso_bad[iso->ncomp] are set for those that are not exactly matched:
 * a different Euler characteristic, several mesh components on one of the isosurface, and, with `sizes`, a volume or
 * an extent that is not the component's (specks excepted). partner[mesh->ncomp]: the component each lies on, or NONE; of a large
 * one some of the vertices tell. */
AuditStat audit_match(const IsoSurface *iso, const AuditMesh *mesh, bool sizes, uint8_t *mesh_bad, uint8_t *iso_bad, int32_t *partner);

/* home[mesh->nvert]: the component of the isosurface that most of the vertex's mesh component lies on, or NONE. */
void audit_homes(const IsoSurface *iso, const AuditMesh *mesh, int32_t *home);
/* The same of a mesh, which must be compact; the caller frees the array. */
int32_t *audit_mesh_homes(const IsoSurface *iso, const Mesh *mesh);
