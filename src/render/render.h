/* render.h: one frame's mesh pictured by casting rays.
 *
 * Light is a studio's that moves with the camera: a key from the upper left, a sky and a fill. How much of key and sky
 * reaches a vertex is found by rays from it, once a frame, so that a sample of the picture costs one ray.
 * The same meshes give the same planes with any number of threads. */
#pragma once
#include "render/camera.h"
#include "render/picture.h"

typedef enum RenderSurface { SURFACE_CLAY, SURFACE_CHECKER, SURFACE_PAPER } RenderSurface; /* paper: white, unlit */
typedef enum RenderWire { WIRE_NONE, WIRE_TRIANGLES, WIRE_PARENTS } RenderWire; /* parents: the mechanical edges on a geometric mesh */

typedef struct RenderLook {
    int samples;           /* of the beauty, a pixel */
    RenderSurface surface; /* checker: of cells in rest positions, where the mesh has none in places */
    double cell;           /* of the checker, world units */
    RenderWire wire;
} RenderLook;

/* The same surface in another frame. */
typedef struct RenderOther {
    const TriMesh *mesh;   /* NULL: there is none */
    Camera camera;
    double time_s;         /* from this frame to that one: negative before it */
} RenderOther;

typedef struct RenderFrame {
    const TriMesh *mesh;
    Camera camera;
    RenderOther before, after; /* for LAYER_MOTION */
} RenderFrame;

#define RENDER_REACH 1e12 /* world units; Embree takes rays from 1e18, and an eye may be farther away than what it sees is large */

typedef struct Renderer Renderer;
/* Any number of frames, one at a time. NULL with a sentence, ERR_RESOURCE. */
Renderer *renderer_open(Err *err);
void renderer_close(Renderer *r); /* NULL is allowed */

/* Whether the mesh has what the layer or the wire is made of. */
bool render_has_rest(const TriMesh *m);
/* Whether all of it lies within RENDER_REACH of the origin, along each axis: a precondition of render_frame, for the eye too. */
bool render_can_reach(const TriMesh *m);
/* Fills the planes that the picture has; it is as picture_init left it, of the camera's size. A mesh that lacks parents or rest
 * positions has no wire of parents, and zeros. */
bool render_frame(Renderer *r, const RenderLook *look, const RenderFrame *frame, Picture *picture, Err *err);
