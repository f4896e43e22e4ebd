/* distance.c: f as a distance again, in the band alone, without moving its zero (Russo and Smereka's subcell fix: beside
 * the surface the distance is f / |grad f|; farther away Godunov's scheme with second-order one-sided differences). */
#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>
#include <string.h>

#define STEP (0.45f * DX)
#define LEAST 1e-6f  /* a sample stays on its side */
#define REFORM 0.25f /* of a slope's error that a pass takes away beside the surface: the rest is the next substep's, and what the zero moves by
                        stays below what the target takes back */

static float slope_along(const float *p, int step)
{
    float up = p[step] - p[0], down = p[0] - p[-step];
    if (up * down > 0) return 0.5f * (up + down);
    return fabsf(up) > fabsf(down) ? up : down;
}

float near_slope(const float *p, int py, int pz)
{
    float x = slope_along(p, 1), y = slope_along(p, py), z = slope_along(p, pz);
    return sqrtf(x * x + y * y + z * z) / DX;
}

/* 0 away from the surface. */
static void find_slopes(void *ctx, int begin, int end)
{
    Band *b = ctx;
    float pad[PAD1 * PAD1 * PAD1];
    for (int i = begin; i < end; i++) {
        band_gather(b->value, b->near[i], 1, 0, pad);
        float *to = b->extra + (size_t)i * CELLS;
        for (int c = 0; c < CELLS; c++) {
            const float *p = pad + 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
            to[c] = is_near(p, PAD1, PAD1 * PAD1) ? near_slope(p, PAD1, PAD1 * PAD1) : 0;
        }
    }
}

/* f over the mean slope of its crossed edges: two ends with one slope keep the zero between them. */
static float rescaled(const float *p, const float *slope)
{
    static const int STEPS[6] = {-1, 1, -PAD1, PAD1, -PAD1 * PAD1, PAD1 * PAD1};
    float sum = 0;
    int n = 0;
    for (int k = 0; k < 6; k++) {
        if (!is_crossed(p[0], p[STEPS[k]])) continue;
        sum += 0.5f * (slope[0] + slope[STEPS[k]]);
        n++;
    }
    float d = n ? p[0] * (1 + REFORM * ((float)n / sum - 1)) : p[0];
    if (p[0] > 0) return d > 1 ? 1 : d < LEAST ? LEAST : d;
    return d < -1 ? -1 : d;
}

static void rescale(void *ctx, int begin, int end)
{
    Band *b = ctx;
    float pad[PAD1 * PAD1 * PAD1], slope[PAD1 * PAD1 * PAD1];
    for (int i = begin; i < end; i++) {
        band_gather(b->value, b->near[i], 1, 0, pad);
        band_gather(b->extra, b->near[i], 1, 0, slope);
        float *to = b->spare + (size_t)i * CELLS;
        for (int c = 0; c < CELLS; c++) {
            int at = 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
            to[c] = rescaled(pad + at, slope + at);
        }
    }
}

/* Without branches, so that rows become vectors. */
static inline float positive(float x) { return 0.5f * (x + fabsf(x)); }
static inline float minmod(float a, float b) { return copysignf(positive(0.5f * (fabsf(a + b) - fabsf(a - b))), a); }
static inline float larger(float a, float b) { return 0.5f * (a + b + fabsf(a - b)); }

/* Adds the square of the upwind slope of s f along an axis, a row of samples at once. */
static void add_upwind(const float *restrict p, int step, const float *restrict s, float *restrict sum)
{
    for (int x = 0; x < SIDE; x++) {
        float a = s[x] * p[x - 2 * step], b = s[x] * p[x - step], c = s[x] * p[x], d = s[x] * p[x + step], e = s[x] * p[x + 2 * step];
        float bend = d - 2 * c + b;
        float down = c - b + 0.5f * minmod(bend, c - 2 * b + a);
        float up = d - c - 0.5f * minmod(bend, e - 2 * d + c);
        float m = larger(positive(down), positive(-up));
        sum[x] += m * m;
    }
}

/* All of a row and of the four beside it at 1, or all at -1: nothing moves there. */
static bool is_flat(const float *p)
{
    static const int ROWS[5] = {0, -PAD2, PAD2, -PAD2 * PAD2, PAD2 * PAD2};
    const float first = p[0];
    bool flat = first == 1 || first == -1;
    for (int r = 0; r < 5 && flat; r++)
        for (int x = -1; x <= SIDE; x++) flat &= p[ROWS[r] + x] == first;
    return flat;
}

static void spread_row(const float *p, float *to)
{
    float s[SIDE], slope[SIDE] = {0};
    for (int x = 0; x < SIDE; x++) s[x] = p[x] > 0 ? 1 : -1;
    add_upwind(p, 1, s, slope);
    add_upwind(p, PAD2, s, slope);
    add_upwind(p, PAD2 * PAD2, s, slope);
    for (int x = 0; x < SIDE; x++) {
        float d = s[x] * p[x] - STEP * (sqrtf(slope[x]) / DX - 1);
        to[x] = is_near(p + x, PAD2, PAD2 * PAD2) ? p[x] : s[x] * (d > 1 ? 1 : d < LEAST ? LEAST : d);
    }
}

static void spread(void *ctx, int begin, int end)
{
    Band *b = ctx;
    float pad[PAD2 * PAD2 * PAD2];
    for (int i = begin; i < end; i++) {
        band_gather(b->value, b->near[i], 2, 0, pad);
        float *to = b->spare + (size_t)i * CELLS;
        for (int row = 0; row < SIDE * SIDE; row++, to += SIDE) {
            const float *p = pad + 2 + PAD2 * (2 + (row & 7)) + PAD2 * PAD2 * (2 + (row >> 3));
            if (is_flat(p)) memcpy(to, p, SIDE * sizeof(float));
            else spread_row(p, to);
        }
    }
}

static void swap_columns(Band *b)
{
    float *t = b->value;
    b->value = b->spare;
    b->spare = t;
}

void band_spread(Band *b, int passes)
{
    for (int k = 0; k < passes; k++) {
        parallel_for(b->n, 8, spread, b);
        swap_columns(b);
    }
}

void band_redistance(Band *b, int passes)
{
    parallel_for(b->n, 8, find_slopes, b);
    parallel_for(b->n, 8, rescale, b);
    swap_columns(b);
    band_spread(b, passes);
}
