/* cell.h: what the trilinear interpolant does inside one cell.
 *
 * Corner c sits at (c&1, c>>1&1, c>>2); edge e = 4 axis + k. F > 0 is inside, a sample at 0 is outside. The surface
 * meets the cell's skin in closed loops over its cut edges; a face whose signs alternate is decided by the sign of its
 * bilinear saddle (asymptotic decider, Nielson and Hamann 1991). Each loop bounds a disc, but two loops bound a tunnel
 * where the interpolant joins, through the cell's inside, two corner regions that its skin leaves apart. */
#pragma once
#include "base/base.h"

enum { CELL_LOOPS_MAX = 4 };

extern const uint8_t CELL_EDGE_CORNER[12]; /* the lower corner of each edge; its axis is e / 4 */

typedef struct CellTopology {
    int nloop;
    uint8_t start[CELL_LOOPS_MAX + 1]; /* of each loop in edge[] */
    uint8_t edge[12];                  /* cut edges in order, counter-clockwise seen from outside the object */
    int8_t tunnel[2];                  /* the two loops of a tunnel, or NONE */
    bool ambiguous;                    /* a face was decided by its saddle */
} CellTopology;

CellTopology cell_topology(const double F[8]);
