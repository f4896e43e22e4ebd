/* skin.c: the motion (GI'98 4.6): speeds at the surface, the step of eq. 7, new values, distances, bricks. */
#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>
#include <string.h>

enum { SPREADS = 4 };
#define COURANT 0.5           /* voxels in a substep at most: a sample two away from the surface does not miss it */
#define TRACKED 0.5           /* of the way to the target in a substep at most: it is not overshot */
#define NEIGHBOUR 0.93f       /* a sample beside one beside the surface is (1 + sqrt 3) voxels from it at most */
#define FLAT 1e-6f            /* |grad f|^2 below which there is no curvature to speak of */
#define SHARPEST (2 / DX)     /* a ball of one voxel's radius has this curvature; what is sharper cannot be told */

struct Skin {
    SkinLattice lattice;
    SkinSettings settings;
    Band band;
    Extent kept;              /* what is to be kept */
    /* the frame at hand */
    const SkinTarget *target;
    double uniform;           /* the speed that keeps area or volume, bands / time */
    double speed;             /* the largest of the last substep */
    float dt;
    float *fastest, *steepest; /* [band.n] speed and |grad f| at the surface in a brick */
    double *sum;               /* [band.n] of the speeds there */
    int32_t *count;            /* [band.n] how many they are */
    int capbrick;
};

/* --- speeds --------------------------------------------------------------------------------------------------------- */

/* kappa |grad f| of eq. 5 by central differences. */
static float curvature(const float *p)
{
    enum { Y = PAD1, Z = PAD1 * PAD1 };
    float x = p[1] - p[-1], y = p[Y] - p[-Y], z = p[Z] - p[-Z]; /* 2 dx times the first derivatives */
    float xx = p[1] - 2 * p[0] + p[-1], yy = p[Y] - 2 * p[0] + p[-Y], zz = p[Z] - 2 * p[0] + p[-Z];
    float xy = 0.25f * (p[1 + Y] - p[1 - Y] - p[-1 + Y] + p[-1 - Y]);
    float yz = 0.25f * (p[Y + Z] - p[Y - Z] - p[-Y + Z] + p[-Y - Z]);
    float xz = 0.25f * (p[1 + Z] - p[1 - Z] - p[-1 + Z] + p[-1 - Z]);
    float square = x * x + y * y + z * z;
    if (square < FLAT * DX * DX) return 0;
    float sum = x * x * (yy + zz) + y * y * (xx + zz) + z * z * (xx + yy) - 2 * (x * y * xy + y * z * yz + x * z * xz);
    float k = -sum / (square * DX * DX);
    return k > SHARPEST ? SHARPEST : k < -SHARPEST ? -SHARPEST : k;
}

/* The mean of G - iso where the edges from a sample are crossed (4.3). */
static float shifted_target(const float *p, const float *value, const float *slope)
{
    static const int STEPS[6] = {-1, 1, -PAD1, PAD1, -PAD1 * PAD1, PAD1 * PAD1};
    float sum = 0;
    int n = 0;
    for (int k = 0; k < 6; k++) {
        int s = STEPS[k];
        if (!is_crossed(p[0], p[s])) continue;
        float t = p[0] / (p[0] - p[s]);
        float weight = slope[0] + t * (slope[s] - slope[0]), raw0 = value[0] * slope[0], raw1 = value[s] * slope[s];
        sum += (raw0 + t * (raw1 - raw0)) / weight;
        n++;
    }
    return sum / (float)n;
}

/* Speeds of the samples beside the surface; NaN elsewhere. */
static void find_speeds(void *ctx, int begin, int end)
{
    Skin *s = ctx;
    Band *b = &s->band;
    const Band *target = &s->target->band;
    const float alpha = (float)s->settings.alpha, beta = (float)s->settings.beta;
    float f[PAD1 * PAD1 * PAD1], value[PAD1 * PAD1 * PAD1], slope[PAD1 * PAD1 * PAD1];
    for (int i = begin; i < end; i++) {
        int32_t near[27];
        band_gather(b->value, b->near[i], 1, 0, f);
        if (alpha > 0) {
            band_around(target, b->at[i], near);
            band_gather(target->value, near, 1, near[13] == NONE ? band_side(target, b->at[i]) : 0, value);
            band_gather(s->target->slope, near, 1, 1, slope);
        }
        float *to = b->extra + (size_t)i * CELLS, fastest = 0, steepest = 0;
        double sum = 0;
        int count = 0;
        for (int c = 0; c < CELLS; c++) {
            int at = 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
            const float *p = f + at;
            to[c] = NAN;
            if (!is_near(p, PAD1, PAD1 * PAD1)) continue;
            to[c] = (alpha > 0 ? alpha * shifted_target(p, value + at, slope + at) : 0) - (beta > 0 ? beta * curvature(p) : 0);
            sum += (double)to[c];
            count++;
            float g = beta > 0 ? near_slope(p, PAD1, PAD1 * PAD1) : 0;
            if (fabsf(to[c]) > fastest) fastest = fabsf(to[c]);
            if (g > steepest) steepest = g;
        }
        s->fastest[i] = fastest;
        s->steepest[i] = steepest;
        s->sum[i] = sum;
        s->count[i] = count;
    }
}

