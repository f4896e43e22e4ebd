/* field.h: one frame of the volume sequence as the scalar field F the method works on.
 *
 * F is positive inside, 0 on the surface (GI'07 2.4), F = sign (v - iso) of the stored float32 sample v,
 * taken in double. Kept are 8^3 bricks whose cells the surface crosses and `rings` layers of bricks around
 * them, each with a margin of its own (11^3 samples), so that a sample costs one look-up whatever the
 * volume's extent. Beyond the grid's active bounding box every sample is outside, by the largest |F| the
 * frame holds: the surface closes at the border.
 *
 * Two surfaces in one: the *trilinear interpolant* decides (topology, audit, where vertices land); the
 * *smooth gradient* (central differences at the samples, interpolated: continuous) steers. World units
 * unless a name says index or voxel. A Field once built is the same for all who read it, any number of threads. */
#pragma once
#include "field/grid.h"

enum { BRICK_SIDE = 8, BRICK_SPAN = 11, BRICK_SAMPLES = BRICK_SPAN * BRICK_SPAN * BRICK_SPAN };

typedef struct FieldSpec {
    double iso;        /* isovalue, in the grid's units; rounded to float32, as the samples are */
    bool inside_below; /* level sets: inside is below the isovalue; densities: above */
} FieldSpec;

/* The function that the samples were taken from, where it is known: F and its gradient (NULL: not wanted) at n world
 * points. Lent by the field's maker, who keeps what it points to for as long as the field. */
typedef struct FieldExact {
    void (*sample)(const void *ctx, int n, const Vec3 *p, double *F, Vec3 *grad);
    const void *ctx;
} FieldExact;

typedef struct Field {
    Affine xform;
    double voxel;         /* cube root of a voxel's volume, world units */
    bool mirrored;        /* the transform turns handedness over */
    double sign, iso;     /* F = sign (v - iso) */
    double far;           /* |F| beyond the bounding box, > 0 */
    int lo[3], hi[3];     /* active bounding box, samples, inclusive */
    int nbrick;           /* 0: a frame without surface */
    int ncrossed;         /* the first ncrossed bricks have crossed cells; all are in z, y, x order within the two groups */
    int (*origin)[3];     /* [nbrick] first sample, a multiple of 8 */
    float *value;         /* [nbrick][11^3] samples origin-1 ... origin+9, x fastest */
    int capbrick;         /* bricks that value has room for */
    Grid source;          /* what the bricks around the crossed ones are gathered from when they are first asked for, */
    uint8_t *gathered;    /* [nbrick - ncrossed] 1 if they were; shared by threads. NULL: all are, and there is no source */
    Map brick_at;         /* by origin >> 3 */
    int32_t *room;        /* the same as a dense box of brick numbers or NONE, where that is small beside the bricks; else NULL */
    int room_lo[3], room_n[3]; /* the box, in bricks */
    FieldExact exact;          /* sample NULL: only the samples are known */
} Field;

/* Builds the field of a scalar grid. False for what no field can be made of (NaN samples, a grid too large). */
bool field_build(Field *f, const Grid *grid, const FieldSpec *spec, Err *err);
/* The same of a grid that may go with the field: most of the bricks around the crossed ones are never asked for, and where the grid is
 * smaller than they are it is taken over, zeroing *grid, and they wait. */
bool field_take(Field *f, Grid *grid, const FieldSpec *spec, Err *err);
void field_free(Field *f);
/* To the bit the same function, for certain: two whose exact functions are known may not be, and count as different. */
bool field_is_same(const Field *a, const Field *b);

