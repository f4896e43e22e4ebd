/* mechanics_priv.h: the parts of one quasi-static step, for src/mechanics and its tests only.
 *
 * A step is linear: forces and df/dx are taken once at the step's start and frozen. `Elastic` is that linear
 * model: elements (corotational triangles or springs along edges) over the *free* vertices, which are numbered
 * apart so that what is frozen costs nothing: an element with no free vertex is left out, a frozen vertex is
 * number nfree, where every vector keeps a zero.
 *
 * Elements write what they do to their own nodes into `part`; vertices gather it in element order. So sums have
 * one order whatever the number of threads. */
#pragma once
#include "base/hash.h"
#include "mechanics/mechanics.h"

/* Items a block of parallel_for takes: sums are kept by block, so changing it changes the last bits of results. */
enum { MECHANICS_GRAIN = 512 };

/* A triangle lower than this share of its longest edge has no orientation of its own: float32 positions are no
 * better than that. */
#define ELEMENT_FLAT 1e-6
/* cos 40 and cos 20 degrees: an edge across which the field's normal turns by more lies on a sharp feature (eq. 4). An
 * edge length e turns that far on a sphere of radius 0.83 e: a smaller angle takes ordinary droplets for
 * features and holds their vertices, a larger one leaves blunt ridges unsampled. */
#define SHARP_COS 0.76604444311897804
#define SHARP_COS_HALF 0.93969262078590838

/* --- element.c: the plane-stress triangle -------------------------------------------------------- */

/* Stiffness K of the equilateral triangle u, v, w of unit thickness; order ux uy vx vy wx wy. It does not depend on
 * the side: strain falls with it as the area grows. */
void element_stiffness(double young, double poisson, double k[6][6]);

/* The columns of R that lie in the element's plane. */
typedef struct ElementFrame {
    Vec3 x, y;
} ElementFrame;

/* Local frame of the triangle p with u = p[turn], v = p[turn + 1], w = p[turn + 2]: x along u->v, w on the side of
 * y, then turned within the plane to the polar rotation. (A frame left on u->v depends on which edge comes first
 * and puts a torque on the triangle: a skin of such elements never rests, but creeps by a hundredth of an edge
 * a step.)
 * Inverted (2.6.2): w is the vertex of the smallest height, x stays on u->v and y is reflected, so that the
 * triangle seems to have passed through the edge u-v and is pushed back through it. A triangle without area takes
 * its side from the outward normals of its vertices; one without length gets a zero frame and so no force. */
ElementFrame element_frame(const Vec3 p[3], const Vec3 normal[3], bool inverted, int *turn);

/* f = -R K (R^T x - x0) of eq. 2 with the restoring sign, on u, v, w (already turned). */
void element_force(double k[6][6], double rest, const ElementFrame *frame, const Vec3 uvw[3], Vec3 f[3]);

/* R K R^T d. K moves nothing when all nodes move alike, so the first node is taken as origin. */
static inline void element_apply(double k[6][6], const ElementFrame *frame, Vec3 du, Vec3 dv, Vec3 dw, Vec3 out[3])
{
    Vec3 a = v_sub(dv, du), b = v_sub(dw, du);
    double a0 = v_dot(frame->x, a), a1 = v_dot(frame->y, a);
    double b0 = v_dot(frame->x, b), b1 = v_dot(frame->y, b);
    double f2 = k[2][2] * a0 + k[2][3] * a1 + k[2][4] * b0 + k[2][5] * b1;
    double f3 = k[3][2] * a0 + k[3][3] * a1 + k[3][4] * b0 + k[3][5] * b1;
    double f4 = k[4][2] * a0 + k[4][3] * a1 + k[4][4] * b0 + k[4][5] * b1;
    double f5 = k[5][2] * a0 + k[5][3] * a1 + k[5][4] * b0 + k[5][5] * b1;
    out[1] = v_axpy(v_scale(frame->x, f2), f3, frame->y);
    out[2] = v_axpy(v_scale(frame->x, f4), f5, frame->y);
    out[0] = v_scale(v_add(out[1], out[2]), -1);
}

/* --- spring.c: springs along the edges ----------------------------------------------------------- */

/* -df/dx of a spring of length l along the unit vector d: k d d^T + k max(0, 1 - rest/l) (I - d d^T). The clamp keeps
 * it positive when the spring is compressed. */
typedef struct Spring {
    Vec3 d;
    double along, across;
} Spring;

/* Fills the spring from node 0 to node 1 and its forces on both. */
Spring spring_make(double k, double rest, Vec3 p0, Vec3 p1, Vec3 f[2]);

static inline void spring_apply(const Spring *s, Vec3 d0, Vec3 d1, Vec3 out[2])
{
    Vec3 e = v_sub(d1, d0);
    out[1] = v_axpy(v_scale(e, s->across), (s->along - s->across) * v_dot(s->d, e), s->d);
    out[0] = v_scale(out[1], -1);
}

/* The triangles' edges as vertex pairs, each once, in the order in which the triangles first name them. */
int spring_edges(int ntri, const int32_t *tri, Map *seen, int32_t *edge);

/* --- elastic.c: the linear model of a step ------------------------------------------------------- */

/* Which slots (corner c of element e is slot arity e + c) meet at a vertex, in element order. */
typedef struct Incidence {
    int32_t *first; /* [n+1] */
    int32_t *slot;  /* [first[n]] */
    int cap_first, cap_slot;
} Incidence;

