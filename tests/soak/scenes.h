/* scenes.h: made-up volume sequences full of events: surfaces meet, part, appear, vanish, open and close holes.
 *
 * Two kinds. A Scene is written down: known events, for judging by hand. Events are drawn from a seed: balls and
 * cavities of which any frame can be sampled by itself. Samples are float32 level sets like a signed distance, negative
 * inside, x fastest; lengths are voxels but where a transform says otherwise. Only additions, products and roots go into
 * Events, so that every machine makes the same bytes; Enright's flow takes sines from libm. */
#pragma once
#include "field/grid.h"

/* --- scenes ---------------------------------------------------------------------------------------------------------- */

typedef struct Scene {
    const char *name, *what;
    int side[3];                            /* samples */
    int frames;
    double (*phi)(const double p[3], int frame); /* NULL: Enright's flow */
} Scene;

extern const Scene scene_list[];
extern const int scene_count;
const Scene *scene_find(const char *name);  /* NULL: there is none of this name */

/* A scene being sampled, frame after frame. */
typedef struct SceneRun {
    const Scene *scene;
    int frame;         /* the next one */
    int n[3];
    int64_t nsample;
    Vec3 *back;        /* [nsample] Enright: where what is at each sample came from; NULL for the others */
} SceneRun;

/* side: Enright's flow in that many samples a side; 0: as listed. */
void scene_open(SceneRun *run, const Scene *scene, int side);
void scene_close(SceneRun *run);
/* phi[nsample] of the next frame; false after the last. */
bool scene_next(SceneRun *run, float *phi);

/* --- events ---------------------------------------------------------------------------------------------------------- */

enum { EVENTS_FRAMES = 12, EVENTS_BALLS_MAX = 20 };

typedef struct EventBall {
    Vec3 centre, velocity;  /* at frame 0; a frame */
    double radius;
    double birth, death;    /* frames */
    bool sudden;            /* of full size as long as it lives; else it swells and shrinks */
    bool is_cavity;         /* taken away from all that is solid */
} EventBall;

typedef struct Events {
    uint64_t seed;
    int n[3];
    int nball;
    EventBall ball[EVENTS_BALLS_MAX];
    double blend;    /* voxels over which a smooth union blends; 0: plain minimum */
    double noise;    /* added to every sample, even in +- noise; 0: none */
    int steps;       /* samples rounded to 1 / steps voxel, 0 among them: exactly on the surface; 0: not rounded */
    double clamp;    /* samples clamped to +- clamp; 0: not */
    Affine xform;
    double unit;     /* a sample's unit in voxels: 1, or the voxel size */
    double edge_vox; /* mechanical edge to ask for */
    bool carried;    /* the tracker is given a velocity: the first ball's, everywhere */
} Events;

Events events_make(uint64_t seed);
int events_samples(const Events *e);
void events_sample(const Events *e, int frame, float *phi);
/* The same as a grid, with its transform. */
Grid events_grid(const Events *e, int frame);
/* A grid of one vector, in world units a second, `fps` frames a second. */
Grid events_velocity(const Events *e, double fps);
