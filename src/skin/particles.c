/* particles.c: particles as a target: each brick gathers from the particles of the bricks around it, in one order. */
#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BLOB_ISO 0.421875 /* (1 - 1/4)^3: what one particle has at its radius */
#define BALL_MARGIN 2.0   /* voxels beyond a ball where it still counts: more than a crossed edge is long */

typedef struct Ball {
    Vec3 place;    /* voxels */
    double radius; /* voxels */
    int at[3];     /* brick */
    int order;     /* among the particles of the file */
} Ball;

typedef struct Cloud {
    SkinKernel kernel;
    int n;
    Ball *ball;    /* [n] by brick */
    Band bins;     /* the bricks that have any; no values */
    int32_t *first; /* [bins.n + 1] */
    double reach;  /* voxels from a particle beyond which it counts for nothing */
    const SkinLattice *lattice;
    const Field *rest;
    Band *band;
} Cloud;

static int compare_balls(const void *pa, const void *pb)
{
    const Ball *a = pa, *b = pb;
    for (int k = 2; k >= 0; k--)
        if (a->at[k] != b->at[k]) return a->at[k] < b->at[k] ? -1 : 1;
    return a->order < b->order ? -1 : a->order > b->order;
}

static double ball_reach(SkinKernel kernel, double radius) { return kernel == SKIN_BLOB ? 2 * radius : radius + BALL_MARGIN; }

/* In voxels and sorted. False where one is too far away. */
static bool sort_balls(Cloud *c, const SkinLattice *l, const SkinPoints *p)
{
    c->n = p->n;
    c->ball = NEW(Ball, p->n);
    for (int i = 0; i < p->n; i++) {
        Ball *b = &c->ball[i];
        b->place = v_scale(v_sub(p->place[i], l->origin), 1 / l->voxel);
        b->radius = (p->radius ? (double)p->radius[i] : p->common) / l->voxel;
        b->order = i;
        for (int a = 0; a < 3; a++) {
            double x = v_get(b->place, a);
            if (!(fabs(x) < 1 << 20)) return false;
            b->at[a] = (int)floor(x / SIDE);
        }
        c->reach = real_max(c->reach, ball_reach(c->kernel, b->radius));
    }
    if (p->n) qsort(c->ball, (size_t)p->n, sizeof *c->ball, compare_balls);
    return true;
}

/* Which balls are in which brick, and which bricks the surface may be near. */
static bool fill_bins(Cloud *c, const SkinLattice *l, Places *places)
{
    int (*at)[3] = mem_alloc((size_t)c->n, sizeof *at);
    int n = 0;
    for (int i = 0; i < c->n; i++)
        if (i == 0 || memcmp(c->ball[i].at, c->ball[i - 1].at, sizeof *at) != 0) memcpy(at[n++], c->ball[i].at, sizeof *at);
    c->bins.n = n;
    c->bins.at = at;
    map_init(&c->bins.where, n);
    c->first = NEW(int32_t, n + 1);
    bool ok = true;
    for (int b = 0, i = 0; b < n && ok; b++) {
        Vec3 lo = vec3(INFINITY, INFINITY, INFINITY), hi = v_scale(lo, -1);
        double radius = 0;
        map_put(&c->bins.where, key_coord(at[b][0], at[b][1], at[b][2]), b);
        c->first[b] = i;
        for (; i < c->n && memcmp(c->ball[i].at, at[b], sizeof *at) == 0; i++) {
            Vec3 p = c->ball[i].place;
            lo = vec3(fmin(lo.x, p.x), fmin(lo.y, p.y), fmin(lo.z, p.z));
            hi = vec3(fmax(hi.x, p.x), fmax(hi.y, p.y), fmax(hi.z, p.z));
            radius = real_max(radius, c->ball[i].radius);
        }
        c->first[b + 1] = i;
        double shell = (c->kernel == SKIN_BLOB ? 2 * radius : radius) + SKIN_BAND_VOXELS + 1;
        ok = places_add(places, l, v_axpy(l->origin, l->voxel, lo), v_axpy(l->origin, l->voxel, hi), shell);
    }
    return ok;
}

