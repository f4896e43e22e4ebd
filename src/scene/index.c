#include "scene/kernel.h"

#include <string.h>

enum { INDEX_LEAST = 8, CELLS_A_PART = 8, CELLS_MAX = 1 << 24 };

typedef struct Box {
    Vec3 lo, hi;
} Box;

static Box part_box(const Element *e, int part, double reach)
{
    int per = e->shape == SHAPE_POINTS ? 1 : e->shape == SHAPE_SEGMENTS ? 2 : e->shape == SHAPE_TRIANGLES ? 3 : e->ncorner;
    const Vec3 *q = e->corner + (size_t)part * (size_t)per;
    Box b = {q[0], q[0]};
    for (int i = 1; i < per; i++)
        for (int a = 0; a < 3; a++) {
            v_set(&b.lo, a, real_min(v_get(b.lo, a), v_get(q[i], a)));
            v_set(&b.hi, a, real_max(v_get(b.hi, a), v_get(q[i], a)));
        }
    Vec3 r = vec3(reach, reach, reach);
    return (Box){v_sub(b.lo, r), v_add(b.hi, r)};
}

static int cell_of(const PartIndex *ix, double x, int axis)
{
    return (int)real_clamp(floor((x - v_get(ix->lo, axis)) / ix->cell), 0, ix->n[axis] - 1);
}

/* Cells as wide as the reach of points, so wide that no part stands in more than 6^3 of them, and so few that they cost no
 * more than the parts. */
static bool lay_out(PartIndex *ix, const Element *e, double reach)
{
    Box all = part_box(e, 0, reach);
    double widest = 0;
    for (int i = 0; i < e->npart; i++) {
        Box b = part_box(e, i, reach);
        for (int a = 0; a < 3; a++) {
            v_set(&all.lo, a, real_min(v_get(all.lo, a), v_get(b.lo, a)));
            v_set(&all.hi, a, real_max(v_get(all.hi, a), v_get(b.hi, a)));
            widest = real_max(widest, v_get(b.hi, a) - v_get(b.lo, a));
        }
    }
    ix->lo = all.lo;
    double most = real_min(64 + CELLS_A_PART * (double)e->npart, CELLS_MAX);
    for (ix->cell = real_max(reach, widest / 4);; ix->cell *= 1.25) {
        double cells = 1;
        for (int a = 0; a < 3; a++) {
            double n = ceil((v_get(all.hi, a) - v_get(all.lo, a)) / ix->cell);
            if (!(n < CELLS_MAX)) n = CELLS_MAX;
            ix->n[a] = int_max(1, (int)n);
            cells *= ix->n[a];
        }
        if (cells <= most) return true;
        if (!isfinite(ix->cell)) return false;
    }
}

/* Calls for every cell of every part: counts, or with `part` given files the part. */
static void file_parts(PartIndex *ix, const Element *e, double reach, int32_t *fill)
{
    for (int i = 0; i < e->npart; i++) {
        Box b = part_box(e, i, reach);
        int lo[3], hi[3];
        for (int a = 0; a < 3; a++) lo[a] = cell_of(ix, v_get(b.lo, a), a), hi[a] = cell_of(ix, v_get(b.hi, a), a);
        for (int z = lo[2]; z <= hi[2]; z++)
            for (int y = lo[1]; y <= hi[1]; y++)
                for (int x = lo[0]; x <= hi[0]; x++) {
                    int c = (z * ix->n[1] + y) * ix->n[0] + x;
                    if (fill) ix->part[fill[c]++] = i;
                    else ix->first[c + 1]++;
                }
    }
}

void index_build(PartIndex *ix, const Element *e, double reach)
{
    *ix = (PartIndex){0};
    if (e->npart < INDEX_LEAST || !lay_out(ix, e, reach)) {
        ix->cell = 0;
        return;
    }
    int cells = ix->n[0] * ix->n[1] * ix->n[2];
    ix->first = NEW0(int32_t, cells + 1);
    file_parts(ix, e, reach, NULL);
    for (int c = 0; c < cells; c++) ix->first[c + 1] += ix->first[c];
    ix->part = NEW(int32_t, ix->first[cells]);
    int32_t *fill = NEW(int32_t, cells);
    memcpy(fill, ix->first, (size_t)cells * sizeof *fill);
    file_parts(ix, e, reach, fill);
    mem_free(fill);
}

void index_free(PartIndex *ix)
{
    mem_free(ix->first);
    mem_free(ix->part);
    *ix = (PartIndex){0};
}

const int32_t *index_at(const PartIndex *ix, Vec3 p, int *n)
{
    int at[3];
    *n = 0;
    for (int a = 0; a < 3; a++) {
        double x = floor((v_get(p, a) - v_get(ix->lo, a)) / ix->cell);
        if (!(x >= 0 && x < ix->n[a])) return NULL;
        at[a] = (int)x;
    }
    int c = (at[2] * ix->n[1] + at[1]) * ix->n[0] + at[0];
    *n = ix->first[c + 1] - ix->first[c];
    return ix->part + ix->first[c];
}
