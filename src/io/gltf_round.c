/* gltf_round.c: positions and normals as small whole numbers, for KHR_mesh_quantization.
 *
 * The step is a power of two and the grid's origin a multiple of it: what a player computes from the whole numbers, the
 * node's scale and its translation is exact in 32-bit floats, and grids of one step agree wherever they overlap. */
#include "io/gltf_priv.h"

#include <math.h>

enum { NORMAL_MOST = 127, EXPONENT_LEAST = -100, FLOAT_BITS = 24 };

double gltf_grid_step(const GltfGrid *grid) { return ldexp(1, grid->exponent); }

/* Before it is known to fit. */
static double round_off(const GltfGrid *grid, int axis, float x)
{
    return floor(ldexp(1, -grid->exponent) * (double)x + 0.5) - (double)grid->origin[axis];
}

int gltf_round(const GltfGrid *grid, int axis, float x) { return (int)round_off(grid, axis, x); }

/* --- grids ------------------------------------------------------------------------------------------ */

bool gltf_grid_fits(const GltfGrid *grid, const float *pos, const float *other, int n)
{
    for (size_t i = 0; i < 3 * (size_t)n; i++) {
        double x = round_off(grid, (int)(i % 3), pos[i]), y = other ? round_off(grid, (int)(i % 3), other[i]) : x;
        if (!(fabs(x) <= GLTF_I16_MOST && fabs(y) <= GLTF_I16_MOST && fabs(y - x) <= GLTF_I16_MOST)) return false;
    }
    return true;
}

/* Whole numbers reach twice as far as the vertices do, so that they may move. */
static GltfGrid grid_around(const float *pos, const float *other, int n)
{
    double lo[3], hi[3], side = 0, far = 0;
    GltfGrid grid;
    for (int k = 0; k < 3; k++) {
        lo[k] = hi[k] = (double)pos[k];
        for (size_t i = (size_t)k; i < 3 * (size_t)n; i += 3) {
            lo[k] = fmin(lo[k], fmin((double)pos[i], (double)(other ? other : pos)[i]));
            hi[k] = fmax(hi[k], fmax((double)pos[i], (double)(other ? other : pos)[i]));
        }
        side = fmax(side, hi[k] - lo[k]);
        far = fmax(far, fmax(fabs(lo[k]), fabs(hi[k])));
    }
    int by_side = EXPONENT_LEAST, by_place = EXPONENT_LEAST;
    if (side > 0) frexp(side / (GLTF_I16_MOST - 1), &by_side); /* 2^by_side is larger */
    if (far > 0) frexp(far, &by_place);
    grid.exponent = int_max(EXPONENT_LEAST, int_max(by_side, by_place - FLOAT_BITS + 1)); /* no finer than floats are there */
    for (int k = 0; k < 3; k++) grid.origin[k] = (int32_t)floor(ldexp(0.5 * (lo[k] + hi[k]), -grid.exponent) + 0.5);
    return grid;
}

int gltf_grid_for(Gltf *g, const float *pos, const float *next, int n)
{
    GltfDoc *d = &g->doc;
    GltfGrid fresh = grid_around(pos, next, n);
    const GltfGrid *last = d->ngrid ? &d->grid[d->ngrid - 1] : NULL;
    if (last && last->exponent <= fresh.exponent && gltf_grid_fits(last, pos, next, n)) return d->ngrid - 1;
    RESERVE(d->grid, d->cap_grid, d->ngrid + 1);
    d->grid[d->ngrid] = fresh;
    return d->ngrid++;
}

/* --- normals ---------------------------------------------------------------------------------------- */

static int round_unit(double x) { return (int)floor(NORMAL_MOST * x + 0.5); }

/* A target's normal is the base's and a difference of at most 1 an axis: a normal that has turned farther than that allows is
 * shortened, which keeps its direction. */
void gltf_round_normal(const float n[3], const float base[3], int out[3])
{
    double length = 1;
    int from[3] = {0};
    for (int k = 0; k < 3 && base; k++) {
        from[k] = round_unit((double)base[k]);
        double x = fabs((double)n[k]), room = NORMAL_MOST + (n[k] < 0 ? -from[k] : from[k]);
        if (NORMAL_MOST * x * length > room) length = room / (NORMAL_MOST * x);
    }
    bool nothing = true;
    for (int k = 0; k < 3; k++) {
        int x = round_unit(length * (double)n[k]);
        nothing = nothing && x == 0;
        out[k] = int_clamp(x - from[k], -NORMAL_MOST, NORMAL_MOST);
    }
    for (int k = 0; k < 3 && nothing; k++) out[k] = 0; /* turned right round: the base's own, until the next piece */
}
