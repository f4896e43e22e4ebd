#include "mechanics/mechanics_priv.h"

#include "base/thread.h"

/* The conjugate gradient of Baraff and Witkin 1998 (5.3) on eq. 1, A = I - dt df/dx = I + dt K:
 * a vertex may not move along its normal n, so residual and directions are filtered by S = I - n n^T. The vectors
 * stay in the tangent planes, where S A S is symmetric and positive: an ordinary conjugate gradient. What a
 * vertex does outside its plane is prescribed from without, by eq. 4 between the iterations (sharp.c).
 *
 * M, one number a vertex, is the preconditioner; it commutes with S. It earns a tenth of the iterations where
 * valences are uneven (4 to 9); the full tangential block earned little more and cost two iterations to set up. */

typedef struct Pass {
    Cg *cg;
    Elastic *el;
    const Sharp *sh;
    double alpha, beta;
} Pass;

static void reserve(Cg *cg, int nfree)
{
    if (nfree + 1 <= cg->cap) return;
    cg->cap = mem_capacity(cg->cap, nfree + 1);
    RESIZE(cg->x, cg->cap);
    RESIZE(cg->p, cg->cap);
    RESIZE(cg->r, cg->cap);
    RESIZE(cg->q, cg->cap);
    RESIZE(cg->s, cg->cap);
    RESIZE(cg->pre, cg->cap);
    RESIZE(cg->sum, cg->cap / MECHANICS_GRAIN + 1);
}

/* Adds up one of the sums that a pass left by block. */
static double total(const Cg *cg, int n, int which)
{
    double sum = 0;
    for (int b = 0; b * MECHANICS_GRAIN < n; b++) sum += cg->sum[b][which];
    return sum;
}

static void run(Pass *ps, ParallelFn *fn) { parallel_for(ps->el->nfree, MECHANICS_GRAIN, fn, ps); }

/* x = 0, r = S b, b = dt f, p = M r. */
static void pass_start(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    Cg *cg = ps->cg;
    double dt = ps->el->set->dt, rr = 0, rz = 0;
    for (int v = begin; v < end; v++) {
        cg->s[v] = sharp_filter(ps->sh, v, ps->el->prob->normal[ps->el->vert[v]]);
        cg->pre[v] = 1 / (1 + dt * elastic_diagonal(ps->el, v));
        cg->x[v] = vec3(0, 0, 0);
        cg->r[v] = sym_mul(&cg->s[v], v_scale(elastic_gather(ps->el, v), dt));
        cg->p[v] = v_scale(cg->r[v], cg->pre[v]);
        rr += v_len2(cg->r[v]);
        rz += v_dot(cg->r[v], cg->p[v]);
    }
    double *sum = cg->sum[begin / MECHANICS_GRAIN];
    sum[0] = rr;
    sum[1] = rz;
}

/* q = A p after elastic_apply(p). */
static void pass_product(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    Cg *cg = ps->cg;
    double dt = ps->el->set->dt, pq = 0;
    for (int v = begin; v < end; v++) {
        Vec3 q = v_axpy(cg->p[v], dt, elastic_gather(ps->el, v));
        cg->q[v] = q;
        pq += v_dot(cg->p[v], q);
    }
    cg->sum[begin / MECHANICS_GRAIN][0] = pq;
}

/* x += alpha p. */
static void pass_move(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    for (int v = begin; v < end; v++) ps->cg->x[v] = v_axpy(ps->cg->x[v], ps->alpha, ps->cg->p[v]);
}

/* q again where eq. 4 made the step another one. */
static void pass_product_near(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    for (int i = begin; i < end; i++) {
        int v = ps->sh->near_vert[i];
        ps->cg->q[v] = v_axpy(ps->cg->p[v], ps->el->set->dt, elastic_gather(ps->el, v));
    }
}

