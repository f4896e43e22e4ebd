/* pair.h: the vertices of two meshes of one surface, one to one: who goes on as whom where two runs of a tracker meet.
 *
 * Candidates are of one group, within reach, and look the same way. The nearest pairs first; then augmenting paths, until no
 * vertex is left over that could have a partner; then exchanges of partners between two pairs, as long as they bring both
 * nearer on the whole. Deterministic. */
#pragma once
#include "base/base.h"

typedef struct PairSide {
    int n;
    const float *pos;       /* [3*n] */
    const float *normal;    /* [3*n] unit length */
    const int32_t *group;   /* [n] the same for both sides: a component; NONE: takes no part */
} PairSide;

/* partner[b->n]: the vertex of a, or NONE. Returns the number of pairs. */
int pair_vertices(const PairSide *a, const PairSide *b, double reach, int32_t *partner);
