/* star.h: vertices whose triangles are certain to meet in what they share alone.
 *
 * Those around a vertex close to a single fan that, seen along one of the axes, turns once about it, all triangles the same way
 * round. Two of them then lie in sectors that have at most a side in common, and so have the two triangles. This takes the signs
 * that are certain: a vertex may fail whose triangles do not intersect, never the other way round. */
#pragma once
#include "mesh/intersect.h"

enum { LATER_UNSURE = 255 };

/* How many vertices there may be: more than any corner's number. */
int soup_nvert(const TriSoup *s);
/* Of triangles order[n] alone: sure[v] is 1 for those vertices, else 0 (sure[soup_nvert]).
 * later[3*ntri], NULL: not asked for: of a triangle t among these the sum of later[3 t ... 3 t + 2] is how many behind it in the
 * order share a corner with it; one of the three is LATER_UNSURE, if not all of its corners are sure. Of these pairs only those count
 * that have look[...] set for one of the two (look[ntri]; NULL: all). */
void stars_find(const TriSoup *s, int n, const int32_t *order, const uint8_t *look, uint8_t *sure, uint8_t *later);
