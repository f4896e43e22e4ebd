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

Digest128 grid_digest(const Grid *g)
{
    Digest128 d = {0};
    int head[] = {g->ncomp, g->staggered, g->narrow, g->nblock, g->ntile, g->lo[0], g->lo[1], g->lo[2], g->hi[0], g->hi[1], g->hi[2]};
    digest_add(&d, head, sizeof head);
    digest_add(&d, &g->xform, sizeof g->xform);
    digest_add(&d, g->background, sizeof g->background);
    digest_add(&d, g->origin, (size_t)g->nblock * sizeof *g->origin);
    digest_add(&d, g->value, (size_t)g->nblock * (size_t)g->ncomp * GRID_CELLS * sizeof *g->value);
    digest_add(&d, g->tile, (size_t)g->ntile * sizeof *g->tile);
    return d;
}

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

/* One block's samples, n of them along each axis in the array; beyond it is background. */
static void fill_block(const Grid *g, float *block, const float *value, const int n[3], const size_t step[3])
{
    bool part = n[0] < GRID_SIDE || n[1] < GRID_SIDE || n[2] < GRID_SIDE;
    for (int k = 0; k < g->ncomp; k++) {
        float *v = block + k * GRID_CELLS;
        for (int c = 0; c < GRID_CELLS && part; c++) v[c] = g->background[k];
        for (int z = 0; z < n[2]; z++)
            for (int y = 0; y < n[1]; y++) {
                const float *row = value + (size_t)y * step[1] + (size_t)z * step[2] + (size_t)k;
                for (int x = 0; x < n[0]; x++) v[z * 64 + y * 8 + x] = row[(size_t)x * step[0]];
            }
    }
}

void grid_from_array(Grid *g, const float *value, const int n[3], const size_t step[3])
{
    ASSERT(grid_is_empty(g) && n[0] > 0 && n[1] > 0 && n[2] > 0);
    for (int a = 0; a < 3; a++) {
        g->lo[a] = 0;
        g->hi[a] = n[a] - 1;
    }
    for (int z = 0; z < n[2]; z += 8)
        for (int y = 0; y < n[1]; y += 8)
            for (int x = 0; x < n[0]; x += 8) {
                const float *from = value + (size_t)x * step[0] + (size_t)y * step[1] + (size_t)z * step[2];
                int side[3] = {int_min(8, n[0] - x), int_min(8, n[1] - y), int_min(8, n[2] - z)};
                fill_block(g, grid_add_block(g, x, y, z), from, side, step);
            }
}

void grid_from_dense(Grid *g, const float *value, const int n[3])
{
    size_t ncomp = (size_t)g->ncomp, nx = (size_t)n[0], ny = (size_t)n[1];
    grid_from_array(g, value, n, (size_t[3]){ncomp, ncomp * nx, ncomp * nx * ny});
}

/* A cell of eight samples: where it is, the place of a point in it, and the corners' first components where blocks hold them. */
typedef struct Cell {
    int at[3];
    double t[3];
    const float *corner[8];
} Cell;

/* The corners of a cell of more than one block. */
static void find_corners(const Grid *g, Cell *cell)
{
    const float *block[8];
    int known = 0; /* a bit for each of the blocks looked up, by the axes along which they are the next one */
    for (int c = 0; c < 8; c++) {
        int x = (cell->at[0] & 7) + (c & 1), y = (cell->at[1] & 7) + (c >> 1 & 1), z = (cell->at[2] & 7) + (c >> 2);
        int b = x >> 3 | y >> 3 << 1 | z >> 3 << 2;
        if (!(known >> b & 1)) block[b] = grid_block(g, cell->at[0] + (c & 1), cell->at[1] + (c >> 1 & 1), cell->at[2] + (c >> 2));
        known |= 1 << b;
        cell->corner[c] = block[b] ? block[b] + (z & 7) * 64 + (y & 7) * 8 + (x & 7) : NULL;
    }
}

/* The cell that holds an index-space point. False beyond all reach. */
static bool find_cell(const Grid *g, Vec3 p, Cell *cell)
{
    for (int a = 0; a < 3; a++) {
        double q = v_get(p, a), f = floor(q);
        if (!(f > -COORD_LIMIT && f < COORD_LIMIT - 1)) return false;
        cell->at[a] = (int)f;
        cell->t[a] = q - f;
    }
    int x = cell->at[0] & 7, y = cell->at[1] & 7, z = cell->at[2] & 7;
    if (x == 7 || y == 7 || z == 7) {
        find_corners(g, cell);
        return true;
    }
    const float *block = grid_block(g, cell->at[0], cell->at[1], cell->at[2]), *first = block ? block + z * 64 + y * 8 + x : NULL;
    for (int c = 0; c < 8; c++) cell->corner[c] = block ? first + (c >> 2) * 64 + (c >> 1 & 1) * 8 + (c & 1) : NULL;
    return true;
}

/* Trilinear in component k. */
static double cell_value(const Grid *g, const Cell *cell, int k)
{
    const double *t = cell->t;
    double out = 0;
    for (int c = 0; c < 8; c++) {
        int dx = c & 1, dy = c >> 1 & 1, dz = c >> 2;
        float v = cell->corner[c] ? cell->corner[c][k * GRID_CELLS] : grid_at(g, cell->at[0] + dx, cell->at[1] + dy, cell->at[2] + dz, k);
        out += (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]) * (double)v;
    }
    return out;
}

Vec3 grid_vector(const Grid *g, Vec3 world)
{
    ASSERT(g->ncomp == 3);
    Vec3 p = affine_to_index(&g->xform, world), v = vec3(0, 0, 0);
    Cell cell;
    bool found = !g->staggered && find_cell(g, p, &cell);
    for (int k = 0; k < 3; k++) {
        if (g->staggered) { /* component k of a MAC grid is stored half a voxel towards -k of its sample */
            Vec3 q = p;
            v_set(&q, k, v_get(p, k) + 0.5);
            found = find_cell(g, q, &cell);
        }
        v_set(&v, k, found ? cell_value(g, &cell, k) : (double)g->background[k]);
    }
    return v;
}

double grid_scalar(const Grid *g, Vec3 world)
{
    Cell cell;
    return find_cell(g, affine_to_index(&g->xform, world), &cell) ? cell_value(g, &cell, 0) : (double)g->background[0];
}
