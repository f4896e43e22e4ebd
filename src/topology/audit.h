/* audit.h: a tracked mesh against the frame's exact isosurface, component by component (DESIGN section 7). */
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
    int strayed;          /* vertices that lie on no crossed cell, or on another component's */
    int euler_errors;     /* pairs whose Euler characteristics differ */
    int uncovered_cells;  /* crossed cells without mesh near them */
} AuditStat;

/* Matches the components one to one. mesh_bad[mesh->ncomp] and iso_bad[iso->ncomp] are set for those that are not exactly
 * matched: a vertex that is not on the component's surface, a different Euler characteristic, several mesh components on
 * one of the isosurface, or (with `coverage`) too much of the surface without mesh near it. */
AuditStat audit_match(const IsoSurface *iso, const AuditMesh *mesh, bool coverage, uint8_t *mesh_bad, uint8_t *iso_bad);
