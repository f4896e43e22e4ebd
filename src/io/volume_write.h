/* volume_write.h: a grid of one component as a file, by the ending of its name.
 *
 *   .vdb   sparse: blocks as leaves, tiles as tiles; a float level set named "phi", active within the bounding box
 *   .npy   dense float32 of the bounding box, array[x][y][z], x fastest (Fortran's order); no place and no voxel size
 *   .exr   the same as one part a slice in z, in order, with one float channel "phi", x to the right and y down
 *
 * Values are those of grid_at, bit by bit. The same grid gives the same bytes. A failure leaves no file. */
#pragma once
#include "field/grid.h"

bool volume_can_write(const char *path);
bool volume_write(const char *path, const Grid *g, Err *err);
