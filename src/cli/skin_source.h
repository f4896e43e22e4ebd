/* skin_source.h: what a skin follows, frame by frame: volumes, particles, a scene, or one of them for all frames. */
#pragma once
#include "cli/options.h"
#include "io/volume.h"
#include "scene/scene.h"
#include "sequence/pattern.h"
#include "skin/skin.h"

/* How files are read. Texts are borrowed from argv. */
typedef struct SkinReading {
    VolumeRequest request;
    double iso;            /* NaN: by the grid */
    int inside;            /* 1 above, -1 below, 0 by the grid */
    const char *points;    /* NULL: none are asked for */
    SkinKernel kernel;
    double radius;         /* 0: not given */
    bool radius_in_voxels;
    double voxel;          /* of the skin; 0: not given */
    bool voxel_in_voxels;
    bool chosen;           /* the surface of the grids, by the first that holds anything */
    FieldSpec spec;
} SkinReading;

/* One file's contents before the lattice is known. */
typedef struct SkinShape {
    Field field;           /* of particles what is added to them */
    int npoint;
    Vec3 *place;           /* [npoint] */
    float *radius;         /* [npoint] or NULL */
    double common;         /* radius of the others */
    bool is_points;
    SkinLattice lattice;   /* what it would be by this file */
    char said[300];        /* how the surface was chosen; "" when that was said before */
} SkinShape;

SkinReading skin_reading(const Options *o);
/* A file by its name, or a frame of a scene. On failure nothing is left to free. */
bool skinshape_read(SkinShape *s, SkinReading *r, const char *path, Err *err);
bool skinshape_of_scene(SkinShape *s, SkinReading *r, const Scene *scene, int64_t frame, Err *err);
void skinshape_free(SkinShape *s);
SkinTarget *skinshape_target(const SkinShape *s, const SkinReading *r, const SkinLattice *l, Err *err);
/* File names that may stand for a frame in a folder. */
bool skin_is_known(const char *path);
