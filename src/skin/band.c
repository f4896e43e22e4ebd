#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t key_of(const int at[3]) { return key_coord(at[0], at[1], at[2]); }

static int compare_place(const void *pa, const void *pb)
{
    const int *a = pa, *b = pb;
    for (int k = 2; k >= 0; k--)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

void band_around(const Band *b, const int at[3], int32_t near[27])
{
    for (int k = 0; k < 27; k++) {
        int to[3] = {at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1};
        near[k] = map_get(&b->where, key_of(to));
    }
}

static void find_near(void *ctx, int begin, int end)
{
    Band *b = ctx;
    for (int i = begin; i < end; i++) band_around(b, b->at[i], b->near[i]);
}

void band_init(Band *b, int n, int (*at)[3])
{
    *b = (Band){0};
    if (n) qsort(at, (size_t)n, sizeof *at, compare_place);
    map_init(&b->where, n);
    b->at = mem_alloc((size_t)n, sizeof *b->at);
    for (int i = 0; i < n; i++) {
        if (b->n && compare_place(b->at[b->n - 1], at[i]) == 0) continue;
        memcpy(b->at[b->n], at[i], sizeof at[i]);
        map_put(&b->where, key_of(at[i]), b->n++);
    }
    b->value = NEW(float, (size_t)b->n * CELLS);
    b->spare = NEW(float, (size_t)b->n * CELLS);
    b->extra = NEW(float, (size_t)b->n * CELLS);
    b->near = mem_alloc((size_t)b->n, sizeof *b->near);
    parallel_for(b->n, 64, find_near, b);
}

void band_free(Band *b)
{
    mem_free(b->at);
    mem_free(b->value);
    mem_free(b->spare);
    mem_free(b->extra);
    mem_free(b->near);
    map_free(&b->where);
    *b = (Band){0};
}

void band_copy(Band *to, const Band *from)
{
    band_init(to, from->n, from->at);
    memcpy(to->value, from->value, (size_t)from->n * CELLS * sizeof(float));
}

int band_before(const Band *b, const int at[3])
{
    int low = 0, high = b->n;
    while (low < high) {
        int mid = low + (high - low) / 2;
        if (compare_place(b->at[mid], at) < 0) low = mid + 1;
        else high = mid;
    }
    if (low == 0 || b->at[low - 1][1] != at[1] || b->at[low - 1][2] != at[2]) return NONE;
    return low - 1;
}

/* The last samples in x before a place say what lies between. */
float band_side(const Band *b, const int at[3])
{
    int i = band_before(b, at);
    return i != NONE && b->value[(size_t)i * CELLS + SIDE - 1] > 0 ? 1 : -1;
}

/* Of -halo ... 7 + halo: which third. */
static int third(int i) { return i < 0 ? 0 : i < SIDE ? 1 : 2; }

/* A row where bricks are missing: the nearest sample of the middle brick, `edge`, goes on. */
static void gather_torn_row(const float *const part[3], const float *edge, int halo, float fill, float *to)
{
    for (int x = -halo; x < SIDE + halo; x++) {
        const float *p = part[third(x)];
        *to++ = p ? p[x & 7] : edge ? edge[int_clamp(x, 0, SIDE - 1)] : fill;
    }
}

void band_gather(const float *column, const int32_t near[27], int halo, float fill, float *pad)
{
    const float *brick[27];
    for (int k = 0; k < 27; k++) brick[k] = near[k] == NONE ? NULL : column + (size_t)near[k] * CELLS;
    for (int z = -halo; z < SIDE + halo; z++)
        for (int y = -halo; y < SIDE + halo; y++) {
            const float *const *from = brick + 9 * third(z) + 3 * third(y);
            int row = ((z & 7) * SIDE + (y & 7)) * SIDE;
            const float *part[3];
            for (int k = 0; k < 3; k++) part[k] = from[k] ? from[k] + row : NULL;
            if (part[0] && part[1] && part[2]) {
                for (int h = 0; h < halo; h++) {
                    pad[h] = part[0][SIDE - halo + h];
                    pad[halo + SIDE + h] = part[2][h];
                }
                memcpy(pad + halo, part[1], SIDE * sizeof(float));
            } else {
                const float *edge = brick[13] ? brick[13] + (int_clamp(z, 0, 7) * SIDE + int_clamp(y, 0, 7)) * SIDE : NULL;
                gather_torn_row(part, edge, halo, fill, pad);
            }
            pad += SIDE + 2 * halo;
        }
}

/* --- which bricks there are ------------------------------------------------------------------------------------- */

/* Bit k: a sample with |f| < 1 faces neighbour k; bit 13: there is one at all. */
static int32_t demand_of(const float *value)
{
    int32_t mask = 0;
    for (int c = 0; c < CELLS; c++) {
        if (!(fabsf(value[c]) < 1)) continue;
        int x = c & 7, y = c >> 3 & 7, z = c >> 6;
        int dx = x == 0 ? 0 : x == 7 ? 2 : 1, dy = y == 0 ? 0 : y == 7 ? 2 : 1, dz = z == 0 ? 0 : z == 7 ? 2 : 1;
        /* a corner faces its edges' and faces' neighbours too */
        for (int k = 0; k < 8; k++) mask |= 1 << ((k & 1 ? dx : 1) + 3 * (k & 2 ? dy : 1) + 9 * (k & 4 ? dz : 1));
    }
    return mask;
}

typedef struct DemandJob {
    const Band *b;
    int32_t *mask;
} DemandJob;

static void find_demand(void *ctx, int begin, int end)
{
    DemandJob *job = ctx;
    for (int i = begin; i < end; i++) job->mask[i] = demand_of(job->b->value + (size_t)i * CELLS);
}

static void demanded_place(const Band *b, int i, int k, int to[3])
{
    const int step[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
    for (int a = 0; a < 3; a++) to[a] = b->at[i][a] + step[a];
}

/* To the bricks named, woken ones as the side they are on. */
static void rebuild(Band *b, int n, int (*at)[3])
{
    Band fresh;
    band_init(&fresh, n, at);
    for (int i = 0; i < fresh.n; i++) {
        float *value = fresh.value + (size_t)i * CELLS;
        int old = map_get(&b->where, key_of(fresh.at[i]));
        float side = old == NONE ? band_side(b, fresh.at[i]) : 0;
        if (old != NONE) memcpy(value, b->value + (size_t)old * CELLS, CELLS * sizeof(float));
        else
            for (int c = 0; c < CELLS; c++) value[c] = side;
    }
    band_free(b);
    *b = fresh;
}

void band_wake(Band *b, int n, int (*at)[3])
{
    int (*all)[3] = mem_alloc((size_t)(b->n + n), sizeof *all);
    memcpy(all, b->at, (size_t)b->n * sizeof *all);
    memcpy(all + b->n, at, (size_t)n * sizeof *all);
    rebuild(b, b->n + n, all);
    mem_free(all);
}

bool band_update(Band *b)
{
    int32_t *mask = NEW(int32_t, b->n);
    DemandJob job = {b, mask};
    parallel_for(b->n, 32, find_demand, &job);
    int n = 0, cap = 0;
    int (*at)[3] = NULL;
    bool changed = false;
    bool *wanted = NEW0(bool, b->n);
    for (int i = 0; i < b->n; i++)
        for (int k = 0; k < 27; k++) {
            if (!(mask[i] >> k & 1)) continue;
            if (b->near[i][k] != NONE) {
                wanted[b->near[i][k]] = true;
                continue;
            }
            changed = true;
            RESERVE(at, cap, n + 1);
            demanded_place(b, i, k, at[n++]);
        }
    for (int i = 0; i < b->n; i++) {
        if (!wanted[i]) {
            changed = true;
            continue;
        }
        RESERVE(at, cap, n + 1);
        memcpy(at[n++], b->at[i], sizeof *at);
    }
    if (changed) rebuild(b, n, at);
    mem_free(at);
    mem_free(wanted);
    mem_free(mask);
    return changed;
}
