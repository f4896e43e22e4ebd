/* target.c: what the skin follows, as distances on its lattice. */
#include "skin/skin_priv.h"

#include "base/thread.h"

#include <math.h>
#include <string.h>

enum { TARGET_SPREADS = 14, BRICKS_MAX = 1 << 20, PLACE_MAX = (1 << 17) - 2 };

bool fail_bricks(Err *err)
{
    return fail(err, ERR_RESOURCE, "the target's surface needs more than %d bricks of 8^3 samples, or lies farther than %d voxels from the lattice's origin; give a larger --voxel",
                BRICKS_MAX, PLACE_MAX * SIDE);
}

bool places_add(Places *p, const SkinLattice *l, Vec3 lo, Vec3 hi, double margin)
{
    int from[3], to[3];
    for (int a = 0; a < 3; a++) {
        double low = (v_get(lo, a) - v_get(l->origin, a)) / l->voxel - margin, high = (v_get(hi, a) - v_get(l->origin, a)) / l->voxel + margin;
        if (!(low > -(double)PLACE_MAX * SIDE && high < (double)PLACE_MAX * SIDE)) return false;
        from[a] = (int)floor(low / SIDE);
        to[a] = (int)floor(high / SIDE);
    }
    for (int z = from[2]; z <= to[2]; z++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int x = from[0]; x <= to[0]; x++) {
                if (map_put(&p->seen, key_coord(x, y, z), p->n) != p->n) continue;
                if (p->n == BRICKS_MAX) return false;
                RESERVE(p->at, p->cap, p->n + 1);
                p->at[p->n][0] = x;
                p->at[p->n][1] = y;
                p->at[p->n][2] = z;
                p->n++;
            }
    return true;
}

void places_free(Places *p)
{
    mem_free(p->at);
    map_free(&p->seen);
}

/* --- from samples to distances ------------------------------------------------------------------------------------------ */

/* The samples beside the surface: slope, and value = raw / slope. The others: +-1. */
static void normalise(void *ctx, int begin, int end)
{
    SkinTarget *t = ctx;
    Band *b = &t->band;
    float pad[PAD1 * PAD1 * PAD1];
    for (int i = begin; i < end; i++) {
        band_gather(b->value, b->near[i], 1, 0, pad);
        for (int c = 0; c < CELLS; c++) {
            const float *p = pad + 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
            size_t at = (size_t)i * CELLS + (size_t)c;
            bool near = is_near(p, PAD1, PAD1 * PAD1);
            float slope = near ? near_slope(p, PAD1, PAD1 * PAD1) : 1;
            t->slope[at] = slope;
            b->spare[at] = near ? *p / slope : *p > 0 ? 1 : -1;
        }
    }
}

/* The band holds samples of any potential, or NaN where it is not known, away from the surface. */
static void fill_unknown(Band *b)
{
    for (bool again = true; again;) {
        again = false;
        for (int i = 0; i < b->n; i++) {
            float pad[PAD1 * PAD1 * PAD1], *v = b->value + (size_t)i * CELLS;
            bool unknown = false;
            for (int c = 0; c < CELLS; c++) unknown |= isnan(v[c]);
            if (!unknown) continue;
            band_gather(b->value, b->near[i], 1, NAN, pad);
            for (int c = 0; c < CELLS; c++) {
                static const int STEPS[6] = {-1, 1, -PAD1, PAD1, -PAD1 * PAD1, PAD1 * PAD1};
                const float *p = pad + 1 + (c & 7) + PAD1 * (1 + (c >> 3 & 7)) + PAD1 * PAD1 * (1 + (c >> 6));
                for (int k = 0; k < 6 && isnan(v[c]); k++)
                    if (!isnan(p[STEPS[k]])) v[c] = p[STEPS[k]] > 0 ? 1 : -1;
                again |= isnan(v[c]);
            }
        }
    }
}

/* Drops the slopes of bricks that went. */
static void keep_slopes(SkinTarget *t, const Band *old, const float *slope)
{
    t->slope = NEW(float, (size_t)t->band.n * CELLS);
    for (int i = 0; i < t->band.n; i++) {
        const int *at = t->band.at[i];
        int from = map_get(&old->where, key_coord(at[0], at[1], at[2]));
        float *to = t->slope + (size_t)i * CELLS;
        if (from != NONE) memcpy(to, slope + (size_t)from * CELLS, CELLS * sizeof(float));
        else
            for (int c = 0; c < CELLS; c++) to[c] = 1;
    }
}

void target_finish(SkinTarget *t)
{
    Band *b = &t->band;
    t->slope = NEW(float, (size_t)b->n * CELLS);
    fill_unknown(b);
    parallel_for(b->n, 8, normalise, t);
    float *swap = b->value;
    b->value = b->spare;
    b->spare = swap;
    band_spread(b, TARGET_SPREADS);
    /* bricks without a sample in the band go; slopes follow */
    Band old = {0};
    band_copy(&old, b);
    float *slope = t->slope;
    if (band_update(b)) {
        keep_slopes(t, &old, slope);
        mem_free(slope);
    }
    band_free(&old);
}

/* --- of a field ------------------------------------------------------------------------------------------------------------ */

typedef struct FieldJob {
    const SkinLattice *lattice;
    const Field *f;
    Band *b;
} FieldJob;

float lattice_value(const SkinLattice *l, const Field *f, int i, int j, int k)
{
    bool known;
    double F = field_value(f, v_axpy(l->origin, l->voxel, vec3(i, j, k)), NULL, &known);
    return known ? (float)(F / (SKIN_BAND_VOXELS * l->voxel)) : NAN;
}

static void sample_field(void *ctx, int begin, int end)
{
    FieldJob *job = ctx;
    for (int i = begin; i < end; i++)
        for (int c = 0; c < CELLS; c++) {
            const int *at = job->b->at[i];
            job->b->value[(size_t)i * CELLS + (size_t)c] = lattice_value(job->lattice, job->f, at[0] * SIDE + (c & 7), at[1] * SIDE + (c >> 3 & 7), at[2] * SIDE + (c >> 6));
        }
}

bool places_add_field(Places *p, const SkinLattice *l, const Field *f)
{
    for (int b = 0; b < f->ncrossed; b++) {
        Vec3 lo = vec3(INFINITY, INFINITY, INFINITY), hi = v_scale(lo, -1);
        for (int k = 0; k < 8; k++) {
            const int *o = f->origin[b];
            Vec3 q = affine_to_world(&f->xform, vec3(o[0] + 8 * (k & 1), o[1] + 8 * (k >> 1 & 1), o[2] + 8 * (k >> 2)));
            lo = vec3(fmin(lo.x, q.x), fmin(lo.y, q.y), fmin(lo.z, q.z));
            hi = vec3(fmax(hi.x, q.x), fmax(hi.y, q.y), fmax(hi.z, q.z));
        }
        if (!places_add(p, l, lo, hi, SKIN_BAND_VOXELS + 1)) return false;
    }
    return true;
}

SkinTarget *skin_target_field(const SkinLattice *l, const Field *f, Err *err)
{
    Places p = {0};
    bool ok = places_add_field(&p, l, f) || fail_bricks(err);
    SkinTarget *t = NULL;
    if (ok) {
        t = NEW0(SkinTarget, 1);
        band_init(&t->band, p.n, p.at);
        FieldJob job = {l, f, &t->band};
        parallel_for(t->band.n, 4, sample_field, &job);
        target_finish(t);
    }
    places_free(&p);
    return t;
}

void skin_target_free(SkinTarget *t)
{
    if (!t) return;
    band_free(&t->band);
    mem_free(t->slope);
    mem_free(t);
}
