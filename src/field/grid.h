/* grid.h: samples of one frame as a file holds them, in plain C arrays: the hand-over from io to field.
 *
 * Samples sit at integer index coordinates; `xform` maps them to world units. Stored blocks of 8^3
 * samples (aligned to multiples of 8) come first, then constant tiles (cubes of 8, 128 or 4096
 * samples' side, or, in what came from no tree, none), then the background. A grid has 1 or 3 components.
 * Owned by whoever called grid_init; grid_free gives everything back. */
#pragma once
#include "base/base.h"
#include "base/digest.h"
#include "base/hash.h"
#include "base/vec.h"

enum { GRID_SIDE = 8, GRID_CELLS = 512 };

typedef struct GridTile {
    int lo[3];    /* a multiple of its side */
    int log2side; /* 3, 7 or 12 */
    float value[3];
} GridTile;

typedef struct Grid {
    Affine xform;
    int ncomp;            /* 1, or 3 for vectors */
    int staggered;        /* 3 components: component k sits half a voxel towards -k (a MAC grid) */
    int lo[3], hi[3];     /* the active bounding box, inclusive; lo > hi: nothing is active */
    bool narrow;          /* a narrow-band level set: only samples nearer to 0 than the background are active */
    float background[3];
    int nblock, capblock;
    int (*origin)[3];     /* [nblock] first sample of the block, a multiple of 8 */
    float *value;         /* [nblock][ncomp][512], x fastest: value[((b*ncomp + k)*8 + z)*64 + y*8 + x] */
    int ntile, captile;
    GridTile *tile;
    Map block_at;         /* by origin >> 3 */
    Map tile_at[3];       /* by lo >> log2side, for 3, 7, 12 */
} Grid;

void grid_init(Grid *g, int ncomp);
void grid_free(Grid *g);
bool grid_is_empty(const Grid *g);
/* Of all samples, and where they are. */
Digest128 grid_digest(const Grid *g);
/* Room for so many blocks in all, which need not come. */
void grid_reserve(Grid *g, int nblock);
/* A new block, or the one that is there already; NULL where the origin lies beyond +-2^20. */
float *grid_add_block(Grid *g, int x, int y, int z);
void grid_add_tile(Grid *g, GridTile tile);
/* The block's samples or NULL. Coordinates of any sample in it. */
const float *grid_block(const Grid *g, int x, int y, int z);
/* The value of component k at a sample (block, tile or background). */
float grid_at(const Grid *g, int x, int y, int z, int k);
/* Fills an empty grid from a dense array, x fastest, nx*ny*nz*ncomp values with the component fastest
 * of all; the active bounding box becomes the array's. */
void grid_from_dense(Grid *g, const float *value, const int n[3]);
/* The same from values that lie in another order: so many of them from one sample to the next along x, y and z. */
void grid_from_array(Grid *g, const float *value, const int n[3], const size_t step[3]);
/* The vector at a world point: trilinear, each component from its own place when staggered; zero beyond
 * the grid by way of the background. */
Vec3 grid_vector(const Grid *g, Vec3 world);
/* The scalar at a world point, trilinear. */
double grid_scalar(const Grid *g, Vec3 world);