/* What a ball adds to the samples of a brick whose first is `origin`. */
static void add_ball(SkinKernel kernel, const Ball *ball, Vec3 origin, float *value)
{
    double reach = ball_reach(kernel, ball->radius);
    Vec3 p = v_sub(ball->place, origin);
    int lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        double low = ceil(v_get(p, a) - reach), high = floor(v_get(p, a) + reach);
        if (high < 0 || low > SIDE - 1) return;
        lo[a] = int_max((int)low, 0);
        hi[a] = high > SIDE - 1 ? SIDE - 1 : (int)high;
    }
    double reach2 = reach * reach;
    for (int z = lo[2]; z <= hi[2]; z++)
        for (int y = lo[1]; y <= hi[1]; y++)
            for (int x = lo[0]; x <= hi[0]; x++) {
                double d2 = v_len2(v_sub(vec3(x, y, z), p));
                if (d2 >= reach2) continue;
                float *v = &value[(z * SIDE + y) * SIDE + x];
                double u = 1 - d2 / reach2;
                if (kernel == SKIN_BLOB) *v += (float)(u * u * u);
                else *v = (float)real_max((double)*v, ball->radius - sqrt(d2));
            }
}

/* The union with the field. Where that is not known its side is that of the samples around. */
static void add_rest(const Cloud *c, const int at[3], float *value)
{
    for (int k = 0; k < CELLS; k++) {
        float F = lattice_value(c->lattice, c->rest, at[0] * SIDE + (k & 7), at[1] * SIDE + (k >> 3 & 7), at[2] * SIDE + (k >> 6));
        if (isnan(F) ? value[k] <= 0 : F > value[k]) value[k] = F;
    }
}

static void sample_balls(void *ctx, int begin, int end)
{
    Cloud *c = ctx;
    int wide = (int)ceil(c->reach / SIDE);
    for (int i = begin; i < end; i++) {
        const int *at = c->band->at[i];
        float *value = c->band->value + (size_t)i * CELLS;
        for (int k = 0; k < CELLS; k++) value[k] = c->kernel == SKIN_BLOB ? (float)-BLOB_ISO : (float)-BALL_MARGIN;
        Vec3 origin = vec3(at[0] * SIDE, at[1] * SIDE, at[2] * SIDE);
        for (int z = -wide; z <= wide; z++)
            for (int y = -wide; y <= wide; y++)
                for (int x = -wide; x <= wide; x++) {
                    int b = map_get(&c->bins.where, key_coord(at[0] + x, at[1] + y, at[2] + z));
                    for (int k = b == NONE ? 0 : c->first[b]; b != NONE && k < c->first[b + 1]; k++) add_ball(c->kernel, &c->ball[k], origin, value);
                }
        if (c->rest) add_rest(c, at, value);
    }
}

SkinTarget *skin_target_points(const SkinLattice *l, const SkinPoints *points, SkinKernel kernel, const Field *rest, Err *err)
{
    Cloud c = {.kernel = kernel, .lattice = l, .rest = rest};
    Places places = {0};
    SkinTarget *t = NULL;
    if ((sort_balls(&c, l, points) && fill_bins(&c, l, &places) && (!rest || places_add_field(&places, l, rest))) || fail_bricks(err)) {
        t = NEW0(SkinTarget, 1);
        band_init(&t->band, places.n, places.at);
        c.band = &t->band;
        parallel_for(t->band.n, 2, sample_balls, &c);
        target_finish(t);
    }
    places_free(&places);
    mem_free(c.bins.at);
    map_free(&c.bins.where);
    mem_free(c.first);
    mem_free(c.ball);
    return t;
}
