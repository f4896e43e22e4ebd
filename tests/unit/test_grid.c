/* Grids: blocks, tiles, background; dense arrays; vectors, staggered ones too. */
#include "field/grid.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

static void sample_is_blocks_else_tiles_else_background(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    assert_true(grid_is_empty(&g));
    g.background[0] = 7;
    float *v = grid_add_block(&g, -8, 0, 136); /* in the tile of 128 below */
    for (int c = 0; c < GRID_CELLS; c++) v[c] = (float)c;
    grid_add_tile(&g, (GridTile){{8, 0, 0}, 3, {3, 0, 0}});
    grid_add_tile(&g, (GridTile){{-128, 0, 128}, 7, {4, 0, 0}});
    grid_add_tile(&g, (GridTile){{4096, -4096, 0}, 12, {5, 0, 0}});

    static const struct {
        int x, y, z;
        float want;
    } at[] = {
        {-8, 0, 136, 0}, {-7, 0, 136, 1}, {-8, 1, 136, 8}, {-8, 0, 137, 64}, {-1, 7, 143, 511},
        {8, 0, 0, 3}, {15, 7, 7, 3}, {16, 7, 7, 7}, {7, 0, 0, 7},
        {-128, 0, 128, 4}, {-9, 0, 136, 4}, {-1, 127, 255, 4}, {-129, 0, 128, 7}, {0, 0, 128, 7},
        {4096, -4096, 0, 5}, {8191, -1, 4095, 5}, {8192, -1, 4095, 7}, {4096, 0, 0, 7},
        {2000000, 0, 0, 7}, {0, -2000000000, 0, 7},
    };
    for (size_t i = 0; i < sizeof at / sizeof *at; i++)
        assert_true(grid_at(&g, at[i].x, at[i].y, at[i].z, 0) == at[i].want);
    assert_null(grid_block(&g, 8, 0, 0));
    assert_ptr_equal(grid_block(&g, -1, 7, 143), g.value);
    grid_free(&g);
}

static void block_is_added_once(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 3);
    for (int i = 0; i < 100; i++) grid_add_block(&g, 8 * i - 400, 0, 0)[0] = (float)i; /* grows on the way */
    assert_int_equal(g.nblock, 100);
    assert_true(grid_add_block(&g, -397, 5, 7)[0] == 0);
    assert_int_equal(g.nblock, 100);
    assert_true(grid_at(&g, 392, 0, 0, 0) == 99);
    assert_int_equal(g.origin[1][0], -392);
    assert_null(grid_add_block(&g, 1 << 20, 0, 0));
    assert_null(grid_add_block(&g, 0, 0, -(1 << 20)));
    assert_non_null(grid_add_block(&g, 0, (1 << 20) - 8, 0));
    grid_free(&g);
}

/* Whatever changes what a grid's samples are, or where, changes the digest. */
static void digest_tells_grids_apart(void **state)
{
    (void)state;
    Grid g[7];
    for (int i = 0; i < 7; i++) {
        grid_init(&g[i], 1);
        memset(grid_add_block(&g[i], i == 1 ? 16 : 8, 0, 0), 0, GRID_CELLS * sizeof(float));
        grid_add_tile(&g[i], (GridTile){{0, i == 2 ? 8 : 0, 0}, 3, {3, 0, 0}});
        g[i].hi[2] = 7;
    }
    g[3].value[511] = 1e-30f;
    g[4].background[0] = 1;
    g[5].hi[0] = 3;
    g[6].xform.t.x = 0.5;
    for (int i = 0; i < 7; i++)
        for (int j = 0; j < 7; j++) assert_int_equal(digest_is_same(grid_digest(&g[i]), grid_digest(&g[j])), i == j);
    for (int i = 0; i < 7; i++) grid_free(&g[i]);
}

