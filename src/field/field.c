/* field.c: building the bricks, and reading single values from them. */
#include "field/field_priv.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIELD_BRICKS_MAX = 1 << 20 }; /* 5 GiB of samples: beyond it the frame is refused */

/* --- which side a sample is on, and how far away the farthest is ------------------------------------------- */

typedef struct Builder {
    Field *f;
    const Grid *grid;
    Map seen;              /* bricks looked at, by origin >> 3 */
    int ncand, capcand;
    int (*cand)[3];        /* their origins */
    uint8_t *kind;         /* [grid->nblock] what the grid's blocks hold */
    bool may_wait;         /* the grid may go with the field */
} Builder;

enum { BLOCK_OUTSIDE, BLOCK_INSIDE, BLOCK_MIXED };

/* The isovalue is a float32 too. */
static bool is_inside(const Field *f, float v) { return f->sign > 0 ? v > (float)f->iso : v < (float)f->iso; }

/* Samples of the box [lo, lo + side) within the active bounding box. */
static double overlap(const Field *f, const int lo[3], int side)
{
    double n = 1;
    for (int a = 0; a < 3; a++) {
        int from = int_max(lo[a], f->lo[a]), to = int_min(lo[a] + side - 1, f->hi[a]);
        if (from > to) return 0;
        n *= to - from + 1;
    }
    return n;
}

static void reach_out(double *far, const Field *f, float v) { *far = real_max(*far, fabs((double)v - f->iso)); }

/* The least and the greatest of a block's values; false where one is no finite number. Eight at a time, as registers hold them. */
static bool find_range(const float *v, float *least, float *most)
{
    float lo[8], hi[8];
    int strange = 0;
    memcpy(lo, v, sizeof lo);
    memcpy(hi, v, sizeof hi);
    for (int c = 0; c < GRID_CELLS; c += 8)
        for (int k = 0; k < 8; k++) {
            float x = v[c + k];
            lo[k] = x < lo[k] ? x : lo[k];
            hi[k] = x > hi[k] ? x : hi[k];
            strange |= !(fabsf(x) <= FLT_MAX);
        }
    *least = lo[0], *most = hi[0];
    for (int k = 1; k < 8; k++) *least = lo[k] < *least ? lo[k] : *least, *most = hi[k] > *most ? hi[k] : *most;
    return !strange;
}

/* Refuses what is no number; far becomes the largest |F| within the bounding box. */
static bool survey(Field *f, const Grid *g, Err *err)
{
    double covered = 0, all = 1, far = 0;
    for (int a = 0; a < 3; a++) all *= (double)f->hi[a] - f->lo[a] + 1;
    for (int b = 0; b < g->nblock; b++) {
        const int *o = g->origin[b];
        const float *v = g->value + (size_t)b * GRID_CELLS;
        float least, most;
        double n = overlap(f, o, GRID_SIDE);
        covered += n;
        if (n == GRID_CELLS && find_range(v, &least, &most)) {
            reach_out(&far, f, least);
            reach_out(&far, f, most);
            continue;
        }
        for (int c = 0; c < GRID_CELLS; c++) {
            int x = o[0] + (c & 7), y = o[1] + (c >> 3 & 7), z = o[2] + (c >> 6);
            if (!field_in_box(f, x, y, z)) continue;
            if (!isfinite(v[c]))
                return fail(err, ERR_INPUT, "the grid holds a value that is no finite number at sample (%d, %d, %d); repair the cache or leave the frame out", x, y, z);
            reach_out(&far, f, v[c]);
        }
    }
    for (int t = 0; t < g->ntile; t++) {
        double n = overlap(f, g->tile[t].lo, 1 << g->tile[t].log2side);
        if (n == 0) continue;
        if (!isfinite(g->tile[t].value[0])) return fail(err, ERR_INPUT, "the grid holds a tile whose value is no finite number; repair the cache or leave the frame out");
        covered += n;
        reach_out(&far, f, g->tile[t].value[0]);
    }
    if (covered < all) {
        if (!isfinite(g->background[0])) return fail(err, ERR_INPUT, "the grid's background value is no finite number; repair the cache or leave the frame out");
        reach_out(&far, f, g->background[0]);
    }
    f->far = far > 0 ? far : 1;
    return true;
}

