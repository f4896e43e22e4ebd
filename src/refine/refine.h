/* refine.h: the geometric mesh, made anew from the mechanical one at every frame (GI'07 section 3).
 *
 * Passes of marking and cutting. An edge is marked when the normals at its ends differ by more than alpha_r; when the
 * normals at the centroids of two neighbouring triangles do, the *other* edges of both are; beyond the paper, an edge
 * whose midpoint lies farther than `deviation` from the surface is. One, two or three marked edges cut a triangle into
 * 2, 3 or 4 without T-vertices; of the two diagonals that two marks leave, the one along the lesser curvature. New
 * points are landed on the surface; a mark whose point finds none, or would turn a triangle against it, is taken back.
 *
 * Refine remembers last frame's marks: a marked edge stays marked until it is well below the limits (hysteresis), and
 * its midpoint keeps its identity, so that connectivity holds still while the surface is calm. */
#pragma once
#include "field/field.h"
#include "field/homes.h"
#include "mesh/crossings.h"

/* What alpha_r limits: the angle between two normals, as in the papers, or the turn of the normal along an edge, or along a
 * line beside it in one of its triangles, by the field's Hessian (which GI'07 section 3 names for figure 7c's sake). */
typedef enum RefineBy { REFINE_BY_NORMALS, REFINE_BY_HESSIAN } RefineBy;

/* Papers: as above. Red-green: a triangle with more than one marked edge is cut in 4 (red); one with a single marked edge
 * in 2 (green), and these two are never cut again: where they should be, the whole is cut in 4 instead. Angles stay
 * those of the mechanical triangles and of their halves, whatever the number of passes. */
typedef enum RefineScheme { REFINE_SCHEME_PAPERS, REFINE_SCHEME_RED_GREEN } RefineScheme;

typedef struct RefineSettings {
    double angle_deg;     /* alpha_r; 180 or more: no refinement, an exact copy */
    int passes;           /* N_p, 0 ... 8 */
    double deviation_vox; /* 0: off */
    RefineBy by;
    RefineScheme scheme;
    double min_aspect;    /* no piece with a lower 2 r_in / r_circ (1: equilateral), unless its whole is lower: not lower than that; 0: off */
} RefineSettings;

typedef struct RefinedMesh {
    int nvert, ntri, capvert, captri;
    Vec3 *pos;            /* [nvert] rounded to float32; the mechanical vertices come first, in their order */
    Vec3 *normal;         /* [nvert] outward unit normals of the smooth field */
    int32_t *id;          /* [nvert] */
    int32_t (*ends)[2];   /* [nvert] the vertices whose midpoint this is; NONE for mechanical ones */
    uint8_t *flat;        /* [nvert] red-green: 1: a midpoint in the middle of its edge, as none would do on the surface */
    int32_t *tri;         /* [3*ntri] */
    int32_t *parent;      /* [ntri] mechanical triangle */
    uint8_t *green;       /* [ntri] 1, 2: the halves of a green triangle, one behind the other; else 0 */
} RefinedMesh;

/* A marked edge, by the identities of its ends, the lesser first. */
typedef struct RefineMark {
    int32_t from, to;
    int32_t id;           /* the midpoint's */
    int32_t pass;         /* the one that marked it */
} RefineMark;

typedef struct Refine {
    int nmark, capmark;
    RefineMark *mark;     /* [nmark] last frame's */
    Map mark_at;          /* by the ends: its number */
} Refine;

/* `mech` must be compact. homes->of: the mechanical vertices' components; a midpoint lands on its ends' or not at all. NULL: anywhere. Fresh identities are taken from *next_id,
 * which goes up by MESH_ID_STEP: what it starts from keeps them apart from the mechanical ones. `out` must be zero or from an earlier call: its columns are reused.
 * Returns how many marks were taken back, or red-green laid flat: midpoints that found no surface, or would have harmed a triangle. */
int refine_build(Refine *memory, const Mesh *mech, const Field *field, const RefineSettings *set,
                 const Homes *homes, int32_t *next_id, RefinedMesh *out);
/* Beyond the papers: moves vertices off the surface along their normals, by at most 0.04 voxel, until the triangles' mean distance
 * from it is about 0: with their corners on it they lie on the hollow side of all that is curved. Only where all triangles of a
 * vertex do, and the surface is found back below it. Returns [nvert] where the vertices were; the caller frees it. */
Vec3 *refine_balance(RefinedMesh *m, const Field *field);
/* Of triangles that run through one another the vertices go back to where they landed, and to the normal there; if that is not enough, midpoints to the middle
 * of their edges, where they change nothing but for their rounding, and all of mechanical triangles of which that would turn pieces over
 * or not do; at last such midpoints go some steps of float32 outward or inward. What is left then runs through one another in the
 * mechanical mesh too, of which `mech` knows the pairs. landed[nvert]: from refine_balance; NULL: where they are.
 * Returns how many pairs are left; *flattened: midpoints in the middle of their edges. */
int refine_untangle(RefinedMesh *m, const Field *field, const Vec3 *landed, const Crossings *mech, int *flattened);

typedef struct RefineFigures {
    double mean_vox, max_vox; /* distance of the triangles' centroids from the surface, by |F| / |grad F| */
    int inverted;             /* triangles */
} RefineFigures;
RefineFigures refine_measure(const RefinedMesh *m, const Field *field);
void refine_free(Refine *memory);
/* Kept between two runs: into the store, or out of it into one that is zero. */
void refine_store(Refine *memory, Store *s);
void refined_free(RefinedMesh *m);