static double mean_speed(const Skin *s)
{
    double sum = 0, count = 0;
    for (int i = 0; i < s->band.n; i++) {
        sum += s->sum[i];
        count += s->count[i];
    }
    return count > 0 ? sum / count : 0;
}

/* Section 5: the uniform speed gamma e, e = (V0 - V)/V0, as the mean over a substep of the exact solution of
 * e' = -(gamma e + m) S/V0, where m is the mean of the other speeds and S = dV/dx: any gamma is stable. */
static double keeping_speed(const Skin *s, double dt)
{
    if (s->settings.keep == KEEP_NOTHING) return 0;
    bool area = s->settings.keep == KEEP_AREA;
    Extent now = band_measure(&s->band);
    if (!(now.volume > 0) || !(now.area > 0) || !(s->kept.volume > 0)) return 0;
    double want = area ? s->kept.area : s->kept.volume, have = area ? now.area : now.volume;
    /* of the volume it is the area; of the area the integral of the mean curvature, taken as a ball's */
    double S = area ? 2 * now.area * now.area / (3 * now.volume) : now.area, gamma = s->settings.gamma;
    double rate = gamma * S / want, e = (want - have) / want, m = mean_speed(s);
    if (!(rate > 0)) return 0;
    return (e + m / gamma) * -expm1(-rate * dt) / (dt * S / want) - m;
}

/* --- one substep ------------------------------------------------------------------------------------------------------ */

/* Samples beside the surface take their own speed, those one farther away the mean of such neighbours; spreading the
 * distances afterwards moves the others. */
static void move_values_of(void *ctx, int begin, int end)
{
    Skin *s = ctx;
    Band *b = &s->band;
    float pad[PAD1 * PAD1 * PAD1], dt = s->dt, uniform = (float)s->uniform;
    for (int i = begin; i < end; i++) {
        band_gather(b->extra, b->near[i], 1, NAN, pad);
        const float *f = b->value + (size_t)i * CELLS;
        float *to = b->spare + (size_t)i * CELLS, fastest = 0;
        for (int c = 0; c < CELLS; c++) {
            const float *v = pad + 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
            float speed = *v, sum = 0;
            int n = 0;
            if (fabsf(speed + uniform) > fastest) fastest = fabsf(speed + uniform);
            if (isnan(speed) && fabsf(f[c]) < NEIGHBOUR) {
                for (int k = 0; k < 27; k++) {
                    float w = v[k % 3 - 1 + PAD1 * (k / 3 % 3 - 1) + PAD1 * PAD1 * (k / 9 - 1)];
                    if (isnan(w)) continue;
                    sum += w;
                    n++;
                }
                if (n) speed = sum / (float)n;
            }
            float moved = isnan(speed) ? f[c] : f[c] + dt * (speed + uniform);
            to[c] = moved > 1 ? 1 : moved < -1 ? -1 : moved;
        }
        s->fastest[i] = fastest;
    }
}

static float largest(const float *v, int n)
{
    float most = 0;
    for (int i = 0; i < n; i++) most = v[i] > most ? v[i] : most;
    return most;
}

/* Eq. 7. */
static double longest_step(const SkinSettings *set, double speed, double slope)
{
    double dx = (double)DX, dt = INFINITY;
    if (speed > 0) dt = COURANT * dx / speed;
    if (set->beta > 0) dt = real_min(dt, dx * dx / (6 * set->beta * real_max(slope, 1)));
    if (set->alpha > 0) dt = real_min(dt, TRACKED / set->alpha);
    return dt;
}

double skin_substeps(const SkinSettings *set, double time) { return ceil(time / longest_step(set, 0, 1)); }

/* Returns how long it was: `left` or less. */
static double move_once(Skin *s, double left)
{
    Band *b = &s->band;
    if (b->n > s->capbrick) {
        s->capbrick = b->n + b->n / 2;
        RESIZE(s->fastest, s->capbrick);
        RESIZE(s->steepest, s->capbrick);
        RESIZE(s->sum, s->capbrick);
        RESIZE(s->count, s->capbrick);
    }
    parallel_for(b->n, 8, find_speeds, s);
    double speed = (double)largest(s->fastest, b->n), slope = (double)largest(s->steepest, b->n);
    double limit = longest_step(&s->settings, speed, slope);
    s->uniform = keeping_speed(s, real_min(limit, left));
    limit = longest_step(&s->settings, speed + fabs(s->uniform), slope);
    double dt = left <= limit ? left : left / ceil(left / limit);
    s->dt = (float)dt;
    parallel_for(b->n, 8, move_values_of, s);
    s->speed = (double)largest(s->fastest, b->n);
    float *t = b->value;
    b->value = b->spare;
    b->spare = t;
    band_redistance(b, SPREADS);
    band_update(b);
    return dt;
}

/* --- the skin ------------------------------------------------------------------------------------------------------- */

