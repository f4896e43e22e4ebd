/* hessian.c: how far the surface's normal turns along an edge, by the second derivatives of the field (GI'07 section 3).
 *
 * Along a unit vector d the unit normal n = -g / |g|, g the gradient of F and H its Hessian, changes by
 * (I - n n^T) H d / |g|. The length of that, summed along an edge, is the turn that the normal makes on its way, whatever
 * the normals at the ends are. Rows of points parallel to the edge, a voxel apart, see what lies beside it in its two
 * triangles: the hernia of figure 7c, which no vertex, centroid or edge need touch. */
#include "refine/refine_priv.h"

#include "base/thread.h"

enum { CUTS_MIN = 2, CUTS_MAX = 32, POINTS = BATCH / 4 };
#define DIFFERENCE_VOX 0.5 /* central differences of the smooth gradient over this, either way */
#define SPACING_VOX 1.0    /* of rows and of points in them */

/* A point by how many steps it is away from the edges opposite to corners 0, 1, 2. */
typedef struct Node {
    int away[3];
} Node;

/* The rows of a triangle: row i of direction k is i steps away from edge k (corners k and k+1). */
typedef struct Rows {
    int cuts;
    double h;                     /* of the differences, world units */
    Vec3 corner[3];
    Vec3 u, w;                    /* an orthonormal frame of the plane */
    double along[3][2];           /* edge k = along[k][0] u + along[k][1] w */
    double turn[3][CUTS_MAX + 1]; /* radians */
    int n;
    Node node[POINTS];            /* [n] not sampled yet, */
    Vec3 at[BATCH];               /* [4*n] at +u, -u, +w, -w from each */
} Rows;

static void rows_begin(Rows *r, const Pass *p, int t)
{
    const int32_t *c = p->tri + 3 * t;
    double longest = 0;
    for (int k = 0; k < 3; k++) r->corner[k] = p->m->pos[c[k]];
    for (int k = 0; k < 3; k++) longest = real_max(longest, v_dist(r->corner[k], r->corner[(k + 1) % 3]));
    r->cuts = (int)real_clamp(ceil(longest / (SPACING_VOX * p->field->voxel)), CUTS_MIN, CUTS_MAX);
    r->n = 0;
    r->h = DIFFERENCE_VOX * p->field->voxel;
    r->u = v_unit(v_sub(r->corner[1], r->corner[0]));
    r->w = v_unit(v_cross(v_area2(r->corner[0], r->corner[1], r->corner[2]), r->u));
    for (int k = 0; k < 3; k++) {
        Vec3 edge = v_sub(r->corner[(k + 1) % 3], r->corner[k]);
        r->along[k][0] = v_dot(edge, r->u);
        r->along[k][1] = v_dot(edge, r->w);
        for (int i = 0; i <= r->cuts; i++) r->turn[k][i] = 0;
    }
}

/* Adds what the normal turns about one node, by the gradients at +u, -u, +w, -w from it. */
static void rows_add(Rows *r, const Node *node, const Vec3 g[4])
{
    Vec3 mean = v_scale(v_add(v_add(g[0], g[1]), v_add(g[2], g[3])), 0.25);
    double l = v_len(mean);
    for (int i = 0; i < 4; i++)
        if (!(v_len2(g[i]) > 0)) return; /* where the field is not known */
    if (!(l > 0)) return;
    Vec3 n = v_scale(mean, 1 / l);
    Vec3 Hu = v_scale(v_sub(g[0], g[1]), 0.5 / r->h), Hw = v_scale(v_sub(g[2], g[3]), 0.5 / r->h);
    for (int k = 0; k < 3; k++) {
        bool is_end = node->away[k] == 0 || node->away[(k + 1) % 3] == 0;
        Vec3 He = v_add(v_scale(Hu, r->along[k][0]), v_scale(Hw, r->along[k][1]));
        double turn = v_len(v_axpy(He, -v_dot(He, n), n)) / l;
        r->turn[k][node->away[(k + 2) % 3]] += (is_end ? 0.5 : 1) * turn / r->cuts;
    }
}

static void rows_flush(Rows *r, const Field *f)
{
    Vec3 g[BATCH];
    double F[BATCH];
    field_sample(f, 4 * r->n, r->at, F, g);
    for (int i = 0; i < r->n; i++) rows_add(r, &r->node[i], g + 4 * i);
    r->n = 0;
}

static void rows_put(Rows *r, const Field *f, Node node)
{
    Vec3 p = vec3(0, 0, 0), *at = r->at + 4 * r->n;
    for (int k = 0; k < 3; k++) p = v_axpy(p, (double)node.away[k] / r->cuts, r->corner[k]);
    at[0] = v_axpy(p, r->h, r->u), at[1] = v_axpy(p, -r->h, r->u);
    at[2] = v_axpy(p, r->h, r->w), at[3] = v_axpy(p, -r->h, r->w);
    r->node[r->n++] = node;
    if (r->n == POINTS) rows_flush(r, f);
}

static void rows_run(Rows *r, const Field *f)
{
    for (int i = 0; i <= r->cuts; i++)
        for (int j = 0; j <= r->cuts - i; j++) rows_put(r, f, (Node){{i, j, r->cuts - i - j}});
    rows_flush(r, f);
}

/* The last row is a corner, and has no length. */
static double rows_most(const Rows *r, int k)
{
    double most = 0;
    for (int i = 0; i < r->cuts; i++) most = real_max(most, r->turn[k][i]);
    return most;
}

static void turn_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    for (int t = begin; t < end; t++) {
        if (!(p->state[t] & TRI_NEW)) continue;
        Rows r;
        rows_begin(&r, p, t);
        rows_run(&r, p->field);
        for (int k = 0; k < 3; k++) {
            int e = p->edge_of[3 * t + k];
            p->turn[e][p->half[e][1] == 3 * t + k] = rows_most(&r, k);
        }
        p->state[t] = 0;
    }
}

void pass_find_turns(Pass *p) { parallel_for(p->ntri, GRAIN, turn_block, p); }
