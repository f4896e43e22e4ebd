/* scene_priv.h: elements as the file has them, and posed at a frame. */
#pragma once
#include "scene/scene.h"

enum { LANES = 32, WARPS_MAX = 4, KEYS_MAX = 100000 };

/* --- key.c: values over time ------------------------------------------------------------------------ */

typedef enum Ease { EASE_LINEAR, EASE_SMOOTH, EASE_STEP } Ease;

/* 1, 3 or 4 numbers a key; four are a unit quaternion w, x, y, z. */
typedef struct Keys {
    int n, width;
    Ease ease;
    double *frame;     /* [n] rising; one key: a constant */
    double *value;     /* [n * width] */
} Keys;

Keys keys_constant(int width, const double *value);
void keys_free(Keys *k);
/* Held before the first key and after the last. Smooth eases in and out of every key; quaternions take the short way. */
void keys_at(const Keys *k, double frame, double *out);

/* --- elements ------------------------------------------------------------------------------------------ */

typedef enum Shape { SHAPE_POINTS, SHAPE_SEGMENTS, SHAPE_TRIANGLES, SHAPE_POLYLINE } Shape;
typedef enum KernelKind { KERNEL_INVERSE_SQUARE, KERNEL_COMPACT } KernelKind;
typedef enum WarpKind { WARP_TWIST, WARP_BEND, WARP_TAPER } WarpKind;

typedef struct Warp {
    WarpKind kind;
    int axis;          /* 0 1 2: what it runs along */
    Keys amount;       /* twist, bend: degrees a unit of length; taper: growth a unit of length */
} Warp;

struct Element {
    Shape shape;
    int npart;         /* points, segments, triangles; a polyline is one part of ncorner - 1 segments */
    int ncorner;
    Vec3 *corner;      /* [ncorner] local */
    KernelKind kernel;
    double norm;       /* q of ||.||_q, > 0 */
    double strength;
    Keys radius, translate, rotate, degrees, scale; /* degrees.n > 0: about `axis`, instead of rotate */
    Vec3 axis;
    int nwarp;
    Warp warp[WARPS_MAX];
};

/* --- index.c: parts of compact kernels by cells --------------------------------------------------------------- */

/* Each part stands in every cell that its reach touches, so that a point asks one cell. */
typedef struct PartIndex {
    int n[3];
    Vec3 lo;
    double cell;       /* side, local units; 0: no index */
    int32_t *first;    /* [n0*n1*n2 + 1] */
    int32_t *part;     /* rising within a cell */
} PartIndex;

/* `reach`: half side of the box around a part beyond which it is 0. */
void index_build(PartIndex *ix, const Element *e, double reach);
void index_free(PartIndex *ix);
/* The parts that may reach the point; *n: how many. */
const int32_t *index_at(const PartIndex *ix, Vec3 p, int *n);

/* --- tree.c: many points under 1/d^2 ----------------------------------------------------------------------------- */

typedef struct TreeNode {
    Vec3 centre;          /* of mass */
    double far2;          /* square of the distance from it where the moments are good enough */
    double q[6];          /* sum r r^T: xx yy zz xy xz yz */
    int begin, end;       /* points */
    int skip;             /* the node after this one's subtree */
} TreeNode;

typedef struct PointTree {
    int nnode;
    TreeNode *node;       /* depth first */
    Vec3 *point;          /* in the tree's order */
    double R;
} PointTree;

/* For sums of R^2/d^2 (softened as the kernel is) that are wrong by `error` at most. */
void tree_build(PointTree *t, int n, const Vec3 *point, double R, double error);
void tree_free(PointTree *t);
/* The sum at p; its gradient is added to *grad. */
double tree_sum(const PointTree *t, Vec3 p, Vec3 *grad);

/* --- an element at a frame ------------------------------------------------------------------------------------------ */

typedef struct Pose {
    const Element *e;
    Affine place;         /* local to world */
    double shrink;        /* the most by which world distances grow on the way to local ones */
    double radius;
    double amount[WARPS_MAX]; /* radians, or growth, a unit of length */
    PartIndex index;
    PointTree tree;       /* nnode > 0: there is one */
} Pose;

struct SceneFrame {
    const Scene *scene;
    double frame;
    Pose *pose;           /* [scene->nelement] */
};

typedef struct Lanes {
    double x[LANES], y[LANES], z[LANES];
} Lanes;

/* part.c: adds strength-less kernel values of an element at n <= LANES local points, and their gradients. */
void pose_add(const Pose *e, int n, const Lanes *p, double *phi, Lanes *grad);
/* The interval of one part's kernel in the local ball; false where it is 0 all over. */
bool part_bound(const Pose *e, int part, Vec3 c, double radius, double *low, double *high);

/* warp.c: from the bent space to the straight one, and back with gradients. */
Vec3 warp_undo(WarpKind kind, int axis, double amount, Vec3 p);
/* The gradient over p from the one over warp_undo's result. */
Vec3 warp_gradient(WarpKind kind, int axis, double amount, Vec3 p, Vec3 g);
/* The radius of a ball around the image of c that holds the image of the ball (c, radius); INFINITY: not known. */
double warp_ball(WarpKind kind, int axis, double amount, Vec3 c, double radius);
/* World to straight local space: the centre moves, the radius grows. */
void pose_ball(const Pose *e, Vec3 *c, double *radius);
