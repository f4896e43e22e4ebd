/* birth.c: eq. 3 moves a surface that is there; it never finds a droplet that flew off between two frames, nor a bubble.
 * So what the target has and the skin touches nowhere is given a seed, which then grows as any skin does. */
#include "skin/skin_priv.h"

#include "base/sets.h"

#include <math.h>

#define SEED_LEAST (0.6f * DX) /* radii: a lone sample inside ... */
#define SEED_MOST (1.5f * DX)  /* ... and what every later pass can see */
enum { SEED_SPREADS = 6 };

/* The parts of the target on one side. Members: its samples, then for each brick what is missing to its right in its
 * row, then what is missing beyond all rows' ends. */
typedef struct Parts {
    const Band *target;
    float side;         /* 1 or -1 */
    int32_t *up;        /* [512 n + n + 1] disjoint sets */
    uint8_t *touched;   /* by root */
} Parts;

static int run_right_of(const Parts *p, int brick)
{
    const Band *t = p->target;
    bool ends = brick + 1 == t->n || t->at[brick + 1][1] != t->at[brick][1] || t->at[brick + 1][2] != t->at[brick][2];
    return t->n * CELLS + (ends ? t->n : brick);
}

/* The member that a missing brick belongs to. */
static int run_at(const Parts *p, const int at[3])
{
    int before = band_before(p->target, at);
    return before == NONE ? p->target->n * (CELLS + 1) : run_right_of(p, before);
}

static bool is_on(const Parts *p, int member) { return (p->target->value[member] > 0) == (p->side > 0); }

/* Sample c of brick i with the one after it along an axis, or with what is missing there. */
static void join_after(Parts *p, int i, int c, int axis)
{
    const Band *t = p->target;
    int shift = 3 * axis, step = 1 << shift, m = i * CELLS + c;
    if ((c >> shift & 7) < 7) {
        if (is_on(p, m + step)) set_join(p->up, m, m + step);
        return;
    }
    int to = t->near[i][13 + (axis == 0 ? 1 : axis == 1 ? 3 : 9)];
    int at[3] = {t->at[i][0], t->at[i][1], t->at[i][2]};
    at[axis]++;
    if (to == NONE) set_join(p->up, m, run_at(p, at));
    else if (is_on(p, to * CELLS + c - 7 * step)) set_join(p->up, m, to * CELLS + c - 7 * step);
}

/* With what is missing before it. */
static void join_before(Parts *p, int i, int c, int axis)
{
    const Band *t = p->target;
    if ((c >> 3 * axis & 7) > 0 || t->near[i][13 - (axis == 0 ? 1 : axis == 1 ? 3 : 9)] != NONE) return;
    int at[3] = {t->at[i][0], t->at[i][1], t->at[i][2]};
    at[axis]--;
    set_join(p->up, i * CELLS + c, run_at(p, at));
}

static void find_parts(Parts *p)
{
    int n = p->target->n, members = n * (CELLS + 1) + 1;
    p->up = NEW(int32_t, members);
    p->touched = NEW0(uint8_t, members);
    for (int m = 0; m < members; m++) p->up[m] = m;
    for (int i = 0; i < n; i++)
        for (int c = 0; c < CELLS; c++)
            for (int axis = 0; is_on(p, i * CELLS + c) && axis < 3; axis++) {
                join_after(p, i, c, axis);
                join_before(p, i, c, axis);
            }
}

/* Marks the parts that hold something of the skin's same side. */
static void touch_parts(Parts *p, const Band *b)
{
    const Band *t = p->target;
    for (int i = 0; i < t->n; i++) {
        int own = map_get(&b->where, key_coord(t->at[i][0], t->at[i][1], t->at[i][2]));
        bool side = own == NONE && band_side(b, t->at[i]) == p->side;
        for (int c = 0; c < CELLS; c++) {
            bool same = own == NONE ? side : (b->value[(size_t)own * CELLS + (size_t)c] > 0) == (p->side > 0);
            if (same && is_on(p, i * CELLS + c)) p->touched[set_root(p->up, i * CELLS + c)] = 1;
        }
    }
    for (int i = 0; i < b->n; i++) { /* bricks of the skin where the target has none */
        if (map_get(&t->where, key_coord(b->at[i][0], b->at[i][1], b->at[i][2])) != NONE) continue;
        bool any = false;
        for (int c = 0; c < CELLS && !any; c++) any = (b->value[(size_t)i * CELLS + (size_t)c] > 0) == (p->side > 0);
        if (any && band_side(t, b->at[i]) == p->side) p->touched[set_root(p->up, run_at(p, b->at[i]))] = 1;
    }
    p->touched[set_root(p->up, t->n * (CELLS + 1))] |= p->side < 0; /* without end, as the skin's outside is */
}

