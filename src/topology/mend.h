/* mend.h: a tracked mesh brought to the exact topology of the frame's isosurface, as locally as can be.
 *
 * Rounds of: find faults (fault.h), audit the components (audit.h), graft patches over what is faulty or does not match (graft.h),
 * coarsen them to the edge length by guarded collapses, splits and flips (each keeps the topology: link condition). One graft
 * makes a component match; further rounds are for what coarsening leaves faulty, with finer patches, and for small components,
 * which are made anew, in the end with the reference triangles as they are. A component that is made anew as a whole keeps the
 * identities of its sound vertices all the same, and most of the edges between them. */
#pragma once
#include "mesh/crossings.h"
#include "topology/audit.h"

enum { WHOLE_TRIANGLES = 500 };

typedef struct MendPatch {
    Vec3 place;            /* the mean of its vertices */
    int comp;              /* of the isosurface */
    int vertices;          /* new ones, before coarsening */
    int euler;             /* by how much the mesh's Euler characteristic went up with it, and with others sewn into the same holes */
    bool whole;            /* all of the component */
} MendPatch;

typedef struct MendStat {
    int rounds;            /* of grafting; 0: nothing was wrong */
    int faults;            /* faulty triangles and uncovered cells found at first */
    int dropped, survived; /* vertices inside patches; those of them that were put back with their identity */
    int whole;             /* components of more than WHOLE_TRIANGLES triangles made anew as a whole */
    int raw;               /* components with reference triangles left as they are */
    int npatch, cappatch;
    MendPatch *patch;      /* [npatch] what was sewn in, in the order of the rounds; the caller's to free */
} MendStat;

typedef struct MendOptions {
    double edge;           /* wanted, world units */
    const uint8_t *frozen; /* [mesh->nvert] vertices that did not move since the last mend */
    Crossings *crossings;  /* mend triangles that run through one another as well; NULL: not */
    bool early;            /* all is relaxed and mended once more in this frame: patches are evened less, and where little was wrong it is
                            * left to that mend to look at them */
} MendOptions;

/* `mesh` must be compact, and is afterwards; its positions are rounded to float32. Vertices outside patches keep their
 * identities. *stat is added to (zero it at first). */
void mend_mesh(const IsoSurface *iso, const MendOptions *opt, Mesh *mesh, MendStat *stat);

/* Appends components want[iso->ncomp], at the edge length, with fresh identities, whatever the mesh holds of them already. */
void mend_append(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh);
