/* picture.h: what is rendered: planes of one value a pixel, from the upper left corner, row by row.
 *
 * The beauty is linear light, multiplied by its alpha, filtered over the pixel. All other layers are those of the one point
 * that the pixel's centre sees, unfiltered. */
#pragma once
#include "base/base.h"

typedef enum Layer { LAYER_BEAUTY, LAYER_DEPTH, LAYER_NORMAL, LAYER_POSITION, LAYER_MOTION, LAYER_ID, LAYER_REST, LAYER_COUNT } Layer;

typedef enum PlaneId {
    PLANE_R, PLANE_G, PLANE_B, PLANE_A,
    PLANE_Z,                                                      /* from the plane of the eye; PICTURE_FAR: nothing is there */
    PLANE_NORMAL_X, PLANE_NORMAL_Y, PLANE_NORMAL_Z,               /* world; outward */
    PLANE_POSITION_X, PLANE_POSITION_Y, PLANE_POSITION_Z,         /* world */
    PLANE_FORWARD_U, PLANE_FORWARD_V, PLANE_FORWARD_KNOWN,        /* pixels to the right and up, to the place in the next frame; */
    PLANE_BACKWARD_U, PLANE_BACKWARD_V, PLANE_BACKWARD_KNOWN,     /* in the last one. Known: 1 by identity, 0.5 by velocity, 0 not */
    PLANE_OBJECT,                                                 /* the least identity of its component; PICTURE_NOBODY: nothing */
    PLANE_VERTEX,                                                 /* the identity of the triangle's nearest corner */
    PLANE_REST_X, PLANE_REST_Y, PLANE_REST_Z,                     /* world, as the mesh has it */
    PLANE_COUNT
} PlaneId;

#define PICTURE_FAR 1e10f
#define PICTURE_NOBODY UINT32_MAX

typedef enum PlaneKind { PLANE_SMALL, PLANE_LARGE, PLANE_NUMBER } PlaneKind; /* a half can hold it; a float must; an integer */

typedef struct PlaneSpec {
    const char *name; /* as OpenEXR has it */
    Layer layer;
    PlaneKind kind;
} PlaneSpec;
extern const PlaneSpec plane_table[PLANE_COUNT];

typedef union Sample {
    float real;
    uint32_t number; /* of a PLANE_NUMBER */
} Sample;

typedef struct Picture {
    int width, height;
    Sample *plane[PLANE_COUNT]; /* [width * height], NULL: not wanted */
} Picture;

/* layers: bits 1 << Layer. Everywhere nothing is there. */
void picture_init(Picture *p, int width, int height, unsigned layers);
void picture_free(Picture *p);
bool picture_has(const Picture *p, Layer layer);
/* Copies the planes that both have; `from` has the same height. */
void picture_paste(Picture *p, int x, const Picture *from);
/* The beauty on white, sRGB. rgb: [3 * width * height]. */
void picture_to_rgb(const Picture *p, uint8_t *rgb);
