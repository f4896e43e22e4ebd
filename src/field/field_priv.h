/* field_priv.h: shared inside the module. */
#pragma once
#include "field/field.h"

/* The cell that holds a point: its first corner's sample, and the point's place in it, 0 ... 1. */
typedef struct Spot {
    const float *v; /* brick samples: neighbours at +-1, +-BRICK_SPAN, +-BRICK_SPAN^2 are there for all eight corners */
    double x, y, z;
} Spot;

static inline bool field_in_box(const Field *f, int x, int y, int z)
{
    return x >= f->lo[0] && x <= f->hi[0] && y >= f->lo[1] && y <= f->hi[1] && z >= f->lo[2] && z <= f->hi[2];
}

/* --- bricks.c ----------------------------------------------------------------------------------------------------------- */

static inline float *brick_samples(const Field *f, int brick) { return f->value + (size_t)brick * BRICK_SAMPLES; }
/* The samples origin-1 ... origin+9 of the brick at o; those beyond the bounding box are outside. */
void brick_gather(const Field *f, const Grid *g, const int o[3], float *out);
/* A brick around the crossed ones is gathered by the first thread that asks for it; others that ask meanwhile wait. */
enum { BRICK_WAITS, BRICK_GATHERED, BRICK_BEGUN };
void brick_ask(const Field *f, int brick);
/* Room for the samples of all bricks, and what is done with it when the field goes. */
void bricks_take_room(Field *f);
void bricks_leave_room(Field *f);

/* --- spots ---------------------------------------------------------------------------------------------------------------- */

/* False where no brick holds the point. */
static inline bool field_locate(const Field *f, Vec3 p, Spot *s)
{
    Vec3 q = affine_to_index(&f->xform, p);
    int at[3], b = field_brick_of(f, q, at);
    if (b == NONE) return false;
    if (b >= f->ncrossed && f->gathered && __atomic_load_n(&f->gathered[b - f->ncrossed], __ATOMIC_ACQUIRE) != BRICK_GATHERED) brick_ask(f, b);
    s->v = f->value + (size_t)b * BRICK_SAMPLES + ((at[0] & 7) + 1) + BRICK_SPAN * (((at[1] & 7) + 1) + BRICK_SPAN * ((at[2] & 7) + 1));
    s->x = q.x - at[0];
    s->y = q.y - at[1];
    s->z = q.z - at[2];
    return true;
}

/* F of the trilinear interpolant. */
static inline double spot_value(const Field *f, const Spot *s)
{
    enum { Y = BRICK_SPAN, Z = BRICK_SPAN * BRICK_SPAN };
    const float *v = s->v;
    double v0 = v[0], v1 = v[1], v2 = v[Y], v3 = v[Y + 1], v4 = v[Z], v5 = v[Z + 1], v6 = v[Z + Y], v7 = v[Z + Y + 1];
    double a0 = v0 + s->x * (v1 - v0), a1 = v2 + s->x * (v3 - v2), a2 = v4 + s->x * (v5 - v4), a3 = v6 + s->x * (v7 - v6);
    double b0 = a0 + s->y * (a1 - a0), b1 = a2 + s->y * (a3 - a2);
    return f->sign * (b0 + s->z * (b1 - b0) - f->iso);
}

/* Its gradient within the cell. */
static inline Vec3 spot_cell_gradient(const Field *f, const Spot *s)
{
    enum { Y = BRICK_SPAN, Z = BRICK_SPAN * BRICK_SPAN };
    const float *v = s->v;
    double v0 = v[0], v1 = v[1], v2 = v[Y], v3 = v[Y + 1], v4 = v[Z], v5 = v[Z + 1], v6 = v[Z + Y], v7 = v[Z + Y + 1];
    double a0 = v0 + s->x * (v1 - v0), a1 = v2 + s->x * (v3 - v2), a2 = v4 + s->x * (v5 - v4), a3 = v6 + s->x * (v7 - v6);
    double b0 = a0 + s->y * (a1 - a0), b1 = a2 + s->y * (a3 - a2);
    double x0 = (v1 - v0) + s->y * ((v3 - v2) - (v1 - v0)), x1 = (v5 - v4) + s->y * ((v7 - v6) - (v5 - v4));
    Vec3 g = vec3(x0 + s->z * (x1 - x0), (a1 - a0) + s->z * ((a3 - a2) - (a1 - a0)), b1 - b0);
    return affine_gradient(&f->xform, v_scale(g, f->sign));
}

/* The smooth gradient. */
Vec3 spot_gradient(const Field *f, const Spot *s);
/* The gradient to follow: the smooth one, or the cell's where the smooth one lies. */
Vec3 spot_steer(const Field *f, const Spot *s);

/* Below this cosine between the smooth gradient and the cell's own the smooth one is not believed. */
#define FIELD_STEER_COS 0.3

/* The same of a point; 0 where no brick holds it. */
Vec3 field_steer(const Field *f, Vec3 p);

/* --- exact.c: for fields whose function is known ---------------------------------------------------------------------- */

bool exact_is_known(const Field *f, Vec3 p);
/* Takes n points from their trilinear landings p to F = 0, from where they came if that is near. Those that may not stay. */
void exact_land(const Field *f, int n, const Vec3 *from, Vec3 *p, const uint8_t *status);
/* Puts the function's values and gradients in place of the samples', where they are known. */
void exact_sample(const Field *f, int n, const Vec3 *p, double *F, Vec3 *grad);
