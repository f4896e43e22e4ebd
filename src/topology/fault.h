/* fault.h: where a tracked mesh does not follow the frame's exact isosurface, place by place.
 *
 * The audit says which components are wrong; this says which triangles, so that the mend can stay local. */
#pragma once
#include "mesh/crossings.h"
#include "topology/iso.h"

/* What a triangle can be. */
enum { FAULT_TORN = 1, FAULT_INVERTED = 2, FAULT_FAR = 4, FAULT_STRAY = 8, FAULT_CROSSED = 16, FAULT_DEGENERATE = 32 };

typedef struct Faults {
    int32_t *comp;    /* [mesh->nvert] the component each vertex lies on; NONE: it is off the surface */
    uint8_t *tri;     /* [mesh->ntri] any of those, or 0 */
    uint8_t *lean;    /* [mesh->ntri] no fault, but does not lie along the surface quite as it should: near these the topology may differ */
    uint8_t *cell;    /* [iso->ncell] crossed cells of places without mesh */
    int strays;       /* vertices off the surface */
    int torn;         /* triangles whose corners are on different components */
    int inverted;
    int degenerate;   /* without area */
    int crossed;      /* pairs of triangles that run through one another */
    int far;          /* that cut through the air or the inside */
    int uncovered;    /* cells without mesh, single ones left to refinement */
    int any;          /* faulty triangles and uncovered cells */
} Faults;

/* `mesh` must be compact. `crossings`: triangles that run through one another as well (NULL: not); positions must hold float32 values then. */
void faults_find(const IsoSurface *iso, const Mesh *mesh, Crossings *crossings, Faults *f);
void faults_free(Faults *f);
