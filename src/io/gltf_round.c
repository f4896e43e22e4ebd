/* gltf_round.c: positions and normals as small whole numbers, for KHR_mesh_quantization.
 *
 * The step is a power of two and the grid's origin a multiple of it: what a player computes from the whole numbers, the
 * node's scale and its translation is exact in 32-bit floats, and grids of one step agree wherever they overlap. */
#include "io/gltf_priv.h"

#include <math.h>

enum { NORMAL_MOST = 127, FLOAT_BITS = 24 };
#define SHORTEST_NORMAL 0.125 /* of 16 steps: its direction is within 3 degrees */

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
    int by_side = GLTF_EXPONENT_LEAST, by_place = GLTF_EXPONENT_LEAST;
    if (side > 0) frexp(side / (GLTF_I16_MOST - 1), &by_side); /* 2^by_side is larger */
    if (far > 0) frexp(far, &by_place);
    by_place -= FLOAT_BITS - 1; /* no finer than floats are there */
    grid.exponent = int_max(GLTF_EXPONENT_LEAST, int_max(by_side, by_place));
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

/* What the normal may be shortened to, so that the difference of whole numbers fits. */
static double room_for(const float n[3], const int from[3])
{
    double length = 1;
    for (int k = 0; k < 3; k++) {
        double x = NORMAL_MOST * fabs((double)n[k]), room = NORMAL_MOST + (n[k] < 0 ? -from[k] : from[k]);
        if (length * x > room) length = room / x;
    }
    return length;
}

/* A target's normal is the base's and a difference of at most 1 an axis. Where it has turned too far for that, a shorter one keeps
 * its direction; where that would be too short, by a right angle and more, the nearest one that can be reached stands for it. */
void gltf_round_normal(const float n[3], const float base[3], int out[3])
{
    int from[3] = {0};
    bool nothing = true;
    for (int k = 0; k < 3 && base; k++) from[k] = round_unit((double)base[k]);
    double length = base ? room_for(n, from) : 1;
    if (length < SHORTEST_NORMAL) length = 1;
    for (int k = 0; k < 3; k++) {
        out[k] = int_clamp(round_unit(length * (double)n[k]) - from[k], -NORMAL_MOST, NORMAL_MOST);
        nothing = nothing && out[k] == -from[k];
    }
    for (int k = 0; k < 3 && nothing; k++) out[k] = 0; /* right round: the base's own */
}
