/* mechanics.h: one quasi-static step of the elastic skin (GI'07 2.2 to 2.6).
 *
 * Solves (I - dt df/dx) dx = dt f (eq. 1) for the displacement of every vertex by a conjugate gradient whose
 * residual and directions are filtered into the tangent planes of the surface, so that vertices slide and do not
 * leave it. Forces: corotational triangles with one shared stiffness and one equilateral rest shape
 * (f = -R K (R^T x - x0): eq. 2 with the restoring sign), or springs along the edges (what the papers compare with).
 * A triangle told to be inverted gets the recovering displacement of 2.6.2. The constraint of eq. 4 draws vertices
 * to sharp features inside the iterations; there they slide along a ridge only, and dx may leave the tangent plane.
 * The landing on the surface after the step is the caller's. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef enum MechanicsKind { MECHANICS_FEM, MECHANICS_SPRING } MechanicsKind;

typedef struct MechanicsSettings {
    MechanicsKind kind;
    double young;          /* E; 1000 */
    double poisson;        /* nu; 0.3 */
    double spring;         /* k; 100 */
    double dt;             /* s; 0.04 */
    double rest;           /* rest edge length, world units: the papers' e-hat */
    int cg_iterations;     /* at most; exactly when cg_tolerance is 0 */
    double cg_tolerance;   /* stop when the residual falls below this share of the first */
    bool sharp;            /* eq. 4 */
} MechanicsSettings;

MechanicsSettings mechanics_defaults(void);

/* The constant part of a step. */
typedef struct MechanicsProblem {
    int nvert, ntri;
    const Vec3 *pos;          /* [nvert] on the surface */
    const int32_t *tri;       /* [3*ntri] counter-clockwise from outside */
    const Vec3 *normal;       /* [nvert] outward unit normals of the field: the constraint planes; 0: no constraint */
    const Vec3 *tri_normal;   /* [ntri] outward unit normals of the field at the centroids; only for sharp, else NULL */
    const uint8_t *inverted;  /* [ntri] 1: recover (2.6.2); NULL: none is */
    const uint8_t *frozen;    /* [nvert] 1: does not move; NULL: none is */
} MechanicsProblem;

typedef struct CgStat {
    int iterations;
    double residual;          /* last over first, 0 when there was nothing to do */
    bool converged;           /* reached cg_tolerance */
} CgStat;

/* Scratch reused between steps: grows, never shrinks. Zero-initialise; mechanics_free at the end. */
typedef struct Mechanics {
    struct MechanicsScratch *scratch;
} Mechanics;

/* dx[nvert]: the displacement. Same bytes for any number of threads. */
CgStat mechanics_step(Mechanics *mech, const MechanicsSettings *set, const MechanicsProblem *prob, Vec3 *dx);
/* The energy-gradient forces alone, f[nvert], unfiltered: for tests and for judging rest. */
void mechanics_forces(Mechanics *mech, const MechanicsSettings *set, const MechanicsProblem *prob, Vec3 *f);
void mechanics_free(Mechanics *mech);
