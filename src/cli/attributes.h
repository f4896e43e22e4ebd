/* attributes.h: grids sampled onto the vertices of a mesh. */
#pragma once
#include "field/grid.h"
#include "mesh/trimesh.h"

/* Gives a mesh one attribute more for each scalar grid, under its name, and three for each grid of vectors, under its
 * name with _x, _y and _z behind it: trilinear at the vertices, in the grid's own units; beyond a grid its background. */
void attributes_sample(TriMesh *m, int n, const char *const *name, const Grid *grid);
