#include "mechanics/mechanics_priv.h"

/* Whether the field normals of the vertex's triangles spread by more than the threshold. */
static bool is_sharp(const Sharp *sh, const Vec3 *normal, int v)
{
    int begin = sh->inc.first[v], end = sh->inc.first[v + 1];
    for (int i = begin; i < end; i++)
        for (int j = begin; j < i; j++)
            if (v_dot(normal[sh->inc.slot[i] / 3], normal[sh->inc.slot[j] / 3]) < SHARP_COS) return true;
    return false;
}

void sharp_build(Sharp *sh, const Elastic *el)
{
    const MechanicsProblem *prob = el->prob;
    sh->nvert = 0;
    if (!el->set->sharp || !prob->tri_normal || el->nfree == 0) return;
    RESERVE(sh->node, sh->cap_node, 3 * prob->ntri);
    for (int i = 0; i < 3 * prob->ntri; i++) sh->node[i] = el->local[prob->tri[i]];
    incidence_build(&sh->inc, el->nfree, 3 * prob->ntri, sh->node);

    if (el->nfree > sh->cap_vert) {
        sh->cap_vert = int_max(el->nfree, 2 * sh->cap_vert);
        RESIZE(sh->vert, sh->cap_vert);
        RESIZE(sh->move, sh->cap_vert);
    }
    for (int v = 0; v < el->nfree; v++)
        if (is_sharp(sh, prob->tri_normal, v)) sh->vert[sh->nvert++] = v;
}

/* Eq. 4 with the gradient at each centroid (Ohtake, Belyaev, Pasko 2003):
 * (1 / sum A) sum A [(c - p) . m] m  over the triangles of p, m the field's unit normal at the centroid. */
static Vec3 sharp_move(const Sharp *sh, const Elastic *el, const Vec3 *x, int v)
{
    const MechanicsProblem *prob = el->prob;
    Vec3 p = v_add(prob->pos[el->vert[v]], x[v]), sum = {0};
    double area = 0;
    for (int i = sh->inc.first[v]; i < sh->inc.first[v + 1]; i++) {
        int t = sh->inc.slot[i] / 3;
        Vec3 q[3];
        for (int c = 0; c < 3; c++) q[c] = v_add(prob->pos[prob->tri[3 * t + c]], x[sh->node[3 * t + c]]);
        double a = v_len(v_area2(q[0], q[1], q[2]));
        Vec3 m = prob->tri_normal[t], centroid = v_scale(v_add(v_add(q[0], q[1]), q[2]), 1.0 / 3);
        sum = v_axpy(sum, a * v_dot(v_sub(centroid, p), m), m);
        area += a;
    }
    return area > 0 ? v_scale(sum, 1 / area) : vec3(0, 0, 0);
}

void sharp_correct(Sharp *sh, const Elastic *el, Vec3 *x)
{
    for (int i = 0; i < sh->nvert; i++) sh->move[i] = sharp_move(sh, el, x, sh->vert[i]);
    for (int i = 0; i < sh->nvert; i++) x[sh->vert[i]] = v_add(x[sh->vert[i]], sh->move[i]);
}

void sharp_free(Sharp *sh)
{
    mem_free(sh->vert);
    mem_free(sh->move);
    mem_free(sh->node);
    mem_free(sh->inc.first);
    mem_free(sh->inc.slot);
    *sh = (Sharp){0};
}
