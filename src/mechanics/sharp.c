#include "mechanics/mechanics_priv.h"

#include "base/thread.h"

/* GI'07 eq. 4 as printed moves p along grad F(p), where the tangent filter and the landing undo it. With the normals m
 * of the field at the *centroids* (Ohtake, Belyaev, Pasko 2003) it draws p to the planes of its triangles, and
 * where these are two or three planes, to their ridge or corner.
 *
 * Alone it does not hold: the triangles of p's own face go on pulling p off the ridge, and the filter hides the pull of
 * the others. So on a ridge p is free along the ridge only, at a corner not at all, and eq. 4 has the other
 * directions to itself: what Baraff and Witkin call a prescribed displacement. */

typedef struct Pass {
    Sharp *sh;
    const Elastic *el;
    Vec3 *x;
} Pass;

/* --- who is sharp -------------------------------------------------------------------------------- */

/* Triangle i of those that meet at free vertices. */
static int triangle_of(const Sharp *sh, int i)
{
    int t = sh->around->slot[i] / 3;
    return sh->tri ? sh->tri[t] : t;
}

/* Whether all triangles of v face within half the threshold of one of them, so that no two differ by all of it; a
 * vertex of an inverted triangle has to be unfolded first and counts as smooth, too. */
static bool is_smooth(const Sharp *sh, const MechanicsProblem *prob, int v)
{
    int begin = sh->around->first[v], end = sh->around->first[v + 1];
    bool alike = true;
    if (begin == end) return true;
    const Vec3 first = prob->tri_normal[triangle_of(sh, begin)];
    for (int i = begin; i < end; i++) {
        int t = triangle_of(sh, i);
        if (prob->inverted && prob->inverted[t]) return true;
        alike &= v_dot(prob->tri_normal[t], first) > SHARP_COS_HALF;
    }
    return alike;
}

/* The corner of a triangle so many behind vertex `vert`. */
static int corner_beside(const MechanicsProblem *prob, int t, int vert, int behind)
{
    const int32_t *c = prob->tri + 3 * t;
    return c[((c[0] == vert ? 0 : c[1] == vert ? 1 : 2) + behind) % 3];
}

/* Counts the edges of v across which the field's normal turns by the threshold: two make a ridge, more a corner. If it
 * turns at every edge, v may as well be the tip of a droplet of few triangles: it has to stay free. */
static SharpKind kind_of(const Sharp *sh, const MechanicsProblem *prob, int v, int vert, Vec3 *ridge)
{
    int begin = sh->around->first[v], end = sh->around->first[v + 1], nturn = 0, nedge = 0;
    double most = 0;
    for (int i = begin; i < end; i++)
        for (int j = begin; j < end; j++) {
            int a = triangle_of(sh, i), b = triangle_of(sh, j);
            Vec3 ma = prob->tri_normal[a], mb = prob->tri_normal[b], across = v_cross(ma, mb);
            if (v_len2(across) > most) {
                most = v_len2(across);
                *ridge = v_scale(across, 1 / sqrt(most));
            }
            /* triangle a ends at the edge where b begins */
            if (i == j || corner_beside(prob, a, vert, 2) != corner_beside(prob, b, vert, 1)) continue;
            nedge++;
            nturn += v_dot(ma, mb) < SHARP_COS;
        }
    if (nturn < 2) return SHARP_NOT;
    if (nturn == 2) return most > 0 ? SHARP_RIDGE : SHARP_NOT;
    return nturn < nedge ? SHARP_CORNER : SHARP_ROUND;
}

static void pass_kind(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    Sharp *sh = ps->sh;
    const MechanicsProblem *prob = ps->el->prob;
    for (int v = begin; v < end; v++)
        sh->kind[v] = is_smooth(sh, prob, v) ? SHARP_NOT : (uint8_t)kind_of(sh, prob, v, ps->el->vert[v], &sh->ridge[v]);
}

/* What a move of the sharp vertices reaches. */
static void find_near(Sharp *sh, const Elastic *el)
{
    uint8_t *seen = NEW0(uint8_t, el->nelem), *seen_vert = NEW0(uint8_t, el->nfree + 1);
    sh->nnear = sh->nnear_vert = 0;
    for (int i = 0; i < sh->nvert; i++)
        for (int k = el->inc.first[sh->vert[i]]; k < el->inc.first[sh->vert[i] + 1]; k++) {
            int e = el->inc.slot[k] / el->arity;
            if (seen[e]) continue;
            seen[e] = 1;
            RESERVE(sh->near, sh->cap_near, sh->nnear + 1);
            sh->near[sh->nnear++] = e;
        }
    seen_vert[el->nfree] = 1; /* the frozen */
    for (int i = 0; i < el->arity * sh->nnear; i++) {
        int v = el->node[el->arity * sh->near[i / el->arity] + i % el->arity];
        if (seen_vert[v]) continue;
        seen_vert[v] = 1;
        RESERVE(sh->near_vert, sh->cap_near_vert, sh->nnear_vert + 1);
        sh->near_vert[sh->nnear_vert++] = v;
    }
    mem_free(seen);
    mem_free(seen_vert);
}