static void dense_array_keeps_its_order(void **state)
{
    (void)state;
    enum { NX = 9, NY = 3, NZ = 10 };
    Grid g;
    grid_init(&g, 3);
    for (int k = 0; k < 3; k++) g.background[k] = -1;
    float v[3 * NX * NY * NZ];
    for (int i = 0; i < 3 * NX * NY * NZ; i++) v[i] = (float)i;
    grid_from_dense(&g, v, (int[3]){NX, NY, NZ});
    assert_int_equal(g.nblock, 4);
    assert_false(grid_is_empty(&g));
    assert_true(g.lo[0] == 0 && g.hi[0] == NX - 1 && g.hi[1] == NY - 1 && g.hi[2] == NZ - 1);
    for (int i = 0; i < 3 * NX * NY * NZ; i++)
        assert_true(grid_at(&g, i / 3 % NX, i / (3 * NX) % NY, i / (3 * NX * NY), i % 3) == (float)i);
    assert_true(grid_at(&g, NX, 0, 0, 0) == -1 && grid_at(&g, 0, NY, 0, 1) == -1 && grid_at(&g, -1, 0, 0, 2) == -1);
    grid_free(&g);
}

/* u(index) = c + A index: what trilinear interpolation keeps exactly; dyadic numbers keep the floats exact. */
static Vec3 linear(Vec3 p)
{
    return vec3(1 + 0.5 * p.x - 0.25 * p.y + p.z, 2 - p.x + 0.125 * p.y, 0.5 * p.x + 2 * p.y - 0.75 * p.z);
}

static void linear_vectors_are_exact(void **state)
{
    (void)state;
    for (int staggered = 0; staggered < 2; staggered++) {
        enum { N = 10 };
        static float v[3 * N * N * N];
        for (int i = 0; i < N * N * N; i++)
            for (int k = 0; k < 3; k++) {
                Vec3 p = vec3(i % N, i / N % N, i / (N * N));
                if (staggered) v_set(&p, k, v_get(p, k) - 0.5);
                v[3 * i + k] = (float)v_get(linear(p), k);
            }
        Grid g;
        grid_init(&g, 3);
        grid_from_dense(&g, v, (int[3]){N, N, N});
        g.staggered = staggered;
        g.xform = (Affine){.m = {{0.5, 0, 0}, {0, 0.25, 0.125}, {0, 0, 2}}, .t = {10, -3, 1}};
        assert_true(affine_invert(&g.xform));
        static const Vec3 at[] = {{3, 4, 5}, {2.5, 3.25, 7.125}, {0, 0, 0}, {8, 8, 8}, {7.96875, 0.5, 6.75}};
        for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
            Vec3 got = grid_vector(&g, affine_to_world(&g.xform, at[i])), want = linear(at[i]);
            assert_true(v_dist(got, want) == 0);
        }
        assert_true(v_len(grid_vector(&g, affine_to_world(&g.xform, vec3(-3, 4, 5)))) == 0);
        assert_true(v_len(grid_vector(&g, vec3(1e300, NAN, 0))) == 0);
        grid_free(&g);
    }
}

static void scalar_fades_into_the_background(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    g.background[0] = 2;
    grid_from_dense(&g, (float[2]){4, 8}, (int[3]){2, 1, 1});
    assert_true(grid_scalar(&g, vec3(0.25, 0, 0)) == 5);
    assert_true(grid_scalar(&g, vec3(1, 0.5, 0)) == 5);
    assert_true(grid_scalar(&g, vec3(-0.5, 0, 0)) == 3);
    assert_true(grid_scalar(&g, vec3(100, 100, 1e9)) == 2);
    grid_free(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sample_is_blocks_else_tiles_else_background),
        cmocka_unit_test(block_is_added_once),
        cmocka_unit_test(digest_tells_grids_apart),
        cmocka_unit_test(dense_array_keeps_its_order),
        cmocka_unit_test(linear_vectors_are_exact),
        cmocka_unit_test(scalar_fades_into_the_background),
    };
    return cmocka_run_group_tests_name("grid", tests, NULL, NULL);
}
