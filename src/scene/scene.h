/* scene.h: an animated implicit surface made of skeleton elements, read from a .json file (twinmesh-scene(5)).
 *
 * GI'07 section 4: the field is a sum over skeleton elements of a kernel of the distance to them,
 *     F(p) = sum_e strength_e k(d_e(p) / radius_e) - iso,    k(1) = 1,
 * positive inside; d is ||.||_q of the way from the nearest place on the element (nearest by ||.||_2). Kernels:
 * 1/d^2, and a polynomial that ends at twice the radius. Elements are placed and bent in time by keyframes.
 *
 * A Scene is what the file says; a SceneFrame is the scene at one frame, ready to be evaluated. Both are immutable
 * once made: any number of threads may read them. World units throughout. */
#pragma once
#include "field/field.h"

typedef struct Element Element; /* scene_priv.h */

typedef struct Scene {
    char *path;
    int64_t first, last;    /* frames, inclusive */
    double fps;
    double voxel;
    Vec3 origin;            /* place of sample (0, 0, 0) */
    int n[3];               /* samples in x, y, z */
    double iso;
    double tolerance;       /* what the tree over many points of unbounded reach may be wrong by, times iso */
    int nelement;
    Element *element;       /* [nelement] */
} Scene;

/* Reads and checks the file. A failure is a sentence with file, line, element, field and remedy, and leaves nothing. */
bool scene_load(const char *path, Scene *out, Err *err);
void scene_free(Scene *s);
/* True for names that end in .json. */
bool scene_is_known(const char *path);

typedef struct SceneFrame SceneFrame;

/* The scene at a frame (also one beyond its own: keyframes hold their ends). The scene must outlive it. */
SceneFrame *scene_frame(const Scene *s, int64_t frame);
void scene_frame_free(SceneFrame *f);

/* Batch: F at n world points, and its exact gradient where `grad` is not NULL. Where F has no gradient (on skeletons
 * and on the ridges of ||.||_1), that of one side. */
void scene_sample(const SceneFrame *f, int n, const Vec3 *p, double *F, Vec3 *grad);
/* An interval that holds F within the ball of `radius` around c. */
void scene_bound(const SceneFrame *f, Vec3 c, double radius, double *low, double *high);

/* Samples of -F (negative inside, as level sets are) as float32 into an empty grid: 8^3 blocks wherever a cell may be
 * crossed and one layer of blocks around them, constant inside tiles and outside background elsewhere, chosen by bounds
 * that miss nothing. `parallel`: may call parallel_for. False where the surface needs too many blocks. */
bool scene_fill_grid(const SceneFrame *f, bool parallel, Grid *out, Err *err);

/* F and gradient for Field.exact. The SceneFrame must outlive the field. */
FieldExact scene_exact(const SceneFrame *f);
