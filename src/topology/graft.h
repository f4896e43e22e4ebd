/* graft.h: the wrong places of a tracked mesh replaced by patches of the frame's exact isosurface.
 *
 * Of a component that does not match, the mesh is cut into pieces of some triangles, the faulty ones left out, and the borders of
 * all pieces are traced on the isosurface's reference triangles as seams (sheet.h). Seams cut both surfaces along the same
 * curves. A piece stays if its seams bound one region of the isosurface, alone, and that has its Euler characteristic; one that does
 * not is cut smaller, down to single triangles. All of the isosurface that no piece stands for is sewn in: so the result has its
 * topology by construction, wherever the mesh was wrong and whether or not a fault was found there, and a blend, a split, a
 * hole need no cases of their own. Of a component that matches only the faulty places are holes, with a ring around them, and the rest is
 * trusted: a patch must be closed by its hole's seams and have its topology, or the hole is widened, and at last left as it was.
 * Of a component that does not match but is faulty, or leans, in few places only these and what is near them are cut into pieces at
 * first, and more where the isosurface goes on and they do not, if that gives it the isosurface's Euler characteristic.
 * Dropped vertices that lie soundly on the surface are put into the patches and keep their identities.
 *
 * (DESIGN's dual of a geodesic Voronoi diagram makes all of a component anew and puts old triangles back; here they are
 * never taken out.) */
#pragma once
#include "topology/mend.h"

typedef struct GraftPlan {
    const int32_t *comp;  /* [mesh->nvert] component each vertex lies on; NONE: on none */
    const uint8_t *drop;  /* [mesh->ntri] triangles to be replaced: their faults, FAULT_... */
    const uint8_t *cell;  /* [iso->ncell] cells that a patch has to reach, beside those of the triangles dropped */
    const uint8_t *whole; /* [iso->ncomp] components to be made anew without a look at their mesh; those without any are, too */
    const uint8_t *wrong; /* [iso->ncomp] components that do not match: all of their mesh is looked at, or */
    bool locally;         /* what is dropped and what leans alone, if that is little and will do */
    const uint8_t *lean;  /* [mesh->ntri] triangles near which the topology may differ */
    double edge;          /* wanted */
    bool survivors;       /* dropped vertices keep their identities where they lie soundly */
    bool thorough;        /* where a hole cannot be closed and holds triangles turned over or crossed, all of its component is
                           * looked at; or the hole is left as it was */
} GraftPlan;

/* `mesh` must be compact; vertices from the old nvert on are new, at reference density, with fresh identities; the dead
 * are not swept out. speck[iso->ncomp] is set for the specks among the components taken whole: they are left out, for
 * speck_append to draw. *edges (NULL: not) is made a map that has, as key_pair(lesser id, greater id), the edges that sound triangles had
 * in the patches' places and beside them: what is made anew shall look like them. Patches and their vertices are added to *stat. */
void graft_patches(const IsoSurface *iso, const GraftPlan *plan, Mesh *mesh, uint8_t *speck, Map *edges, MendStat *stat);