/* Eq. 4 moves the sharp vertices of x by m: as if p had been p + m / alpha, and q = A p with it. A residual that did not know
 * of it would be wrong. */
static void correct(Pass *ps, Sharp *sh)
{
    Cg *cg = ps->cg;
    sharp_correct(sh, ps->el, cg->x);
    if (!(ps->alpha > 0)) ps->alpha = 1; /* p is 0 then */
    for (int i = 0; i < sh->nvert; i++) cg->p[sh->vert[i]] = v_axpy(cg->p[sh->vert[i]], 1 / ps->alpha, sh->move[i]);
    elastic_apply(ps->el, cg->p, sh->nnear, sh->near);
    parallel_for(sh->nnear_vert, MECHANICS_GRAIN, pass_product_near, ps);
    for (int i = 0; i < sh->nvert; i++) cg->p[sh->vert[i]] = v_axpy(cg->p[sh->vert[i]], -1 / ps->alpha, sh->move[i]);
}

/* r = S (r - alpha q), z = M r; z takes q's place. Filtering the sum rather than q leaves no rounding along the normals to
 * pile up in r. The third sum, z . r_old, makes beta that of Polak and Ribiere, which forgets directions that no longer
 * serve: without eq. 4 it is 0. */
static void pass_update(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    Cg *cg = ps->cg;
    double alpha = ps->alpha, rr = 0, rz = 0, zo = 0;
    for (int v = begin; v < end; v++) {
        Vec3 r = sym_mul(&cg->s[v], v_axpy(cg->r[v], -alpha, cg->q[v]));
        Vec3 z = v_scale(r, cg->pre[v]);
        rr += v_len2(r);
        rz += v_dot(r, z);
        zo += v_dot(z, cg->r[v]);
        cg->r[v] = r;
        cg->q[v] = z;
    }
    double *sum = cg->sum[begin / MECHANICS_GRAIN];
    sum[0] = rr;
    sum[1] = rz;
    sum[2] = zo;
}

/* p = z + beta p. */
static void pass_direction(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    for (int v = begin; v < end; v++) ps->cg->p[v] = v_axpy(ps->cg->q[v], ps->beta, ps->cg->p[v]);
}

CgStat cg_solve(Cg *cg, Elastic *el, Sharp *sh)
{
    const MechanicsSettings *set = el->set;
    const int n = el->nfree;
    Pass ps = {.cg = cg, .el = el, .sh = sh};
    reserve(cg, n);
    cg->x[n] = cg->p[n] = vec3(0, 0, 0);
    run(&ps, pass_start);
    double first = total(cg, n, 0), rr = first, rz = total(cg, n, 1);
    bool still = !(first > 0) && sh->nvert == 0;
    CgStat st = {.converged = still};
    if (still) return st;

    const double goal = set->cg_tolerance * set->cg_tolerance * first;
    while (st.iterations < set->cg_iterations && !(set->cg_tolerance > 0 && rr <= goal)) {
        elastic_apply(el, cg->p, el->nelem, NULL);
        run(&ps, pass_product);
        double pq = total(cg, n, 0);
        ps.alpha = pq > 0 ? rz / pq : 0;
        run(&ps, pass_move);
        if (sh->nvert > 0) correct(&ps, sh);
        run(&ps, pass_update);
        double old = rz;
        rr = total(cg, n, 0);
        rz = total(cg, n, 1);
        ps.beta = old > 0 ? real_max(0, (rz - total(cg, n, 2)) / old) : 0;
        run(&ps, pass_direction);
        st.iterations++;
    }
    st.residual = first > 0 ? sqrt(rr / first) : 0;
    st.converged = rr <= goal;
    return st;
}

void cg_free(Cg *cg)
{
    mem_free(cg->x);
    mem_free(cg->p);
    mem_free(cg->r);
    mem_free(cg->q);
    mem_free(cg->s);
    mem_free(cg->pre);
    mem_free(cg->sum);
    *cg = (Cg){0};
}
