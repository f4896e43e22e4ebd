/* distance.c: f as a distance again, in the band alone, without moving its zero (Russo and Smereka's subcell fix: beside
 * the surface the distance is f / |grad f|; farther away Godunov's scheme with second-order one-sided differences). */
#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>

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

static float minmod(float a, float b) { return a * b <= 0 ? 0 : fabsf(a) < fabsf(b) ? a : b; }

/* The square of the upwind slope of s f along an axis, per sample. */
static float upwind2(const float *p, int step, float s)
{
    float a = s * p[-2 * step], b = s * p[-step], c = s * p[0], d = s * p[step], e = s * p[2 * step];
    float bend = d - 2 * c + b;
    float down = c - b + 0.5f * minmod(bend, c - 2 * b + a);
    float up = d - c - 0.5f * minmod(bend, e - 2 * d + c);
    float from_below = down > 0 ? down : 0, from_above = up < 0 ? -up : 0;
    float m = from_below > from_above ? from_below : from_above;
    return m * m;
}

static void spread(void *ctx, int begin, int end)
{
    Band *b = ctx;
    float pad[PAD2 * PAD2 * PAD2];
    for (int i = begin; i < end; i++) {
        band_gather(b->value, b->near[i], 2, 0, pad);
        float *to = b->spare + (size_t)i * CELLS;
        for (int c = 0; c < CELLS; c++) {
            const float *p = pad + 2 + (c & 7) + PAD2 * (2 + (c >> 3 & 7)) + PAD2 * PAD2 * (2 + (c >> 6));
            if (is_near(p, PAD2, PAD2 * PAD2)) {
                to[c] = *p;
                continue;
            }
            float s = *p > 0 ? 1 : -1;
            float slope = sqrtf(upwind2(p, 1, s) + upwind2(p, PAD2, s) + upwind2(p, PAD2 * PAD2, s)) / DX;
            float d = s * *p - STEP * (slope - 1);
            to[c] = s * (d > 1 ? 1 : d < LEAST ? LEAST : d);
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
