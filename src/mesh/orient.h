/* orient.h: on which side a point lies, with the exact sign.
 *
 * Coordinates are doubles that hold float32 values, as files do: a product of three fits in two doubles, so what the
 * rounded evaluation cannot decide (Shewchuk's first bound, 1997) is summed exactly. Pure functions. */
#pragma once
#include "base/vec.h"

/* Half a unit in the last place of 1, and the bounds on the error of a 2x2 and of a 3x3 determinant of rounded differences,
 * in units of the same determinant with every term taken positive. */
#define ORIENT_EPS 0x1p-53
#define ORIENT2_ERROR ((3 + 16 * ORIENT_EPS) * ORIENT_EPS)
#define ORIENT3_ERROR ((7 + 56 * ORIENT_EPS) * ORIENT_EPS)

/* The sign of (d - a) . ((b - a) x (c - a)): 1 where d lies on the side from which (a, b, c) is counter-clockwise. */
int orient3(Vec3 a, Vec3 b, Vec3 c, Vec3 d);
/* orient3 for what its own first bound left open. */
int orient3_exact(Vec3 a, Vec3 b, Vec3 c, Vec3 d);
/* The sign of the component along `axis` of (b - a) x (c - a). */
int orient2(Vec3 a, Vec3 b, Vec3 c, int axis);
