/* Volumes written and read again: the same samples, place and extent, bit by bit. */
#include "io/volume.h"
#include "io/volume_write.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "temp_dir.h"

/* Blocks, an inside tile, a bounding box that cuts blocks, and a voxel size that no binary number has. */
static Grid sample_grid(void)
{
    Grid g;
    grid_init(&g, 1);
    for (int a = 0; a < 3; a++) {
        g.xform.m[a][a] = 0.1;
        g.hi[a] = 29 - 3 * a;
    }
    affine_invert(&g.xform);
    g.xform.t = vec3(-1.3, 0.7, 1e-3);
    g.background[0] = 0.7f;
    for (int b = 0; b < 5; b++) {
        float *v = grid_add_block(&g, b == 4 ? 24 : 8 * (b & 1), b == 4 ? 24 : 8 * (b >> 1), b == 4 ? 16 : 0);
        for (int c = 0; c < GRID_CELLS; c++) v[c] = (float)(b - 0.01 * c) / 3;
    }
    grid_add_block(&g, g.hi[0], g.hi[1], g.hi[2]);
    grid_add_tile(&g, (GridTile){{16, 8, 8}, 3, {-2.5f, 0, 0}});
    return g;
}

static void read_again(const char *name, const VolumeRequest *request)
{
    Grid g = sample_grid();
    Volume v;
    Err err = {0};
    const char *path = temp_path(name);
    assert_true(volume_write(path, &g, &err));
    if (!volume_read(path, request, &v, &err)) print_message("%s\n", err.text);
    assert_int_equal(err.code, ERR_NONE);
    assert_int_equal(v.kind, VOLUME_LEVEL_SET);
    for (int a = 0; a < 3; a++) {
        assert_int_equal(v.surface.lo[a], g.lo[a]);
        assert_int_equal(v.surface.hi[a], g.hi[a]);
        assert_true(v.surface.xform.m[a][a] == g.xform.m[a][a]);
        assert_true(v_get(v.surface.xform.t, a) == v_get(g.xform.t, a));
    }
    for (int z = 0; z <= g.hi[2]; z++)
        for (int y = 0; y <= g.hi[1]; y++)
            for (int x = 0; x <= g.hi[0]; x++) {
                float a = grid_at(&g, x, y, z, 0), b = grid_at(&v.surface, x, y, z, 0);
                assert_memory_equal(&a, &b, sizeof a);
            }
    volume_free(&v);
    grid_free(&g);
}

static void vdb_comes_back(void **state)
{
    (void)state;
    read_again("grid.vdb", &(VolumeRequest){0});
}

static void npy_comes_back(void **state)
{
    (void)state;
    read_again("grid.npy", &(VolumeRequest){.spacing = {0.1, 0.1, 0.1}, .has_origin = true, .origin = {-1.3, 0.7, 1e-3}});
}

static void exr_comes_back(void **state)
{
    (void)state;
    read_again("grid.exr", &(VolumeRequest){0});
}

static void what_cannot_be_written_is_said(void **state)
{
    (void)state;
    static const char *const names[] = {"no/grid.vdb", "no/grid.npy", "no/grid.exr"};
    Grid g = sample_grid();
    Err err;
    for (int i = 0; i < 3; i++) {
        assert_false(volume_write(temp_path(names[i]), &g, &err));
        assert_int_equal(err.code, ERR_OUTPUT);
        assert_non_null(strstr(err.text, names[i]));
    }
    assert_false(volume_write("grid.raw", &g, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_true(volume_can_write("A.VDB") && !volume_can_write(".vdb") && !volume_can_write("x/.npy"));
    g.hi[0] = g.hi[1] = g.hi[2] = 9999;
    assert_false(volume_write(temp_path("huge.npy"), &g, &err));
    assert_non_null(strstr(err.text, ".vdb"));
    grid_free(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vdb_comes_back),
        cmocka_unit_test(npy_comes_back),
        cmocka_unit_test(exr_comes_back),
        cmocka_unit_test(what_cannot_be_written_is_said),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
