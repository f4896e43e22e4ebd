/* start.h: a first mesh where there is none yet.
 *
 * The surface is sampled anew on a lattice about as coarse as the triangles are to be; the triangles of that are landed on the
 * exact surface and made even. That costs a third of coarsening the exact surface's own triangles, and is not exact: droplets,
 * sheets and necks that the lattice misses are for the mend (mend.h) to sew in. What the lattice shows too poorly is left out. */
#pragma once
#include "topology/iso.h"

/* Fills an empty mesh, which may stay empty. Positions are rounded to float32. */
void start_mesh(const IsoSurface *iso, double edge, Mesh *mesh);