/* The elements' own incidence will do where they are the triangles. */
static void find_around(Sharp *sh, const Elastic *el)
{
    const MechanicsProblem *prob = el->prob;
    sh->around = &el->inc;
    sh->tri = el->tri;
    if (el->arity == 3) return;
    int32_t *node = NEW(int32_t, 3 * prob->ntri);
    for (int i = 0; i < 3 * prob->ntri; i++) node[i] = el->local[prob->tri[i]];
    incidence_build(&sh->inc, el->nfree, 3 * prob->ntri, node);
    mem_free(node);
    sh->around = &sh->inc;
    sh->tri = NULL;
}

void sharp_build(Sharp *sh, const Elastic *el)
{
    const MechanicsProblem *prob = el->prob;
    sh->nvert = 0;
    if (!el->set->sharp || !prob->tri_normal || el->nfree == 0) return;
    find_around(sh, el);
    if (el->nfree > sh->cap_vert) {
        sh->cap_vert = mem_capacity(sh->cap_vert, el->nfree);
        RESIZE(sh->vert, sh->cap_vert);
        RESIZE(sh->kind, sh->cap_vert);
        RESIZE(sh->ridge, sh->cap_vert);
        RESIZE(sh->move, sh->cap_vert);
    }
    parallel_for(el->nfree, MECHANICS_GRAIN, pass_kind, &(Pass){sh, el, NULL});
    for (int v = 0; v < el->nfree; v++)
        if (sh->kind[v] != SHARP_NOT) sh->vert[sh->nvert++] = v;
    if (sh->nvert) find_near(sh, el);
}

Sym3 sharp_filter(const Sharp *sh, int v, Vec3 normal)
{
    SharpKind kind = sh->nvert > 0 ? (SharpKind)sh->kind[v] : SHARP_NOT;
    if (kind == SHARP_CORNER) return (Sym3){{0}};
    Vec3 a = kind == SHARP_RIDGE ? sh->ridge[v] : normal;
    double one = kind == SHARP_RIDGE ? 0 : 1, s = 1 - 2 * one;
    return (Sym3){{one + s * a.x * a.x, s * a.x * a.y, s * a.x * a.z, one + s * a.y * a.y, s * a.y * a.z,
                   one + s * a.z * a.z}};
}

/* --- eq. 4 --------------------------------------------------------------------------------------- */

/* (1 / sum A) sum A [(c - p) . m] m  over the triangles of p, with the iterate's areas A and centroids c. */
static Vec3 move_of(const Sharp *sh, const Elastic *el, const Vec3 *x, int v)
{
    const MechanicsProblem *prob = el->prob;
    Vec3 p = v_add(prob->pos[el->vert[v]], x[v]), sum = {0};
    double area = 0;
    for (int i = sh->around->first[v]; i < sh->around->first[v + 1]; i++) {
        int t = triangle_of(sh, i);
        Vec3 q[3];
        for (int c = 0; c < 3; c++) q[c] = v_add(prob->pos[prob->tri[3 * t + c]], x[el->local[prob->tri[3 * t + c]]]);
        double a = v_len(v_area2(q[0], q[1], q[2]));
        Vec3 m = prob->tri_normal[t], centroid = v_scale(v_add(v_add(q[0], q[1]), q[2]), 1.0 / 3);
        sum = v_axpy(sum, a * v_dot(v_sub(centroid, p), m), m);
        area += a;
    }
    return area > 0 ? v_scale(sum, 1 / area) : vec3(0, 0, 0);
}

static void pass_move(void *ctx, int begin, int end)
{
    Pass *ps = ctx;
    for (int i = begin; i < end; i++) ps->sh->move[i] = move_of(ps->sh, ps->el, ps->x, ps->sh->vert[i]);
}

void sharp_correct(Sharp *sh, const Elastic *el, Vec3 *x)
{
    parallel_for(sh->nvert, MECHANICS_GRAIN, pass_move, &(Pass){sh, el, x});
    for (int i = 0; i < sh->nvert; i++) x[sh->vert[i]] = v_add(x[sh->vert[i]], sh->move[i]);
}

void sharp_free(Sharp *sh)
{
    mem_free(sh->vert);
    mem_free(sh->move);
    mem_free(sh->kind);
    mem_free(sh->ridge);
    mem_free(sh->inc.first);
    mem_free(sh->inc.slot);
    mem_free(sh->near);
    mem_free(sh->near_vert);
    *sh = (Sharp){0};
}
