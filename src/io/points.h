/* points.h: one frame's particles: vertices of a .ply, an n x 3 array of .npy, or an OpenVDB point grid (Houdini's
 * `points`, Mantaflow's `particles` in Blender's caches). A file's claims are checked against its length; a failure is one
 * sentence and leaves nothing behind. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef struct PointSet {
    int n;
    Vec3 *place;   /* [n] world units */
    float *radius; /* [n] world units; from an attribute `pscale` or `radius`; NULL: there is none */
    double voxel;  /* of the point grid they came from; 0: from none */
} PointSet;

/* True for files that hold nothing but points: .ply, and .npy of two dimensions. False also where it cannot be read. */
bool points_are_in(const char *path);
/* `grid` names the point grid of a .vdb; NULL: its only one. */
bool points_read(const char *path, const char *grid, PointSet *out, Err *err);
void points_free(PointSet *p);
