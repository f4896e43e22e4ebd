/* remake.h: components of the mesh made anew from the frame's exact isosurface: the last resort of the mend.
 *
 * The marching-cubes triangles of the components wanted are coarsened to the edge length by guarded collapses, splits and
 * flips. Each of these keeps the Euler characteristic (link condition), so the result has the reference's topology by
 * construction, however far coarsening comes: nothing has to be checked or retried, and the limit of a place that
 * cannot be coarsened is the reference itself. (A dual of a geodesic Voronoi diagram, which needs checks and rounds of
 * new seeds to reach the same guarantee, gave a prototype minimum angles of 23 to 31 degrees at the 5th percentile and 3 to
 * 7 % of edges outside [0.5, 2] on splashes; this gives 28 to 38 degrees and 0.4 to 3 %.) */
#pragma once
#include "topology/audit.h"

typedef struct RemakeStat {
    int components, vertices;
    int first_plain;      /* vertices of the mesh from here on are specks' and raw components', not to be moved */
    int raw_components;   /* left as raw marching cubes: anything else strayed from the surface */
} RemakeStat;

/* Appends the components want[iso->ncomp] to the mesh, with fresh identities. */
RemakeStat remake_components(const IsoSurface *iso, const uint8_t *want, double edge, Mesh *mesh);
