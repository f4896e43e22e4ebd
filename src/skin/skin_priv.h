/* skin_priv.h: the narrow band, and what is done to it. */
#pragma once
#include "skin/skin.h"

enum { SIDE = 8, CELLS = 512, PAD1 = 10, PAD2 = 12 };
#define DX (1.0f / SKIN_BAND_VOXELS) /* a voxel, in bands */

/* --- band.c: sparse bricks -------------------------------------------------------------------------------------- */

/* Where a sample with |f| < 1 faces a brick, that brick is there. What is not there is f = 1 or -1 throughout, the
 * sign that the nearest sample of a brick beside it has. Columns hold 8^3 samples a brick, x fastest. */
typedef struct Band {
    int n, cap;
    int (*at)[3];         /* [n] first sample / 8; rising in z, y, x */
    float *value;         /* f; positive inside, 0 counts as outside */
    float *spare, *extra; /* scratch of the passes */
    int32_t (*near)[27];  /* [n] bricks around: dx + 1 + 3 (dy + 1) + 9 (dz + 1); NONE */
    Map where;            /* by `at` */
} Band;

/* Empty, of the bricks named (in any order, maybe twice); values are not set. */
void band_init(Band *b, int n, int (*at)[3]);
void band_free(Band *b);
void band_copy(Band *to, const Band *from);
/* Adds bricks, which change nothing. */
void band_wake(Band *b, int n, int (*at)[3]);
/* Wakes and drops bricks so that what stands above holds. True where bricks changed. */
bool band_update(Band *b);
/* The last brick before a place in its row along x, or NONE. */
int band_before(const Band *b, const int at[3]);
/* The bricks around a place, of this or another band: near27 as Band.near; the middle may be NONE. */
void band_around(const Band *b, const int at[3], int32_t near[27]);
/* The sign of f in the brick at a place that is not there. */
float band_side(const Band *b, const int at[3]);
/* Samples -halo ... 7 + halo of a column around a brick, halo 1 or 2. Beyond bricks that are not there the nearest of the
 * middle one goes on, or `fill` where that is missing. */
void band_gather(const float *column, const int32_t near[27], int halo, float fill, float *pad);

/* True where an edge to one of the six neighbours at +-1, +-py, +-pz is crossed. */
static inline bool is_crossed(float a, float b) { return (a > 0) != (b > 0); }
static inline bool is_near(const float *p, int py, int pz)
{
    bool in = *p > 0;
    return (p[-1] > 0) != in || (p[1] > 0) != in || (p[-py] > 0) != in || (p[py] > 0) != in || (p[-pz] > 0) != in || (p[pz] > 0) != in;
}

/* --- distance.c ------------------------------------------------------------------------------------------------- */

/* |grad| of padded samples beside the surface: central differences, the steeper side where they turn. Per band. */
float near_slope(const float *p, int py, int pz);
/* Makes f a distance again. Samples beside the surface are divided by the slope there, which leaves the surface where it
 * is to second order; the others take `passes` steps of half a voxel or so of |grad f| = 1 outwards from them. */
void band_redistance(Band *b, int passes);
/* The second half alone: samples beside the surface stay as they are. */
void band_spread(Band *b, int passes);

/* --- target.c --------------------------------------------------------------------------------------------------- */

/* G along a crossed or any other edge is (raw interpolated) / (slope interpolated): the target's own samples beside its
 * surface, so that its zeros stay where they were, and distances (slope 1) farther away. */
struct SkinTarget {
    Band band;     /* G - iso as a distance */
    float *slope;  /* raw = value * slope */
};

/* Bricks by the world boxes that they must cover. */
typedef struct Places {
    int n, cap;
    int (*at)[3];
    Map seen;
} Places;

/* The bricks of all samples within `margin` voxels of a box. False where they are too many or too far away. */
bool places_add(Places *p, const SkinLattice *l, Vec3 lo, Vec3 hi, double margin);
/* Those where a field's surface may be, and a band around. */
bool places_add_field(Places *p, const SkinLattice *l, const Field *f);
void places_free(Places *p);
bool fail_bricks(Err *err);
/* F at sample (i, j, k), bands; NaN where it is not known. */
float lattice_value(const SkinLattice *l, const Field *f, int i, int j, int k);
/* Makes a target of a band that holds the samples of any potential, positive inside; NaN: not known, and not near the
 * surface. */
void target_finish(SkinTarget *t);

/* --- measure.c -------------------------------------------------------------------------------------------------- */

typedef struct Extent {
    double area, volume; /* bands */
} Extent;

/* Of the surface through six tetrahedra a cell (section 5: by polygonization). */
Extent band_measure(const Band *b);

/* --- birth.c ---------------------------------------------------------------------------------------------------- */

/* Components of the target's inside that hold nothing of the skin's inside, and of its outside that hold nothing of the
 * skin's outside, get a seed in their deepest sample if that is `least` deep or more. Returns how many. */
int band_seed(Band *b, const Band *target, float least);
