/* .raw files: types, orders, sizes. */
#include "io/io_priv.h"
#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static VolumeRequest request_of(int x, int y, int z, const char *type, const char *order)
{
    return (VolumeRequest){.raw_dims = {x, y, z}, .raw_type = type, .raw_order = order};
}

static void expect_refused(const char *path, VolumeRequest r, ErrCode code, const char *word)
{
    Volume v;
    Err err = {0};
    assert_false(volume_read(path, &r, &v, &err));
    assert_int_equal(err.code, code);
    assert_non_null(strstr(err.text, word));
    assert_null(v.surface.value);
}

static void reads_every_type(void **state)
{
    (void)state;
    static const struct {
        const char *type;
        uint8_t bytes[16];
        size_t size;
        float value[2];
    } cases[] = {
        {"u8", {0, 255}, 2, {0, 255}},
        {"i8", {0x80, 127}, 2, {-128, 127}},
        {"u16", {0x34, 0x12, 0xff, 0xff}, 4, {0x1234, 65535}},
        {"i16", {0x00, 0x80, 0xfe, 0xff}, 4, {-32768, -2}},
        {"f16", {0x00, 0x3c, 0x01, 0x80}, 4, {1, -0x1p-24f}},
        {"f16", {0x00, 0xc4, 0xff, 0x7b}, 4, {-4, 65504}},
        {"f32", {0, 0, 0x80, 0x3f, 0, 0, 0x20, 0xc0}, 8, {1, -2.5f}},
        {"f64", {0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0, 0, 0, 0, 0, 4, 0xc0}, 16, {1, -2.5f}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *path = temp_write("a.raw", cases[i].bytes, cases[i].size);
        VolumeRequest r = request_of(2, 1, 1, cases[i].type, NULL);
        Volume v;
        Err err = {0};
        assert_true(volume_read(path, &r, &v, &err));
        assert_true(grid_at(&v.surface, 0, 0, 0, 0) == cases[i].value[0]);
        assert_true(grid_at(&v.surface, 1, 0, 0, 0) == cases[i].value[1]);
        volume_free(&v);
    }
}

static void keeps_infinite_and_nan_samples(void **state)
{
    (void)state;
    const uint8_t bytes[] = {0x00, 0x7c, 0x00, 0xfc, 0x01, 0x7c};
    const char *path = temp_write("a.raw", bytes, sizeof bytes);
    VolumeRequest r = request_of(3, 1, 1, "f16", NULL);
    Volume v;
    Err err = {0};
    assert_true(volume_read(path, &r, &v, &err));
    assert_true(isinf(grid_at(&v.surface, 0, 0, 0, 0)) && grid_at(&v.surface, 0, 0, 0, 0) > 0);
    assert_true(isinf(grid_at(&v.surface, 1, 0, 0, 0)) && grid_at(&v.surface, 1, 0, 0, 0) < 0);
    assert_true(isnan(grid_at(&v.surface, 2, 0, 0, 0)));
    volume_free(&v);
}

static void places_samples_in_both_orders(void **state)
{
    (void)state;
    enum { X = 9, Y = 3, Z = 17 };
    static uint8_t xyz[X * Y * Z], zyx[X * Y * Z];
    for (int x = 0; x < X; x++)
        for (int y = 0; y < Y; y++)
            for (int z = 0; z < Z; z++) xyz[x + X * (y + Y * z)] = zyx[z + Z * (y + Y * x)] = (uint8_t)(x + 11 * y + 5 * z);
    for (int o = 0; o < 2; o++) {
        const char *path = temp_write("a.raw", o ? zyx : xyz, sizeof xyz);
        VolumeRequest r = request_of(X, Y, Z, "u8", o ? "zyx" : "xyz");
        Volume v;
        Err err = {0};
        assert_true(volume_read(path, &r, &v, &err));
        for (int x = 0; x < X; x++)
            for (int y = 0; y < Y; y++)
                for (int z = 0; z < Z; z++) assert_true(grid_at(&v.surface, x, y, z, 0) == (float)(uint8_t)(x + 11 * y + 5 * z));
        assert_int_equal(v.surface.hi[0], X - 1);
        assert_int_equal(v.surface.hi[2], Z - 1);
        volume_free(&v);
    }
}

static void applies_spacing_and_origin(void **state)
{
    (void)state;
    const uint8_t bytes[8] = {0};
    const char *path = temp_write("a.raw", bytes, sizeof bytes);
    VolumeRequest r = request_of(2, 2, 2, "u8", NULL);
    r.spacing[0] = 0.5, r.spacing[2] = 3;
    r.origin[1] = -7, r.has_origin = true;
    Volume v;
    Err err = {0};
    assert_true(volume_read(path, &r, &v, &err));
    Vec3 w = affine_to_world(&v.surface.xform, vec3(2, 2, 2)), i = affine_to_index(&v.surface.xform, w);
    assert_true(w.x == 1 && w.y == -5 && w.z == 6 && i.x == 2 && i.y == 2 && i.z == 2);
    volume_free(&v);
    r.spacing[1] = -1;
    expect_refused(path, r, ERR_USAGE, "--spacing");
    r.spacing[0] = r.spacing[1] = 1e-200;
    expect_refused(path, r, ERR_USAGE, "--spacing");
    r.spacing[1] = 1, r.origin[0] = INFINITY;
    expect_refused(path, r, ERR_USAGE, "--origin");
}

static void refuses_every_other_length(void **state)
{
    (void)state;
    static const uint8_t bytes[80] = {0};
    for (size_t n = 0; n <= sizeof bytes; n++)
        if (n != 4 * 3 * 3 * 2) expect_refused(temp_write("a.raw", bytes, n), request_of(3, 3, 2, "f32", NULL), ERR_INPUT, "do not fit");
}

static void refuses_impossible_requests(void **state)
{
    (void)state;
    const char *path = temp_write("a.raw", "12345678", 8);
    expect_refused(path, request_of(0, 0, 0, NULL, NULL), ERR_USAGE, "--dims");
    expect_refused(path, request_of(2, 0, 1, NULL, NULL), ERR_INPUT, "no volume");
    expect_refused(path, request_of(-2, -1, 1, NULL, NULL), ERR_INPUT, "no volume");
    expect_refused(path, request_of(INT32_MAX, INT32_MAX, INT32_MAX, "f64", NULL), ERR_INPUT, "longer");
    expect_refused(path, request_of(1 << 20, 1 << 20, 1 << 20, "f64", NULL), ERR_INPUT, "do not fit");
    expect_refused(path, request_of(2, 1, 1, "f33", NULL), ERR_USAGE, "--type");
    expect_refused(path, request_of(2, 1, 1, NULL, "yxz"), ERR_USAGE, "--order");
    expect_refused(temp_path("none.raw"), request_of(2, 1, 1, NULL, NULL), ERR_INPUT, "no such file");
    expect_refused(temp_dir, request_of(2, 1, 1, NULL, NULL), ERR_INPUT, "ending");
    expect_refused("/", request_of(2, 1, 1, NULL, NULL), ERR_INPUT, "ending");
    char name[600];
    snprintf(name, sizeof name, "%s/.", temp_dir);
    InFile in;
    Err err = {0};
    assert_false(infile_open(&in, name, &err));
    assert_non_null(strstr(err.text, "not a regular file"));
}

static void knows_files_by_their_ending(void **state)
{
    (void)state;
    assert_true(volume_is_known("a/b.vdb") && volume_is_known("B.NPY") && volume_is_known("x.0001.raw"));
    assert_false(volume_is_known("vdb") || volume_is_known("a.vdb.part") || volume_is_known(".vdb") ||
                 volume_is_known("dir/.raw") || volume_is_known("") || volume_is_known("a.ply"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_every_type),           cmocka_unit_test(keeps_infinite_and_nan_samples),
        cmocka_unit_test(places_samples_in_both_orders), cmocka_unit_test(applies_spacing_and_origin),
        cmocka_unit_test(refuses_every_other_length), cmocka_unit_test(refuses_impossible_requests),
        cmocka_unit_test(knows_files_by_their_ending),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