/* node[nslot] holds numbers 0 ... n - 1; slots with n itself are left out. */
void incidence_build(Incidence *inc, int n, int nslot, const int32_t *node);

/* Symmetric 3x3: xx, xy, xz, yy, yz, zz. */
typedef struct Sym3 {
    double m[6];
} Sym3;

static inline Vec3 sym_mul(const Sym3 *s, Vec3 p)
{
    const double *m = s->m;
    return vec3(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[1] * p.x + m[3] * p.y + m[4] * p.z,
                m[2] * p.x + m[4] * p.y + m[5] * p.z);
}

typedef struct Elastic {
    const MechanicsSettings *set; /* of the step under way */
    const MechanicsProblem *prob;
    int nfree, nelem, arity;      /* arity: nodes of an element, 3 or 2 */
    int32_t *vert;                /* [nfree]  free vertex -> vertex */
    int32_t *local;               /* [nvert]  vertex -> free vertex, nfree where frozen */
    int32_t *edge;                /* [2*nelem] springs: their vertices */
    int32_t *tri;                 /* [nelem]  triangles: the element's number in the problem */
    int32_t *node;                /* [arity*nelem] free vertices of element e, in local order u, v, w */
    ElementFrame *frame;          /* [nelem] */
    Spring *spring;               /* [nelem] */
    Vec3 *part;                   /* [arity*nelem] what each element does to its nodes */
    Incidence inc;                /* of node */
    Map seen;
    double k[6][6];
    int cap_vert, cap_free, cap_tri, cap_edge, cap_part;
} Elastic;

/* Sets up the model and leaves the elements' forces in `part`. prob->frozen is heeded unless `all`. */
void elastic_build(Elastic *el, const MechanicsSettings *set, const MechanicsProblem *prob, bool all);
void elastic_free(Elastic *el);
/* part = -df/dx d of the n elements only[n], or of the first n where that is NULL; d[nfree+1] with d[nfree] = 0. */
void elastic_apply(Elastic *el, const Vec3 *d, int n, const int32_t *only);
/* What -df/dx puts on a free vertex's diagonal: the mean over the directions of the tangent plane. */
double elastic_diagonal(const Elastic *el, int v);

/* Sum of the parts at a free vertex. */
static inline Vec3 elastic_gather(const Elastic *el, int v)
{
    Vec3 sum = {0};
    for (int i = el->inc.first[v]; i < el->inc.first[v + 1]; i++) sum = v_add(sum, el->part[el->inc.slot[i]]);
    return sum;
}

/* --- sharp.c: the constraint of eq. 4 ------------------------------------------------------------ */

typedef enum SharpKind {
    SHARP_NOT,
    SHARP_RIDGE,  /* moves along the ridge only, but for eq. 4 */
    SHARP_CORNER, /* moves by eq. 4 only */
    SHARP_ROUND,  /* moves in its tangent plane and by eq. 4 */
} SharpKind;

typedef struct Sharp {
    int nvert;       /* sharp free vertices; 0: none, and what follows is not filled in */
    int32_t *vert;   /* [nvert] */
    Vec3 *move;      /* [nvert] */
    uint8_t *kind;   /* [nfree] SharpKind */
    Vec3 *ridge;     /* [nfree] unit direction, of ridge vertices */
    const Incidence *around; /* slot 3 i + c: triangle tri[i], or i where that is NULL, at each free vertex */
    const int32_t *tri;
    Incidence inc;   /* of the triangles, where the elements are springs */
    int nnear;       /* elements of sharp vertices, */
    int32_t *near;   /* [nnear] */
    int nnear_vert;  /* and the free vertices of those */
    int32_t *near_vert; /* [nnear_vert] */
    int cap_vert, cap_near, cap_near_vert;
} Sharp;

/* Finds the sharp vertices: none when set->sharp is off or there are no triangle normals. */
void sharp_build(Sharp *sh, const Elastic *el);
/* The filter S of a free vertex: I - n n^T, t t^T along a ridge, 0 at a corner. */
Sym3 sharp_filter(const Sharp *sh, int v, Vec3 normal);
/* Moves the iterate x[nfree] of the sharp vertices by eq. 4, which is left in `move`. All see the same x: no order. */
void sharp_correct(Sharp *sh, const Elastic *el, Vec3 *x);
void sharp_free(Sharp *sh);

/* --- cg.c: the filtered conjugate gradient ------------------------------------------------------- */

typedef struct Cg {
    Vec3 *x, *p;            /* [nfree+1] iterate and direction; the last is zero: every frozen vertex */
    Vec3 *r, *q;            /* [nfree] residual, A p and the preconditioned residual */
    Sym3 *s;                /* [nfree] the filter */
    double *pre;            /* [nfree] the preconditioner: one over the diagonal */
    double (*sum)[3];       /* [blocks] partial dot products */
    int cap;
} Cg;

/* Solves S (I - dt df/dx) S x = S dt f of the model just built. */
CgStat cg_solve(Cg *cg, Elastic *el, Sharp *sh);
void cg_free(Cg *cg);

typedef struct MechanicsScratch {
    Elastic elastic;
    Sharp sharp;
    Cg cg;
} MechanicsScratch;
