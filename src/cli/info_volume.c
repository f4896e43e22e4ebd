#include "cli/info.h"

#include <math.h>
#include <string.h>

/* Of the samples within the active bounding box. */
typedef struct Range {
    double low[3], high[3]; /* by component; NaN: there are none */
    int64_t not_finite;
} Range;

static void range_add(Range *r, int k, float v)
{
    if (!isfinite(v)) {
        r->not_finite++;
        return;
    }
    r->low[k] = fmin(r->low[k], (double)v);
    r->high[k] = fmax(r->high[k], (double)v);
}

static bool is_active(const Grid *g, int x, int y, int z)
{
    return x >= g->lo[0] && x <= g->hi[0] && y >= g->lo[1] && y <= g->hi[1] && z >= g->lo[2] && z <= g->hi[2];
}

static Range range_of(const Grid *g)
{
    Range r = {.low = {NAN, NAN, NAN}, .high = {NAN, NAN, NAN}};
    for (int b = 0; b < g->nblock; b++) {
        const int *o = g->origin[b];
        for (int c = 0; c < g->ncomp * GRID_CELLS; c++)
            if (is_active(g, o[0] + (c & 7), o[1] + (c >> 3 & 7), o[2] + (c >> 6 & 7)))
                range_add(&r, c / GRID_CELLS, g->value[(size_t)b * (size_t)g->ncomp * GRID_CELLS + (size_t)c]);
    }
    for (int t = 0; t < g->ntile; t++) {
        const GridTile *tile = &g->tile[t];
        int side = 1 << tile->log2side;
        bool meets = true;
        for (int a = 0; a < 3; a++) meets = meets && tile->lo[a] <= g->hi[a] && tile->lo[a] + side > g->lo[a];
        for (int k = 0; meets && k < g->ncomp; k++) range_add(&r, k, tile->value[k]);
    }
    return r;
}

static json_t *ints(const int v[3]) { return json_pack("[i,i,i]", v[0], v[1], v[2]); }
static json_t *point(Vec3 p) { return info_reals(3, (double[3]){p.x, p.y, p.z}); }

static void add_place(json_t *to, const Grid *g)
{
    const double (*m)[3] = g->xform.m;
    double voxel[3];
    bool straight = true;
    for (int a = 0; a < 3; a++) {
        voxel[a] = v_len(vec3(m[0][a], m[1][a], m[2][a]));
        for (int b = 0; b < 3; b++) straight = straight && (a == b ? m[a][b] > 0 : m[a][b] == 0);
    }
    json_object_set_new(to, "voxel", info_reals(3, voxel));
    json_object_set_new(to, "origin", point(g->xform.t));
    if (!straight) json_object_set_new(to, "matrix", info_reals(9, m[0]));
}

static void add_bounds(json_t *to, const Grid *g)
{
    if (grid_is_empty(g)) {
        json_object_set_new(to, "active", json_null());
        return;
    }
    int n[3];
    Vec3 lo = vec3(INFINITY, INFINITY, INFINITY), hi = v_scale(lo, -1);
    for (int a = 0; a < 3; a++) n[a] = g->hi[a] - g->lo[a] + 1;
    for (int c = 0; c < 8; c++) {
        Vec3 p = affine_to_world(&g->xform, vec3(c & 1 ? g->hi[0] : g->lo[0], c & 2 ? g->hi[1] : g->lo[1], c & 4 ? g->hi[2] : g->lo[2]));
        lo = vec3(fmin(lo.x, p.x), fmin(lo.y, p.y), fmin(lo.z, p.z));
        hi = vec3(fmax(hi.x, p.x), fmax(hi.y, p.y), fmax(hi.z, p.z));
    }
    json_object_set_new(to, "active", json_pack("{s:o,s:o,s:o}", "from", ints(g->lo), "to", ints(g->hi), "samples", ints(n)));
    json_object_set_new(to, "world", json_pack("{s:o,s:o}", "from", point(lo), "to", point(hi)));
}

static json_t *grid_object(const VolumeEntry *e, const Grid *g)
{
    json_t *o = json_pack("{s:o,s:o}", "name", info_text(e->name), "type", info_text(e->type));
    if (!g) {
        json_object_set_new(o, "readable", json_false());
        return o;
    }
    Range r = range_of(g);
    double background[3] = {(double)g->background[0], (double)g->background[1], (double)g->background[2]};
    json_object_set_new(o, "class", e->grid_class[0] ? info_text(e->grid_class) : json_null());
    json_object_set_new(o, "components", json_integer(g->ncomp));
    add_place(o, g);
    json_object_set_new(o, "lowest", info_reals(g->ncomp, r.low));
    json_object_set_new(o, "highest", info_reals(g->ncomp, r.high));
    if (r.not_finite) json_object_set_new(o, "not_finite", json_integer(r.not_finite));
    json_object_set_new(o, "background", info_reals(g->ncomp, background));
    add_bounds(o, g);
    int64_t bytes = (int64_t)g->nblock * (g->ncomp * GRID_CELLS * 4 + 12) + (int64_t)g->ntile * (int64_t)sizeof(GridTile);
    json_object_set_new(o, "blocks", json_integer(g->nblock));
    json_object_set_new(o, "tiles", json_integer(g->ntile));
    json_object_set_new(o, "memory", json_integer(bytes));
    return o;
}

static json_t *choice_object(const VolumeEntry *e, Grid *g, const InfoJob *job)
{
    Volume v = {.surface = *g, .kind = volume_class_of(e, g)};
    memcpy(v.name, e->name, sizeof v.name);
    SurfaceChoice c = volume_choose_surface(&v, job->iso, job->inside);
    return json_pack("{s:o,s:o,s:s,s:o}", "grid", info_text(e->name), "iso", info_real(c.spec.iso), "inside",
                     c.spec.inside_below ? "below" : "above", "why", info_text(c.why));
}

static bool add_grids(json_t *to, VolumeFile *f, const InfoJob *job, Err *err)
{
    Err none = {0};
    json_t *grids = json_array(), *choice = NULL;
    int chosen = volume_choose(f, &none);
    bool ok = true;
    for (int i = 0; ok && i < volume_count(f); i++) {
        const VolumeEntry *e = volume_entry(f, i);
        if (e->ncomp == 0) {
            json_array_append_new(grids, grid_object(e, NULL));
            continue;
        }
        Grid g;
        grid_init(&g, e->ncomp);
        ok = volume_load(f, i, &g, err);
        if (ok) json_array_append_new(grids, grid_object(e, &g));
        if (ok && i == chosen) choice = choice_object(e, &g, job);
        grid_free(&g);
    }
    json_object_set_new(to, "grids", grids);
    json_object_set_new(to, "mesh", choice ? choice : json_pack("{s:n,s:o}", "grid", "why", info_text(none.text)));
    return ok;
}

json_t *info_volume(const char *path, const InfoJob *job, Err *err)
{
    VolumeFile *f = volume_open(path, &job->request, err);
    if (!f) return NULL;
    json_t *o = json_pack("{s:o,s:s}", "file", info_text(path), "format", volume_format_name(f));
    if (!add_grids(o, f, job, err)) {
        json_decref(o);
        o = NULL;
    }
    volume_close(f);
    return o;
}
