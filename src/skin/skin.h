/* skin.h: Desbrun and Cani's active implicit surface (GI'98): a potential that moves so that its surface follows a target.
 *
 * The potential f is kept at the samples of a lattice of cubic voxels, in bricks of 8^3 around its surface: the signed
 * distance, positive inside, counted in *bands* and clamped to +-1; a band is SKIN_BAND_VOXELS voxels. Every point of the
 * surface moves along its outward normal n = -grad f / |grad f| at the speed (eqs. 3 to 5, section 5)
 *
 *     alpha (G - iso) - beta kappa + gamma (A0 - A)/A0 + gamma (V0 - V)/V0,    kappa = div n,
 *
 * where G - iso, the target, is a signed distance in bands too, clamped to +-1. The paper prints +beta kappa; with
 * kappa = +2/R on a sphere it takes a minus to shrink one. The speed is taken where the surface crosses the lattice's
 * edges, and the samples beside them take the mean (section 4.3), so that the skin comes to rest on its target.
 *
 * Lengths are in bands, time in whatever the caller's unit is. Work and memory go with the surface's area. The same
 * bytes for any number of threads. */
#pragma once
#include "field/field.h"

enum { SKIN_BAND_VOXELS = 3 };

/* Where the samples are: sample (i, j, k) at origin + voxel (i, j, k), world units. */
typedef struct SkinLattice {
    Vec3 origin;
    double voxel;
} SkinLattice;

/* --- targets ----------------------------------------------------------------------------------------------------- */

typedef struct SkinTarget SkinTarget;

/* The surface of a field. The lattice's voxel may be up to SKIN_COARSEST times the field's. NULL with a sentence. */
enum { SKIN_COARSEST = 4 };
SkinTarget *skin_target_field(const SkinLattice *l, const Field *f, Err *err);

typedef enum SkinKernel {
    SKIN_BLOB, /* the paper's: the sum of (1 - d^2/4r^2)^3 over the particles; a lone one's surface is at r */
    SKIN_BALL, /* the union of the balls */
} SkinKernel;

typedef struct SkinPoints {
    int n;
    const Vec3 *place;   /* [n] world units */
    const float *radius; /* [n] world units; NULL: `common` */
    double common;
} SkinPoints;

/* The union of the particles and a field's inside (NULL: none): solvers that keep particles only near the liquid's surface,
 * as Blender's does, say by a grid where the rest is. */
SkinTarget *skin_target_points(const SkinLattice *l, const SkinPoints *points, SkinKernel kernel, const Field *rest, Err *err);
void skin_target_free(SkinTarget *t);

/* --- the skin ---------------------------------------------------------------------------------------------------- */

typedef enum SkinKeep { KEEP_NOTHING, KEEP_AREA, KEEP_VOLUME } SkinKeep;

typedef struct SkinSettings {
    double alpha;   /* 1 / time */
    double beta;    /* bands^2 / time */
    double gamma;   /* bands / time */
    SkinKeep keep;  /* what the surface that skin_begin got has */
} SkinSettings;

typedef struct SkinStat {
    int substeps;
    int bricks;
    double speed;        /* the largest at the surface in the last substep, voxels / time */
    double area, volume; /* of the surface, world units */
    int born;            /* components of the target that the skin was given because it touched none of them */
} SkinStat;

typedef struct Skin Skin;

/* A skin that lies on the target. */
Skin *skin_begin(const SkinLattice *l, const SkinSettings *settings, const SkinTarget *start);
void skin_end(Skin *s);
/* Moves for `time` towards the target, in steps of eq. 7: no farther than half a voxel, no longer than dx^2 / 6D with
 * D = beta max |grad f|, nor than 1 / 2 alpha. */
SkinStat skin_move(Skin *s, const SkinTarget *target, double time);
/* Substeps that `time` takes at the least with these settings on any lattice: for those who would refuse. */
double skin_substeps(const SkinSettings *settings, double time);

/* The signed distance, world units, negative inside: a narrow band of SKIN_BAND_VOXELS voxels to each side, inside
 * tiles, and as background the band's width. An empty grid of one component is filled. */
void skin_to_grid(const Skin *s, Grid *out);
/* Inside or outside, anywhere. */
bool skin_is_inside(const Skin *s, Vec3 world);