/* --- bricks that may hold crossed cells -------------------------------------------------------------------- */

static void add_candidate(Builder *b, int x, int y, int z)
{
    if (map_put(&b->seen, key_coord(x >> 3, y >> 3, z >> 3), b->ncand) != b->ncand) return;
    RESERVE(b->cand, b->capcand, b->ncand + 1);
    b->cand[b->ncand][0] = x;
    b->cand[b->ncand][1] = y;
    b->cand[b->ncand][2] = z;
    b->ncand++;
}

/* A crossed cell has an inside corner, so its brick is the corner's or one below it along some axes. */
static void add_below(Builder *b, int x, int y, int z)
{
    for (int k = 0; k < 8; k++) add_candidate(b, x - 8 * (k & 1), y - 8 * (k >> 1 & 1), z - 8 * (k >> 2));
}

static bool too_many_bricks(Err *err)
{
    return fail(err, ERR_RESOURCE, "the surface needs more than %d bricks of 8^3 samples; crop or coarsen the grid", FIELD_BRICKS_MAX);
}

/* A constant inside cube is crossed at its skin alone: the shell of bricks of the box lo..hi (brick origins). */
static bool add_shell(Builder *b, const int lo[3], const int hi[3], Err *err)
{
    double nx = (hi[0] - lo[0]) / 8 + 1, ny = (hi[1] - lo[1]) / 8 + 1, nz = (hi[2] - lo[2]) / 8 + 1;
    if (2 * (nx * ny + ny * nz + nz * nx) > FIELD_BRICKS_MAX) return too_many_bricks(err);
    for (int z = lo[2]; z <= hi[2]; z += 8)
        for (int y = lo[1]; y <= hi[1]; y += 8) {
            bool skin = z == lo[2] || z == hi[2] || y == lo[1] || y == hi[1];
            int step = skin ? 8 : int_max(8, hi[0] - lo[0]);
            for (int x = lo[0]; x <= hi[0]; x += step) add_below(b, x, y, z);
        }
    return true;
}

/* The brick origins of the part of a cube that lies within the bounding box. False when none does. */
static bool clip(const Field *f, const int at[3], int side, int lo[3], int hi[3])
{
    for (int a = 0; a < 3; a++) {
        lo[a] = int_max(at[a], f->lo[a]) & ~7;
        hi[a] = int_min(at[a] + side - 1, f->hi[a]) & ~7;
        if (lo[a] > hi[a]) return false;
    }
    return true;
}

static uint8_t kind_of_block(const Field *f, const float *v)
{
    int inside = 0;
    for (int c = 0; c < GRID_CELLS; c++) inside += is_inside(f, v[c]);
    return inside == 0 ? BLOCK_OUTSIDE : inside == GRID_CELLS ? BLOCK_INSIDE : BLOCK_MIXED;
}

static bool find_candidates(Builder *b, Err *err)
{
    const Field *f = b->f;
    const Grid *g = b->grid;
    int lo[3], hi[3];
    for (int k = 0; k < g->nblock; k++) {
        b->kind[k] = kind_of_block(f, g->value + (size_t)k * GRID_CELLS);
        if (b->kind[k] != BLOCK_OUTSIDE) add_below(b, g->origin[k][0], g->origin[k][1], g->origin[k][2]);
    }
    for (int t = 0; t < g->ntile; t++)
        if (is_inside(f, g->tile[t].value[0]) && clip(f, g->tile[t].lo, 1 << g->tile[t].log2side, lo, hi) && !add_shell(b, lo, hi, err)) return false;
    if (!is_inside(f, g->background[0])) return true;
    /* an inside background: every brick beside a block or at the box's skin may be crossed */
    for (int k = 0; k < g->nblock; k++)
        for (int n = 0; n < 27; n++) add_candidate(b, g->origin[k][0] + 8 * (n % 3 - 1), g->origin[k][1] + 8 * (n / 3 % 3 - 1), g->origin[k][2] + 8 * (n / 9 - 1));
    for (int a = 0; a < 3; a++) {
        lo[a] = f->lo[a] & ~7;
        hi[a] = f->hi[a] & ~7;
    }
    return add_shell(b, lo, hi, err);
}

/* --- which of them do -------------------------------------------------------------------------------------- */