/* --- seeds -------------------------------------------------------------------------------------------------------- */

typedef struct Seed {
    int at[3];    /* sample */
    float radius;
} Seed;

typedef struct Seeds {
    int n, cap;
    Seed *seed;
} Seeds;

/* The deepest sample, of equals the first, of each part that is not touched and reaches as deep as `least`. */
static void add_seeds(Seeds *s, Parts *p, float least)
{
    const Band *t = p->target;
    int32_t *best = NEW(int32_t, t->n * (CELLS + 1) + 1);
    for (int m = 0; m < t->n * (CELLS + 1) + 1; m++) best[m] = NONE;
    for (int m = 0; m < t->n * CELLS; m++) {
        if (!is_on(p, m)) continue;
        int root = set_root(p->up, m);
        if (!p->touched[root] && (best[root] == NONE || fabsf(t->value[m]) > fabsf(t->value[best[root]]))) best[root] = m;
    }
    for (int r = 0; r < t->n * CELLS; r++) {
        int m = best[r];
        if (m == NONE) continue;
        const int *at = t->at[m / CELLS];
        float depth = fabsf(t->value[m]);
        if (depth < least) continue;
        RESERVE(s->seed, s->cap, s->n + 1);
        s->seed[s->n++] = (Seed){{at[0] * SIDE + (m & 7), at[1] * SIDE + (m >> 3 & 7), at[2] * SIDE + (m >> 6 & 7)},
                                 depth < SEED_LEAST ? SEED_LEAST : depth > SEED_MOST ? SEED_MOST : depth};
    }
    mem_free(best);
}

enum { SEED_REACH = SKIN_BAND_VOXELS + 2 };

static void wake_seeds(const Seeds *s, Band *b)
{
    int (*at)[3] = mem_alloc(27 * (size_t)s->n, sizeof *at);
    for (int i = 0; i < s->n; i++)
        for (int k = 0; k < 27; k++) {
            const int step[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
            for (int a = 0; a < 3; a++) at[27 * i + k][a] = (s->seed[i].at[a] + step[a] * SEED_REACH) >> 3;
        }
    band_wake(b, 27 * s->n, at);
    mem_free(at);
}

/* A ball of the side. */
static void plant(const Seed *s, float side, Band *b)
{
    for (int z = -SEED_REACH; z <= SEED_REACH; z++)
        for (int y = -SEED_REACH; y <= SEED_REACH; y++)
            for (int x = -SEED_REACH; x <= SEED_REACH; x++) {
                const int at[3] = {s->at[0] + x, s->at[1] + y, s->at[2] + z};
                int i = map_get(&b->where, key_coord(at[0] >> 3, at[1] >> 3, at[2] >> 3));
                ASSERT(i != NONE);
                float *f = &b->value[(size_t)i * CELLS + (size_t)((at[2] & 7) * 64 + (at[1] & 7) * 8 + (at[0] & 7))];
                float in = s->radius - DX * sqrtf((float)(x * x + y * y + z * z));
                if (in > side * *f) *f = side * in;
            }
}

static int seed_side(Band *b, const Band *target, float side, float least)
{
    Parts p = {.target = target, .side = side};
    Seeds s = {0};
    find_parts(&p);
    touch_parts(&p, b);
    add_seeds(&s, &p, least);
    if (s.n) wake_seeds(&s, b);
    for (int i = 0; i < s.n; i++) plant(&s.seed[i], side, b);
    mem_free(p.up);
    mem_free(p.touched);
    mem_free(s.seed);
    return s.n;
}

int band_seed(Band *b, const Band *target, float least)
{
    int n = seed_side(b, target, 1, least) + seed_side(b, target, -1, least);
    if (n) {
        band_spread(b, SEED_SPREADS);
        band_update(b);
    }
    return n;
}