/* The brick that holds the cell of an index-space sample, or NONE. */
static inline int field_brick(const Field *f, int x, int y, int z)
{
    if (!f->room) return f->nbrick ? map_get(&f->brick_at, key_coord(x >> 3, y >> 3, z >> 3)) : NONE;
    int i = (x >> 3) - f->room_lo[0], j = (y >> 3) - f->room_lo[1], k = (z >> 3) - f->room_lo[2];
    if ((unsigned)i >= (unsigned)f->room_n[0] || (unsigned)j >= (unsigned)f->room_n[1] || (unsigned)k >= (unsigned)f->room_n[2]) return NONE;
    return f->room[(k * f->room_n[1] + j) * f->room_n[0] + i];
}
/* The same of an index-space point, whose cell's first sample is put in at; NONE too beyond what samples reach. */
static inline int field_brick_of(const Field *f, Vec3 q, int at[3])
{
    enum { LIMIT = 1 << 20 };
    if (!(fabs(q.x) < LIMIT && fabs(q.y) < LIMIT && fabs(q.z) < LIMIT)) return NONE;
    at[0] = (int)(q.x + LIMIT) - LIMIT; /* floor, of what is positive then */
    at[1] = (int)(q.y + LIMIT) - LIMIT;
    at[2] = (int)(q.z + LIMIT) - LIMIT;
    return field_brick(f, at[0], at[1], at[2]);
}
/* The eight corner values of F of the cell at sample (x, y, z) of brick b; corner c at (c&1, c>>1&1, c>>2). */
void field_cell(const Field *f, int b, int x, int y, int z, double F[8]);

/* F of the trilinear interpolant at world point p. Away from the bricks -far, or +far deep inside is not known:
 * *known tells. `cell_grad` (may be NULL) gets the gradient within the cell, which jumps between cells. */
double field_value(const Field *f, Vec3 p, Vec3 *cell_grad, bool *known);
/* Batch: F and the smooth gradient at n world points; a zero gradient where the field is not known. Here and below, the
 * exact ones where the function is known; grad NULL: F of the samples alone. */
void field_sample(const Field *f, int n, const Vec3 *p, double *F, Vec3 *grad);
/* The smooth gradient of one point. */
Vec3 field_gradient(const Field *f, Vec3 p);
/* Outward unit normals, n = -grad F / |grad F|; the cell's gradient serves where the smooth one vanishes or lies. */
void field_normals(const Field *f, int n, const Vec3 *p, Vec3 *normal);

/* First-order distance of a point from the trilinear surface, |F| / |grad F|, in voxels, or from the exact one if that is
 * less: a landed point is at 0. INFINITY where there is no gradient. */
double field_distance_vox(const Field *f, Vec3 p);

typedef enum Landing {
    LANDED = 0,
    LANDING_LOST,    /* no zero within reach, or no gradient to follow: a quasi-critical point (RR-6128 2.2) */
} Landing;

/* GI'07 eq. 3: moves each point onto the trilinear surface, at most `reach` world units; a point that finds none
 * stays. Newton steps along the smooth gradient until F changes sign, then a bracketed root. Where the function is
 * known they go on to its zero, if the trilinear surface crosses the cell that lies in. Returns how many are lost;
 * status may be NULL. */
int field_project(const Field *f, int n, Vec3 *p, double reach, uint8_t *status);
/* The same on this thread alone, each point with a reach of its own, and status[n] not NULL. */
void field_project_each(const Field *f, int n, Vec3 *p, const double *reach, uint8_t *status);
/* The same on the blend (1 - t) a + t b, to a hundredth of a voxel; where only one of them is known there, that one. */
int field_project_blend(const Field *a, const Field *b, double t, int n, Vec3 *p, double reach, uint8_t *status);

/* As field_project, of one point; the outward unit normal there is right to a fiftieth of a voxel. False: lost, it stays. */
bool field_land(const Field *f, Vec3 *p, double reach, Vec3 *normal);
/* The same of n points, in less time than one after the other; status as field_project's, not NULL. */
void field_land_each(const Field *f, int n, Vec3 *p, double reach, Vec3 *normal, uint8_t *status);
/* The same down the cells' own gradients, for those who measure: it lands nearer to where it came from, and where
 * the smooth gradient lies; but neighbours may part at a cell's face. False: lost, it stays. */
bool field_drop(const Field *f, Vec3 *p, double reach);

/* The first point of the trilinear surface on the way from *p along the unit vector `dir`, at most `reach` away: steps of a
 * quarter voxel, then a bracketed root. False, and p as it was, where there is none. */
bool field_cast(const Field *f, Vec3 *p, Vec3 dir, double reach);

/* GI'07 2.6: a triangle is inverted when n . grad F > 0 at all three corners, n its normal. The slope of F along n
 * is measured over +-INVERTED_VOX of the trilinear field: right in sheets thinner than the smooth gradient sees. */
#define INVERTED_VOX 0.1
bool field_triangle_inverted(const Field *f, Vec3 a, Vec3 b, Vec3 c);