/* Crossed: corners of both kinds among the samples origin ... origin+8. */
static bool brick_is_crossed(const Field *f, const float *v)
{
    int inside = 0;
    for (int z = 1; z < 10; z++)
        for (int y = 1; y < 10; y++)
            for (int x = 1; x < 10; x++) inside += is_inside(f, v[x + BRICK_SPAN * (y + BRICK_SPAN * z)]);
    return inside > 0 && inside < 9 * 9 * 9;
}

/* What the samples of a block are that lie at 0 along the axes of `rim` (a bit each). */
static int kind_of_rim(const Builder *b, int x, int y, int z, int rim)
{
    const float *v = grid_block(b->grid, x, y, z);
    if (!v) return is_inside(b->f, grid_at(b->grid, x, y, z, 0)) ? BLOCK_INSIDE : BLOCK_OUTSIDE;
    int kind = b->kind[(v - b->grid->value) / GRID_CELLS], inside = 0, nx = rim & 1 ? 1 : 8, ny = rim & 2 ? 1 : 8, nz = rim & 4 ? 1 : 8;
    if (kind != BLOCK_MIXED || rim == 0) return kind;
    for (int k = 0; k < nz; k++)
        for (int j = 0; j < ny; j++)
            for (int i = 0; i < nx; i++) inside += is_inside(b->f, v[64 * k + 8 * j + i]);
    return inside == 0 ? BLOCK_OUTSIDE : inside == nx * ny * nz ? BLOCK_INSIDE : BLOCK_MIXED;
}

/* Its samples origin ... origin+8 lie in eight blocks: all of its own, and a rim each of those above. */
static bool candidate_is_crossed(const Builder *b, const int o[3])
{
    float v[BRICK_SAMPLES];
    if (field_in_box(b->f, o[0], o[1], o[2]) && field_in_box(b->f, o[0] + 8, o[1] + 8, o[2] + 8)) {
        int kind = kind_of_rim(b, o[0], o[1], o[2], 0);
        for (int rim = 1; rim < 8; rim++)
            if (kind == BLOCK_MIXED || kind_of_rim(b, o[0] + 8 * (rim & 1), o[1] + 8 * (rim >> 1 & 1), o[2] + 8 * (rim >> 2), rim) != kind) return true;
        return kind == BLOCK_MIXED;
    }
    brick_gather(b->f, b->grid, o, v);
    return brick_is_crossed(b->f, v);
}

/* What is cut above a crossed brick is a crossed brick's, too, also where blocks lie within tiles, as in no sound grid. */
static void follow_up(Builder *b)
{
    map_clear(&b->seen);
    for (int c = 0; c < b->ncand; c++) map_put(&b->seen, key_coord(b->cand[c][0] >> 3, b->cand[c][1] >> 3, b->cand[c][2] >> 3), c);
    for (int c = 0; c < b->ncand && b->ncand <= FIELD_BRICKS_MAX; c++)
        for (int k = 1; k < 8; k++) {
            int o[3] = {b->cand[c][0] + 8 * (k & 1), b->cand[c][1] + 8 * (k >> 1 & 1), b->cand[c][2] + 8 * (k >> 2)};
            int32_t known = b->seen.count;
            map_put(&b->seen, key_coord(o[0] >> 3, o[1] >> 3, o[2] >> 3), 0);
            if (b->seen.count == known || !candidate_is_crossed(b, o)) continue;
            RESERVE(b->cand, b->capcand, b->ncand + 1);
            memcpy(b->cand[b->ncand++], o, sizeof o);
        }
}

