#include "field/grid.h"

#include <string.h>

enum { COORD_LIMIT = 1 << 20 };
static const int LEVEL_SHIFT[3] = {3, 7, 12};

void grid_init(Grid *g, int ncomp)
{
    ASSERT(ncomp == 1 || ncomp == 3);
    *g = (Grid){.ncomp = ncomp, .lo = {0, 0, 0}, .hi = {-1, -1, -1}};
    for (int i = 0; i < 3; i++) g->xform.m[i][i] = g->xform.inv[i][i] = 1;
}

void grid_free(Grid *g)
{
    mem_free(g->origin);
    mem_free(g->value);
    mem_free(g->tile);
    map_free(&g->block_at);
    for (int l = 0; l < 3; l++) map_free(&g->tile_at[l]);
    *g = (Grid){0};
}

bool grid_is_empty(const Grid *g) { return g->lo[0] > g->hi[0]; }

static bool in_reach(int x, int y, int z)
{
    return x > -COORD_LIMIT && x < COORD_LIMIT && y > -COORD_LIMIT && y < COORD_LIMIT && z > -COORD_LIMIT && z < COORD_LIMIT;
}

void grid_reserve(Grid *g, int nblock)
{
    if (nblock <= g->capblock) return;
    g->capblock = nblock;
    RESIZE(g->origin, nblock);
    g->value = mem_resize(g->value, (size_t)nblock, (size_t)g->ncomp * GRID_CELLS * sizeof(float));
}

float *grid_add_block(Grid *g, int x, int y, int z)
{
    if (!in_reach(x, y, z)) return NULL;
    size_t size = (size_t)g->ncomp * GRID_CELLS;
    int b = map_put(&g->block_at, key_coord(x >> 3, y >> 3, z >> 3), g->nblock);
    if (b < g->nblock) return g->value + (size_t)b * size;
    if (g->nblock == g->capblock) grid_reserve(g, g->capblock ? 2 * g->capblock : 64);
    g->nblock++;
    g->origin[b][0] = x & ~7;
    g->origin[b][1] = y & ~7;
    g->origin[b][2] = z & ~7;
    return g->value + (size_t)b * size;
}

void grid_add_tile(Grid *g, GridTile t)
{
    int level = t.log2side == 3 ? 0 : t.log2side == 7 ? 1 : 2;
    ASSERT(t.log2side == LEVEL_SHIFT[level]);
    RESERVE(g->tile, g->captile, g->ntile + 1);
    g->tile[g->ntile] = t;
    map_put(&g->tile_at[level], key_coord(t.lo[0] >> t.log2side, t.lo[1] >> t.log2side, t.lo[2] >> t.log2side), g->ntile++);
}

const float *grid_block(const Grid *g, int x, int y, int z)
{
    if (!in_reach(x, y, z)) return NULL;
    int b = map_get(&g->block_at, key_coord(x >> 3, y >> 3, z >> 3));
    return b == NONE ? NULL : g->value + (size_t)b * (size_t)g->ncomp * GRID_CELLS;
}

float grid_at(const Grid *g, int x, int y, int z, int k)
{
    if (!in_reach(x, y, z)) return g->background[k];
    const float *v = grid_block(g, x, y, z);
    if (v) return v[k * GRID_CELLS + (z & 7) * 64 + (y & 7) * 8 + (x & 7)];
    for (int l = 0; l < 3; l++) {
        if (!g->tile_at[l].count) continue;
        int s = LEVEL_SHIFT[l], t = map_get(&g->tile_at[l], key_coord(x >> s, y >> s, z >> s));
        if (t != NONE) return g->tile[t].value[k];
    }
    return g->background[k];
}

void grid_from_dense(Grid *g, const float *value, const int n[3])
{
    ASSERT(grid_is_empty(g) && n[0] > 0 && n[1] > 0 && n[2] > 0);
    for (int a = 0; a < 3; a++) {
        g->lo[a] = 0;
        g->hi[a] = n[a] - 1;
    }
    for (int bz = 0; bz < n[2]; bz += 8)
        for (int by = 0; by < n[1]; by += 8)
            for (int bx = 0; bx < n[0]; bx += 8) {
                float *v = grid_add_block(g, bx, by, bz);
                for (int k = 0; k < g->ncomp; k++)
                    for (int c = 0; c < GRID_CELLS; c++) {
                        int x = bx + (c & 7), y = by + (c >> 3 & 7), z = bz + (c >> 6);
                        bool in = x < n[0] && y < n[1] && z < n[2];
                        size_t at = (size_t)x + (size_t)n[0] * ((size_t)y + (size_t)n[1] * (size_t)z);
                        v[k * GRID_CELLS + c] = in ? value[at * (size_t)g->ncomp + (size_t)k] : g->background[k];
                    }
            }
}

/* Trilinear at index-space p. */
static double component_at(const Grid *g, Vec3 p, int k)
{
    double f[3] = {floor(p.x), floor(p.y), floor(p.z)}, out = 0;
    for (int a = 0; a < 3; a++)
        if (!(f[a] > -COORD_LIMIT && f[a] < COORD_LIMIT - 1)) return g->background[k];
    int x = (int)f[0], y = (int)f[1], z = (int)f[2];
    double t[3] = {p.x - f[0], p.y - f[1], p.z - f[2]};
    for (int c = 0; c < 8; c++) {
        double w = (c & 1 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 4 ? t[2] : 1 - t[2]);
        out += w * (double)grid_at(g, x + (c & 1), y + (c >> 1 & 1), z + (c >> 2), k);
    }
    return out;
}

Vec3 grid_vector(const Grid *g, Vec3 world)
{
    ASSERT(g->ncomp == 3);
    Vec3 p = affine_to_index(&g->xform, world), v = vec3(0, 0, 0);
    for (int k = 0; k < 3; k++) {
        Vec3 q = p; /* component k of a MAC grid is stored half a voxel towards -k of its sample */
        if (g->staggered) v_set(&q, k, v_get(p, k) + 0.5);
        v_set(&v, k, component_at(g, q, k));
    }
    return v;
}

double grid_scalar(const Grid *g, Vec3 world)
{
    return component_at(g, affine_to_index(&g->xform, world), 0);
}
