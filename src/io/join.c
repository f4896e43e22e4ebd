#include "io/io_priv.h"

#include <string.h>

static bool is_near(Vec3 a, Vec3 b, double voxel) { return v_dist(a, b) <= 1e-4 * voxel; }

/* One transform for the three, at the voxels' centres; *staggered where components sit half a voxel towards
 * their axis, as Houdini writes them. */
static bool join_transforms(const Grid part[3], Affine *out, bool *staggered)
{
    Vec3 t[3], centre[3];
    double voxel = cbrt(fabs(affine_det(&part[0].xform)));
    for (int k = 0; k < 3; k++) {
        const Affine *x = &part[k].xform;
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                if (fabs(x->m[a][b] - part[0].xform.m[a][b]) > 1e-6 * voxel) return false;
        t[k] = x->t;
        centre[k] = v_axpy(t[k], 0.5, vec3(x->m[0][k], x->m[1][k], x->m[2][k]));
    }
    *out = part[0].xform;
    if (is_near(t[0], t[1], voxel) && is_near(t[0], t[2], voxel)) return true;
    if (!is_near(centre[0], centre[1], voxel) || !is_near(centre[0], centre[2], voxel)) return false;
    out->t = centre[0];
    *staggered = true;
    return true;
}

/* What a grid holds over a whole tile: its own tile of that size or larger, else the background. */
static float tile_value(const Grid *g, const GridTile *like)
{
    static const int shift[3] = {3, 7, 12};
    for (int l = 0; l < 3; l++) {
        int s = shift[l];
        if (s < like->log2side) continue;
        int t = map_get(&g->tile_at[l], key_coord(like->lo[0] >> s, like->lo[1] >> s, like->lo[2] >> s));
        if (t != NONE) return g->tile[t].value[0];
    }
    return g->background[0];
}

static void join_tiles(const Grid part[3], Grid *out)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < part[k].ntile; i++) {
            GridTile tile = part[k].tile[i];
            int level = tile.log2side == 3 ? 0 : tile.log2side == 7 ? 1 : 2, s = tile.log2side;
            if (map_get(&out->tile_at[level], key_coord(tile.lo[0] >> s, tile.lo[1] >> s, tile.lo[2] >> s)) != NONE) continue;
            for (int c = 0; c < 3; c++) tile.value[c] = tile_value(&part[c], &part[k].tile[i]);
            grid_add_tile(out, tile);
        }
}

static void join_blocks(const Grid part[3], Grid *out)
{
    for (int k = 0; k < 3; k++)
        for (int b = 0; b < part[k].nblock; b++) {
            const int *o = part[k].origin[b];
            int before = out->nblock;
            float *to = grid_add_block(out, o[0], o[1], o[2]);
            if (!to || out->nblock == before) continue; /* there already */
            for (int c = 0; c < 3 * GRID_CELLS; c++) {
                int x = o[0] + (c & 7), y = o[1] + (c >> 3 & 7), z = o[2] + (c >> 6 & 7);
                to[c] = grid_at(&part[c / GRID_CELLS], x, y, z, 0);
            }
        }
}

bool volume_join(const Grid part[3], bool staggered, Grid *out)
{
    if (!join_transforms(part, &out->xform, &staggered)) return false;
    out->staggered = staggered;
    if (!affine_invert(&out->xform)) return false;
    for (int k = 0; k < 3; k++) {
        out->background[k] = part[k].background[0];
        if (grid_is_empty(&part[k])) continue;
        bool first = grid_is_empty(out);
        for (int a = 0; a < 3; a++) {
            out->lo[a] = first ? part[k].lo[a] : int_min(out->lo[a], part[k].lo[a]);
            out->hi[a] = first ? part[k].hi[a] : int_max(out->hi[a], part[k].hi[a]);
        }
    }
    join_tiles(part, out);
    join_blocks(part, out);
    return true;
}
