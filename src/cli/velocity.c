#include "cli/velocity.h"

#include <math.h>
#include <string.h>

/* Mantaflow as Blender runs it moves v 2.5/fps voxels a frame (measured): 2.5 voxels a second for each unit. */
static const double MANTAFLOW_VOXELS_A_SECOND = 2.5;

VelocityUnits velocity_units_of(const Grid *g, const char *name, VelocityUnits asked)
{
    if (asked != VELOCITY_BY_GRID) return asked;
    bool mantaflow = strcmp(name, "velocity") == 0 || strcmp(name, "vel") == 0; /* in its .vdb and its .uni */
    return g->staggered && mantaflow ? VELOCITY_MANTAFLOW : VELOCITY_WORLD;
}

const char *velocity_units_say(VelocityUnits units)
{
    switch (units) {
    case VELOCITY_VOXEL: return "voxels a second";
    case VELOCITY_MANTAFLOW: return "Mantaflow's units (2.5 voxels a second each)";
    default: return "world units a second";
    }
}

/* Index directions to world ones. A staggered grid keeps its components apart (each has its own place), so it
 * can only be scaled along the axes; transforms of simulations are that simple. */
static void turn(const Grid *g, double unit, float v[3])
{
    const Affine *a = &g->xform;
    Vec3 in = vec3(unit * v[0], unit * v[1], unit * v[2]);
    Vec3 out = g->staggered ? vec3(a->m[0][0] * in.x, a->m[1][1] * in.y, a->m[2][2] * in.z) : mat_mul(a->m, in);
    v[0] = (float)out.x;
    v[1] = (float)out.y;
    v[2] = (float)out.z;
}

void velocity_to_world(Grid *g, VelocityUnits units)
{
    if (units == VELOCITY_WORLD) return;
    ASSERT(g->ncomp == 3);
    double unit = units == VELOCITY_MANTAFLOW ? MANTAFLOW_VOXELS_A_SECOND : 1;
    turn(g, unit, g->background);
    for (int i = 0; i < g->ntile; i++) turn(g, unit, g->tile[i].value);
    for (int b = 0; b < g->nblock; b++) {
        float *block = g->value + (size_t)b * 3 * GRID_CELLS;
        for (int i = 0; i < GRID_CELLS; i++) {
            float v[3] = {block[i], block[GRID_CELLS + i], block[2 * GRID_CELLS + i]};
            turn(g, unit, v);
            for (int k = 0; k < 3; k++) block[k * GRID_CELLS + i] = v[k];
        }
    }
}
