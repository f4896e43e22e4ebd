/* graft.h: faulty places of a tracked mesh replaced by patches of the frame's exact isosurface.
 *
 * The triangles to be dropped leave holes; the border of each is traced on the isosurface's reference triangles as a closed
 * seam (sheet.h), and what lies inside the seams is sewn in. Seams cut both surfaces along the same curves, so patch and
 * mesh fit whatever either looks like; and the patch has the isosurface's own topology, so that a blend (two discs
 * dropped, an annulus sewn in), a split, a hole need no cases of their own. Dropped vertices that lie soundly on the surface are put
 * into the patch and keep their identities. A seam may still pass something small on another side than the mesh does, so a patch
 * of a component that matched before must have the topology of what it replaces (balance.c). A border that cannot be
 * traced is widened; what cannot be sewn at last stays as it was, or, where the component does not match, is made anew as a
 * whole: then there is no border, and nothing can fail. (DESIGN's dual of a geodesic Voronoi diagram has to check every cell; here only
 * borders are, and outside the patches no edge changes.) */
#pragma once
#include "topology/mend.h"

typedef struct GraftPlan {
    const int32_t *comp;  /* [mesh->nvert] component each vertex lies on; NONE: on none */
    const uint8_t *drop;  /* [mesh->ntri] triangles to be replaced, with a ring around them */
    const uint8_t *cell;  /* [iso->ncell] cells that a patch has to reach, beside those of the triangles dropped */
    const uint8_t *whole; /* [iso->ncomp] components to be made anew without a look at their mesh; those without any are, too */
    const uint8_t *wrong; /* [iso->ncomp] components that do not match: where a patch cannot be sewn they are made anew as a whole, others left */
    double edge;          /* wanted */
    bool survivors;       /* dropped vertices keep their identities where they lie soundly */
} GraftPlan;

/* `mesh` must be compact; vertices from the old nvert on are new, at reference density, with fresh identities; the dead
 * are not swept out. speck[iso->ncomp] is set for the specks among the components taken whole: they are left out, for
 * speck_append to draw. Patches and their vertices are added to *stat. */
void graft_patches(const IsoSurface *iso, const GraftPlan *plan, Mesh *mesh, uint8_t *speck, MendStat *stat);
