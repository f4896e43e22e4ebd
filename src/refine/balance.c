/* balance.c: flat triangles whose corners lie on a curved surface all lie to one side of it; with their corners a little off it they
 * lie to both, nearer. */
#include "refine/refine_priv.h"

#include "base/thread.h"

#include <string.h>

#define MEAN_SHARE 0.75    /* a triangle's mean distance from a quadric through its corners, over its centroid's */
#define LIFT_MOST_VOX 0.04
#define LINEAR_SHARE 0.25  /* the surface must be found back below a lifted vertex, to first order, within this share of its lift, */
#define LINEAR_COS 0.95    /* and face the same way: no other sheet is near */

enum { OUT = 1, IN = 2 };

typedef struct Balance {
    RefinedMesh *m;
    const Field *field;
    double *out;       /* [ntri] from the centroid out to the surface, to first order, in world units */
    double *lift;      /* [nvert] how far the vertex goes out */
    uint8_t *sides;    /* [nvert] on which sides of its triangles the surface is: OUT | IN */
} Balance;

static void out_block(void *ctx, int begin, int end)
{
    Balance *b = ctx;
    Vec3 g[BATCH];
    double F[BATCH];
    for (int first = begin; first < end; first += BATCH) {
        int n = int_min(BATCH, end - first);
        sample_centroids(b->m, b->field, first, n, F, g);
        for (int i = 0; i < n; i++) b->out[first + i] = far_vox(b->field, F[i], g[i]) * b->field->voxel * (F[i] < 0 ? -1 : 1);
    }
}

/* A vertex goes by the mean of its triangles, where all of these lie to the same side of the surface. */
static void choose_lifts(Balance *b)
{
    const RefinedMesh *m = b->m;
    double *area = NEW0(double, m->nvert), most = LIFT_MOST_VOX * b->field->voxel;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->tri + 3 * t;
        double a = v_len(v_area2(m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]));
        for (int k = 0; k < 3; k++) {
            b->lift[c[k]] += a * b->out[t];
            area[c[k]] += a;
            b->sides[c[k]] |= b->out[t] < 0 ? IN : OUT;
        }
    }
    for (int v = 0; v < m->nvert; v++)
        b->lift[v] = b->sides[v] == (OUT | IN) || !(area[v] > 0) ? 0 : real_clamp(MEAN_SHARE * b->lift[v] / area[v], -most, most);
    mem_free(area);
}

static bool is_linear(double lift, double F, Vec3 g, Vec3 n)
{
    double l = v_len(g);
    return fabs(F + lift * l) < LINEAR_SHARE * fabs(lift) * l && -v_dot(g, n) > LINEAR_COS * l;
}

static void lift_batch(Balance *b, int n, const int32_t *vert, const Vec3 *to)
{
    RefinedMesh *m = b->m;
    Vec3 g[BATCH];
    double F[BATCH];
    if (n > 0) field_sample(b->field, n, to, F, g);
    for (int i = 0; i < n; i++) {
        int v = vert[i];
        if (!is_linear(b->lift[v], F[i], g[i], m->normal[v])) continue;
        m->pos[v] = to[i];
        field_normals(b->field, 1, &to[i], &m->normal[v]);
    }
}

static void lift_block(void *ctx, int begin, int end)
{
    Balance *b = ctx;
    const RefinedMesh *m = b->m;
    int32_t vert[BATCH];
    Vec3 to[BATCH];
    int n = 0;
    for (int v = begin; v < end; v++) {
        if (b->lift[v] == 0) continue;
        vert[n] = v;
        to[n++] = v_round32(v_axpy(m->pos[v], b->lift[v], m->normal[v]));
        if (n < BATCH) continue;
        lift_batch(b, n, vert, to);
        n = 0;
    }
    lift_batch(b, n, vert, to);
}

Vec3 *refine_balance(RefinedMesh *m, const Field *field)
{
    Balance b = {m, field, NEW(double, m->ntri), NEW0(double, m->nvert), NEW0(uint8_t, m->nvert)};
    Vec3 *landed = NEW(Vec3, m->nvert);
    if (m->nvert) memcpy(landed, m->pos, (size_t)m->nvert * sizeof *landed);
    parallel_for(m->ntri, GRAIN, out_block, &b);
    choose_lifts(&b);
    parallel_for(m->nvert, GRAIN, lift_block, &b);
    mem_free(b.out);
    mem_free(b.lift);
    mem_free(b.sides);
    return landed;
}