Skin *skin_begin(const SkinLattice *l, const SkinSettings *settings, const SkinTarget *start)
{
    Skin *s = NEW0(Skin, 1);
    s->lattice = *l;
    s->settings = *settings;
    band_copy(&s->band, &start->band);
    if (settings->keep != KEEP_NOTHING) s->kept = band_measure(&s->band);
    return s;
}

void skin_end(Skin *s)
{
    band_free(&s->band);
    mem_free(s->fastest);
    mem_free(s->steepest);
    mem_free(s->sum);
    mem_free(s->count);
    mem_free(s);
}

/* A ball of radius R0 as target holds one of radius R where alpha (R0 - R) = 2 beta / R, and that has a solution from
 * R0 = sqrt(8 beta / alpha) on: what is smaller would be born and vanish again in every frame. What is a band deep may be
 * of any size. */
static float least_ball(const SkinSettings *set) { return (float)real_min(sqrt(8 * set->beta / set->alpha), 1 - (double)DX / 2); }

SkinStat skin_move(Skin *s, const SkinTarget *target, double time)
{
    SkinStat stat = {0};
    s->target = target;
    if (s->settings.alpha > 0) stat.born = band_seed(&s->band, &target->band, least_ball(&s->settings));
    for (double left = time; left > 0 && s->band.n; stat.substeps++) {
        double dt = move_once(s, left);
        left = dt < left * (1 - 1e-9) ? left - dt : 0;
    }
    double band = SKIN_BAND_VOXELS * s->lattice.voxel;
    Extent e = band_measure(&s->band);
    stat.area = e.area * band * band;
    stat.volume = e.volume * band * band * band;
    stat.bricks = s->band.n;
    stat.speed = s->band.n ? SKIN_BAND_VOXELS * s->speed : 0;
    s->target = NULL;
    return stat;
}

bool skin_is_inside(const Skin *s, Vec3 world)
{
    Vec3 q = v_scale(v_sub(world, s->lattice.origin), 1 / s->lattice.voxel);
    const double limit = (1 << 20) - 1;
    if (!(fabs(q.x) < limit && fabs(q.y) < limit && fabs(q.z) < limit)) return false;
    int at[3] = {(int)floor(q.x + 0.5), (int)floor(q.y + 0.5), (int)floor(q.z + 0.5)};
    int brick[3] = {at[0] >> 3, at[1] >> 3, at[2] >> 3};
    int b = map_get(&s->band.where, key_coord(brick[0], brick[1], brick[2]));
    if (b == NONE) return band_side(&s->band, brick) > 0;
    return s->band.value[(size_t)b * CELLS + (size_t)((at[2] & 7) * 64 + (at[1] & 7) * 8 + (at[0] & 7))] > 0;
}

/* --- as a grid -------------------------------------------------------------------------------------------------------- */

/* The bricks between two of one row that are not there, where they lie inside. */
static void add_tiles(const Band *b, int i, float inside, Grid *g)
{
    if (i + 1 == b->n || b->at[i + 1][1] != b->at[i][1] || b->at[i + 1][2] != b->at[i][2]) return;
    if (!(b->value[(size_t)i * CELLS + SIDE - 1] > 0)) return;
    for (int x = b->at[i][0] + 1; x < b->at[i + 1][0]; x++)
        grid_add_tile(g, (GridTile){{x * SIDE, b->at[i][1] * SIDE, b->at[i][2] * SIDE}, 3, {inside, 0, 0}});
}

static void grow_bounds(Grid *g, const int at[3], int c)
{
    const int p[3] = {at[0] * SIDE + (c & 7), at[1] * SIDE + (c >> 3 & 7), at[2] * SIDE + (c >> 6)};
    for (int a = 0; a < 3; a++) {
        g->lo[a] = int_min(g->lo[a], p[a]);
        g->hi[a] = int_max(g->hi[a], p[a]);
    }
}

void skin_to_grid(const Skin *s, Grid *g)
{
    const Band *b = &s->band;
    const float band = (float)(SKIN_BAND_VOXELS * s->lattice.voxel);
    for (int a = 0; a < 3; a++) {
        g->xform.m[a][a] = s->lattice.voxel;
        g->lo[a] = INT32_MAX;
        g->hi[a] = INT32_MIN;
    }
    affine_invert(&g->xform);
    g->xform.t = s->lattice.origin;
    g->background[0] = band;
    g->narrow = true;
    for (int i = 0; i < b->n; i++) {
        const float *f = b->value + (size_t)i * CELLS;
        float *to = grid_add_block(g, b->at[i][0] * SIDE, b->at[i][1] * SIDE, b->at[i][2] * SIDE);
        for (int c = 0; c < CELLS; c++) {
            to[c] = -f[c] * band;
            if (fabsf(f[c]) < 1) grow_bounds(g, b->at[i], c);
        }
        add_tiles(b, i, -band, g);
    }
    if (g->lo[0] > g->hi[0])
        for (int a = 0; a < 3; a++) g->lo[a] = g->hi[a] = 0; /* no surface: one sample, outside */
}
