/* field_priv.h: shared inside the module. */
#pragma once
#include "field/field.h"

/* The cell that holds a point: its first corner's sample, and the point's place in it, 0 ... 1. */
typedef struct Spot {
    const float *v; /* brick samples: neighbours at +-1, +-BRICK_SPAN, +-BRICK_SPAN^2 are there for all eight corners */
    double x, y, z;
} Spot;

/* False where no brick holds the point. */
bool field_locate(const Field *f, Vec3 p, Spot *s);

/* Below this cosine between the smooth gradient and the cell's own the smooth one is not believed. */
#define FIELD_STEER_COS 0.3

/* The gradient to follow at a point: the smooth one, or the cell's where the smooth one lies. */
Vec3 field_steer(const Field *f, Vec3 p);

/* --- exact.c: for fields whose function is known ---------------------------------------------------------------------- */

bool exact_is_known(const Field *f, Vec3 p);
/* Takes n points from their trilinear landings p to F = 0, from where they came if that is near. Those that may not stay. */
void exact_land(const Field *f, int n, const Vec3 *from, Vec3 *p, const uint8_t *status);
/* Puts the function's values and gradients in place of the samples', where they are known. */
void exact_sample(const Field *f, int n, const Vec3 *p, double *F, Vec3 *grad);
