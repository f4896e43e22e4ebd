/* graft_priv.h: a graft under way: graft.c finds holes and borders, balance.c compares, sew.c sews in. */
#pragma once
#include "topology/graft.h"
#include "topology/sheet.h"

typedef struct Seam {
    int half_edge, a, b;   /* of the kept triangle to its left; its ends */
    int path, npath;       /* sheet vertices between the ends, in Graft.path */
} Seam;

typedef struct Graft {
    const IsoSurface *iso;
    const GraftPlan *plan;
    Mesh *mesh;
    uint8_t *drop;         /* [ntri] */
    uint8_t *whole;        /* [ncomp] */
    uint8_t *grow;         /* [nvert] the border there could not be traced */
    int32_t *pinned;       /* [nvert] sheet vertex or NONE */
    Sheet sheet;
    Seam *seam;
    int nseam, capseam;
    int32_t *path;
    int npath, cappath;
    int32_t *seam_at;      /* [3*ntri] seam of a kept half-edge, or NONE */
    int nregion;
} Graft;

/* --- balance.c ------------------------------------------------------------------------------------------------------- */

/* Holes and regions that share seams belong together; of a component that matched before, the ones must have the topology of
 * the others. Where a seam took the wrong side of something small they do not: grow is set at its ends. Returns how many seams. */
int graft_compare(Graft *g);

/* --- sew.c ------------------------------------------------------------------------------------------------------------ */

/* Puts dropped vertices that lie soundly on the surface into the patches. Returns how many. */
int graft_pin_survivors(Graft *g);
/* Replaces the dropped triangles by the patches, and the kept ones at seams by fans over the seams' vertices. */
void graft_sew(Graft *g);
