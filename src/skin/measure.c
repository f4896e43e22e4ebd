#include "skin/skin_priv.h"

#include "base/thread.h"

/* Six tetrahedra around a cell's diagonal; corner c at (c & 1, c >> 1 & 1, c >> 2). */
static const int TETS[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

static Vec3 corner_place(int c) { return vec3(c & 1, c >> 1 & 1, c >> 2); }

static Vec3 crossing(const float F[8], int a, int b)
{
    double fa = (double)F[a], fb = (double)F[b];
    return v_mix(corner_place(a), corner_place(b), fa / (fa - fb));
}

/* A triangle that faces away from `inside`; `origin` is its cell's. */
static void add_triangle(Extent *e, Vec3 origin, Vec3 a, Vec3 b, Vec3 c, Vec3 inside)
{
    Vec3 n = v_area2(a, b, c);
    double side = v_dot(n, v_sub(a, inside)) < 0 ? -1 : 1;
    e->area += 0.5 * v_len(n);
    e->volume += side * v_dot(n, v_add(origin, a)) / 6; /* of the cone to the lattice's origin */
}

static void add_tet(Extent *e, Vec3 origin, const float F[8], const int tet[4])
{
    int in[4], out[4], nin = 0, nout = 0;
    for (int k = 0; k < 4; k++) {
        if (F[tet[k]] > 0) in[nin++] = tet[k];
        else out[nout++] = tet[k];
    }
    if (nin == 0 || nout == 0) return;
    Vec3 inside = corner_place(in[0]);
    if (nin == 2) {
        Vec3 p = crossing(F, in[0], out[0]), q = crossing(F, in[0], out[1]), r = crossing(F, in[1], out[1]), s = crossing(F, in[1], out[0]);
        add_triangle(e, origin, p, q, r, inside);
        add_triangle(e, origin, p, r, s, inside);
        return;
    }
    const int *one = nin == 1 ? in : out, *three = nin == 1 ? out : in;
    add_triangle(e, origin, crossing(F, one[0], three[0]), crossing(F, one[0], three[1]), crossing(F, one[0], three[2]), inside);
}

typedef struct MeasureJob {
    const Band *b;
    Extent *of; /* [b->n] voxels */
} MeasureJob;

/* Cells whose first corner is a brick's. */
static void measure_bricks(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    const Band *b = job->b;
    float pad[PAD1 * PAD1 * PAD1];
    for (int i = begin; i < end; i++) {
        Extent e = {0, 0};
        band_gather(b->value, b->near[i], 1, 0, pad);
        for (int c = 0; c < CELLS; c++) {
            int x = c & 7, y = c >> 3 & 7, z = c >> 6, in = 0;
            float F[8];
            for (int k = 0; k < 8; k++) {
                F[k] = pad[1 + x + (k & 1) + PAD1 * (1 + y + (k >> 1 & 1)) + PAD1 * PAD1 * (1 + z + (k >> 2))];
                in += F[k] > 0;
            }
            if (in == 0 || in == 8) continue;
            Vec3 origin = vec3(b->at[i][0] * SIDE + x, b->at[i][1] * SIDE + y, b->at[i][2] * SIDE + z);
            for (int t = 0; t < 6; t++) add_tet(&e, origin, F, TETS[t]);
        }
        job->of[i] = e;
    }
}

Extent band_measure(const Band *b)
{
    Extent sum = {0, 0};
    MeasureJob job = {b, NEW(Extent, b->n)};
    parallel_for(b->n, 8, measure_bricks, &job);
    for (int i = 0; i < b->n; i++) {
        sum.area += job.of[i].area;
        sum.volume += job.of[i].volume;
    }
    mem_free(job.of);
    const double dx = (double)DX;
    return (Extent){sum.area * dx * dx, sum.volume * dx * dx * dx};
}