static int compare_origin(const void *pa, const void *pb)
{
    const int *a = pa, *b = pb;
    for (int k = 2; k >= 0; k--)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* A block gives 8 candidates at most, the shell of a tile of 128 samples' side some 2000: what is far beyond, no sound grid has. */
static bool is_out_of_proportion(const Builder *b)
{
    return b->ncand > 32768 + 8 * (int64_t)b->grid->nblock + 2048 * (int64_t)b->grid->ntile;
}

static bool keep_crossed(Builder *b, Err *err)
{
    if (is_out_of_proportion(b))
        return fail(err, ERR_INPUT, "constant tiles of the grid are so large that only a damaged file has them; write it again, or resample it");
    int n = 0;
    for (int c = 0; c < b->ncand; c++) {
        if (!candidate_is_crossed(b, b->cand[c])) continue;
        memmove(b->cand[n++], b->cand[c], sizeof b->cand[0]);
    }
    b->ncand = n;
    follow_up(b);
    if (b->ncand > FIELD_BRICKS_MAX) return too_many_bricks(err);
    if (b->ncand) qsort(b->cand, (size_t)b->ncand, sizeof b->cand[0], compare_origin);
    return true;
}

/* The crossed bricks are candidates 0 ... ncrossed-1; a ring of neighbours comes behind them. */
static void add_ring(Builder *b)
{
    int n = b->ncand;
    map_clear(&b->seen);
    for (int c = 0; c < n; c++) map_put(&b->seen, key_coord(b->cand[c][0] >> 3, b->cand[c][1] >> 3, b->cand[c][2] >> 3), c);
    for (int c = 0; c < n; c++)
        for (int k = 0; k < 27; k++)
            add_candidate(b, b->cand[c][0] + 8 * (k % 3 - 1), b->cand[c][1] + 8 * (k / 3 % 3 - 1), b->cand[c][2] + 8 * (k / 9 - 1));
    if (n) qsort(b->cand + n, (size_t)(b->ncand - n), sizeof b->cand[0], compare_origin);
}

/* A look-up in a box costs a third of one in a hash; it may take a quarter of what the bricks take. */
static void build_room(Field *f)
{
    int hi[3];
    double cells = 1;
    for (int a = 0; a < 3; a++) {
        f->room_lo[a] = hi[a] = f->origin[0][a] >> 3;
        for (int b = 1; b < f->nbrick; b++) {
            f->room_lo[a] = int_min(f->room_lo[a], f->origin[b][a] >> 3);
            hi[a] = int_max(hi[a], f->origin[b][a] >> 3);
        }
        f->room_n[a] = hi[a] - f->room_lo[a] + 1;
        cells *= f->room_n[a];
    }
    if (cells > 0.25 * BRICK_SAMPLES * f->nbrick) return;
    f->room = NEW(int32_t, cells);
    memset(f->room, 0xff, (size_t)cells * sizeof *f->room);
    for (int b = 0; b < f->nbrick; b++) {
        const int *o = f->origin[b];
        f->room[((o[2] >> 3) - f->room_lo[2]) * f->room_n[1] * f->room_n[0] + ((o[1] >> 3) - f->room_lo[1]) * f->room_n[0] + (o[0] >> 3) - f->room_lo[0]] = b;
    }
}

static bool build_bricks(Builder *b, Err *err)
{
    Field *f = b->f;
    if (!find_candidates(b, err) || !keep_crossed(b, err)) return false;
    f->ncrossed = b->ncand;
    add_ring(b);
    if (b->ncand > FIELD_BRICKS_MAX) return too_many_bricks(err); /* later stages number samples in 32 bits */
    f->nbrick = b->ncand;
    f->origin = mem_alloc((size_t)f->nbrick, sizeof *f->origin);
    bricks_take_room(f);
    map_init(&f->brick_at, f->nbrick);
    for (int k = 0; k < f->nbrick; k++) {
        memcpy(f->origin[k], b->cand[k], sizeof b->cand[k]);
        map_put(&f->brick_at, key_coord(b->cand[k][0] >> 3, b->cand[k][1] >> 3, b->cand[k][2] >> 3), k);
    }
    int waiting = f->nbrick - f->ncrossed;
    if (b->may_wait && (int64_t)b->grid->nblock * GRID_CELLS < (int64_t)waiting * BRICK_SAMPLES) f->gathered = NEW0(uint8_t, waiting);
    for (int k = 0; k < (f->gathered ? f->ncrossed : f->nbrick); k++) brick_gather(f, b->grid, f->origin[k], brick_samples(f, k));
    if (f->nbrick) build_room(f);
    return true;
}

static bool build(Field *f, const Grid *grid, bool may_wait, const FieldSpec *spec, Err *err)
{
    ASSERT(grid->ncomp == 1);
    *f = (Field){.xform = grid->xform, .sign = spec->inside_below ? -1 : 1, .iso = (double)(float)spec->iso, .far = 1};
    memcpy(f->lo, grid->lo, sizeof f->lo);
    memcpy(f->hi, grid->hi, sizeof f->hi);
    double det = affine_det(&f->xform);
    f->voxel = cbrt(fabs(det));
    f->mirrored = det < 0;
    if (grid_is_empty(grid)) return true;
    Builder b = {.f = f, .grid = grid, .kind = NEW(uint8_t, grid->nblock), .may_wait = may_wait};
    map_init(&b.seen, 4 * grid->nblock);
    bool ok = survey(f, grid, err) && build_bricks(&b, err);
    map_free(&b.seen);
    mem_free(b.cand);
    mem_free(b.kind);
    if (!ok) field_free(f);
    return ok;
}

bool field_build(Field *f, const Grid *grid, const FieldSpec *spec, Err *err) { return build(f, grid, false, spec, err); }

bool field_take(Field *f, Grid *grid, const FieldSpec *spec, Err *err)
{
    if (!build(f, grid, true, spec, err)) return false;
    if (!f->gathered) return true;
    f->source = *grid;
    *grid = (Grid){0};
    return true;
}

void field_free(Field *f)
{
    mem_free(f->origin);
    mem_free(f->gathered);
    grid_free(&f->source);
    bricks_leave_room(f);
    map_free(&f->brick_at);
    mem_free(f->room);
    *f = (Field){0};
}

static bool is_same_affine(const Affine *a, const Affine *b) { return memcmp(a, b, sizeof *a) == 0; }

static bool have_same_samples(const Field *a, const Field *b, int begin, int end)
{
    return begin == end || memcmp(brick_samples(a, begin), brick_samples(b, begin), (size_t)(end - begin) * BRICK_SAMPLES * sizeof(float)) == 0;
}

static void gather_all(const Field *f)
{
    for (int b = f->ncrossed; b < f->nbrick && f->gathered; b++) brick_ask(f, b);
}

bool field_is_same(const Field *a, const Field *b)
{
    if (a->exact.sample || b->exact.sample) return false;
    if (a->nbrick != b->nbrick || a->ncrossed != b->ncrossed || a->sign != b->sign || a->iso != b->iso || a->far != b->far) return false;
    if (!is_same_affine(&a->xform, &b->xform) || memcmp(a->lo, b->lo, sizeof a->lo) || memcmp(a->hi, b->hi, sizeof a->hi)) return false;
    if (a->value == b->value) return true; /* lent, or no bricks at all */
    if (memcmp(a->origin, b->origin, (size_t)a->nbrick * sizeof *a->origin) || !have_same_samples(a, b, 0, a->ncrossed)) return false;
    gather_all(a);
    gather_all(b);
    return have_same_samples(a, b, a->ncrossed, a->nbrick);
}

/* --- single values ------------------------------------------------------------------------------------------ */

void field_cell(const Field *f, int b, int x, int y, int z, double F[8])
{
    const int *o = f->origin[b];
    const float *v = f->value + (size_t)b * BRICK_SAMPLES + (x - o[0] + 1) + BRICK_SPAN * ((y - o[1] + 1) + BRICK_SPAN * (z - o[2] + 1));
    for (int c = 0; c < 8; c++) F[c] = f->sign * ((double)v[(c & 1) + BRICK_SPAN * (c >> 1 & 1) + BRICK_SPAN * BRICK_SPAN * (c >> 2)] - f->iso);
}

double field_value(const Field *f, Vec3 p, Vec3 *cell_grad, bool *known)
{
    Spot s;
    bool found = field_locate(f, p, &s);
    if (known) *known = found;
    if (!found) {
        if (cell_grad) *cell_grad = vec3(0, 0, 0);
        return -f->far;
    }
    if (cell_grad) *cell_grad = spot_cell_gradient(f, &s);
    return spot_value(f, &s);
}

static inline double value_at(const Field *f, Vec3 p)
{
    Spot s;
    return field_locate(f, p, &s) ? spot_value(f, &s) : -f->far;
}

bool field_triangle_inverted(const Field *f, Vec3 a, Vec3 b, Vec3 c)
{
    Vec3 n = v_scale(v_unit(v_area2(a, b, c)), INVERTED_VOX * f->voxel), corner[3] = {a, b, c};
    for (int k = 0; k < 3; k++)
        if (!(value_at(f, v_add(corner[k], n)) > value_at(f, v_sub(corner[k], n)))) return false;
    return true;
}
