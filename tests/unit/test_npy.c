/* .npy files: orders, types, versions, damaged headers; and how a surface is chosen. */
#include "io/io_priv.h"
#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static const VolumeRequest PLAIN = {0};

/* A file of version 1, 2 or 3 with this header, padded as numpy pads it. */
static size_t build(uint8_t *to, int version, const char *dict, const void *data, size_t size)
{
    size_t n = strlen(dict), lead = version == 1 ? 10 : 12, total = (lead + n + 1 + 63) / 64 * 64, length = total - lead;
    memcpy(to, "\x93NUMPY", 6);
    to[6] = (uint8_t)version;
    to[7] = 0;
    for (size_t i = 8; i < lead; i++) to[i] = (uint8_t)(length >> 8 * (i - 8));
    memset(to + lead, ' ', length);
    memcpy(to + lead, dict, n);
    to[total - 1] = '\n';
    memcpy(to + total, data, size);
    return total + size;
}

static const char *write_npy(int version, const char *dict, const void *data, size_t size)
{
    static uint8_t file[8192];
    return temp_write("a.npy", file, build(file, version, dict, data, size));
}

static void expect_refused(const char *path, const char *word)
{
    Volume v;
    Err err = {0};
    assert_false(volume_read(path, &PLAIN, &v, &err));
    assert_int_equal(err.code, ERR_INPUT);
    if (!strstr(err.text, word)) fail_msg("'%s' is not in: %s", word, err.text);
    assert_null(v.surface.value);
}

static void both_orders_give_the_same_grid(void **state)
{
    (void)state;
    enum { X = 9, Y = 2, Z = 11 };
    static float c[X * Y * Z], fortran[X * Y * Z];
    for (int x = 0; x < X; x++)
        for (int y = 0; y < Y; y++)
            for (int z = 0; z < Z; z++) c[(x * Y + y) * Z + z] = fortran[x + X * (y + Y * z)] = (float)(x + 100 * y + 1000 * z) - 3000;
    Volume a, b;
    Err err = {0};
    const char *path = write_npy(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (9, 2, 11), }", c, sizeof c);
    assert_true(volume_read(path, &PLAIN, &a, &err));
    path = write_npy(1, "{'descr': '<f4', 'fortran_order': True, 'shape': (9, 2, 11), }", fortran, sizeof fortran);
    assert_true(volume_read(path, &PLAIN, &b, &err));
    assert_int_equal(a.surface.nblock, b.surface.nblock);
    assert_memory_equal(a.surface.value, b.surface.value, (size_t)a.surface.nblock * GRID_CELLS * sizeof(float));
    assert_true(grid_at(&a.surface, 8, 1, 10, 0) == 7108 && grid_at(&a.surface, 1, 0, 0, 0) == -2999);
    assert_int_equal(a.kind, VOLUME_LEVEL_SET);
    volume_free(&a);
    volume_free(&b);
}

static void reads_types_versions_and_spellings(void **state)
{
    (void)state;
    static const struct {
        int version;
        const char *dict;
        uint8_t bytes[8];
        size_t size;
    } cases[] = {
        {1, "{'descr': '<f2', 'fortran_order': False, 'shape': (1, 1, 1), }", {0x00, 0xc1}, 2},
        {2, "{'descr': '>f2', 'fortran_order': True, 'shape': (1, 1, 1), }", {0xc1, 0x00}, 2},
        {3, "{'shape': (1, 1, 1), 'descr': '<f4', 'fortran_order': False}", {0, 0, 0x20, 0xc0}, 4},
        {1, "{\"descr\":\">f4\",\"fortran_order\":False,\"shape\":(1,1,1)}", {0xc0, 0x20, 0, 0}, 4},
        {1, "{'descr': '<f8', 'fortran_order': False, 'shape': (1L, 1L, 1L), }", {0, 0, 0, 0, 0, 0, 0x04, 0xc0}, 8},
        {2, "{'descr': '>f8', 'fortran_order': False, 'shape': (1, 1, 1,), }", {0xc0, 0x04, 0, 0, 0, 0, 0, 0}, 8},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Volume v;
        Err err = {0};
        if (!volume_read(write_npy(cases[i].version, cases[i].dict, cases[i].bytes, cases[i].size), &PLAIN, &v, &err)) fail_msg("%s", err.text);
        assert_true(grid_at(&v.surface, 0, 0, 0, 0) == -2.5f);
        assert_int_equal(v.name[0], 0);
        volume_free(&v);
    }
}

static void refuses_every_prefix_and_longer_files(void **state)
{
    (void)state;
    static uint8_t file[1024];
    float data[8] = {0};
    for (int version = 1; version <= 2; version++) {
        size_t n = build(file, version, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2), }", data, sizeof data);
        for (size_t k = 0; k < n; k++) expect_refused(temp_write("a.npy", file, k), ": ");
        expect_refused(temp_write("a.npy", file, n + 1), "do not fit");
    }
}

static void refuses_damaged_headers(void **state)
{
    (void)state;
    static const char *const damaged[] = {
        "", "{", "}", "{}", "None", "{'descr': '<f4'}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2)",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2)} x",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2), 'more': 1}",
        "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2)}",
        "{'descr': '<f4', 'fortran_order': 0, 'shape': (2, 2, 2)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, -2)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, , 2)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2 2 2)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 99999999999999999999999)}",
        "{'descr': '<f4' 'fortran_order': False, 'shape': (2, 2, 2)}",
        "{'descr': '<f4, 'fortran_order': False, 'shape': (2, 2, 2)}",
        "{'descr': 'a\\'b', 'fortran_order': False, 'shape': (2, 2, 2)}",
        "{'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa': 1}",
    };
    float data[8] = {0};
    for (size_t i = 0; i < sizeof damaged / sizeof *damaged; i++)
        expect_refused(write_npy(1, damaged[i], data, sizeof data), "header is damaged");
    static uint8_t file[1024];
    size_t n = build(file, 1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2)}", data, sizeof data);
    file[30] = 0;
    expect_refused(temp_write("a.npy", file, n), "header is damaged");
    file[6] = 4;
    expect_refused(temp_write("a.npy", file, n), "version");
    file[0] = 'x';
    expect_refused(temp_write("a.npy", file, n), "no .npy");
}

static void refuses_what_is_no_volume(void **state)
{
    (void)state;
    static const struct {
        const char *dict, *word;
    } cases[] = {
        {"{'descr': '<i4', 'fortran_order': False, 'shape': (2, 2, 2)}", "'<i4'"},
        {"{'descr': '|f4', 'fortran_order': False, 'shape': (2, 2, 2)}", "'|f4'"},
        {"{'descr': '<f16', 'fortran_order': False, 'shape': (2, 2, 2)}", "'<f16'"},
        {"{'descr': '', 'fortran_order': False, 'shape': (2, 2, 2)}", "type"},
        {"{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2, 2, 2)}", "records"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (8,)}", "1 dimensions"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': ()}", "0 dimensions"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 2, 1)}", "4 dimensions"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 0, 2)}", "no volume"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2, 3)}", "do not fit"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (1048576, 1048576, 1048576)}", "do not fit"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (4294967298, 2, 2)}", "longer"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (900000000000000000, 2, 2)}", "longer"},
    };
    float data[8] = {0};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        expect_refused(write_npy(1, cases[i].dict, data, sizeof data), cases[i].word);
    const uint8_t huge[] = "\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'";
    expect_refused(temp_write("a.npy", huge, sizeof huge), "header is damaged");
}

static void expect_choice(VolumeClass kind, const char *name, float low, float high, bool below, double iso)
{
    Volume v = {.kind = kind};
    float two[2] = {low, high};
    snprintf(v.name, sizeof v.name, "%s", name);
    grid_init(&v.surface, 1);
    grid_from_dense(&v.surface, two, (int[3]){2, 1, 1});
    SurfaceChoice c = volume_choose_surface(&v, NAN, 0);
    assert_true(c.spec.inside_below == below && c.spec.iso == iso);
    assert_non_null(strstr(c.why, below ? "below" : "above"));
    assert_non_null(strstr(c.why, "--iso and --inside"));
    assert_non_null(strstr(c.why, name));
    c = volume_choose_surface(&v, 0.25, below ? 1 : -1);
    assert_true(c.spec.inside_below == !below && c.spec.iso == 0.25);
    c = volume_choose_surface(&v, NAN, 1);
    assert_true(!c.spec.inside_below && c.spec.iso == iso);
    grid_free(&v.surface);
}

static void chooses_the_surface(void **state)
{
    (void)state;
    expect_choice(VOLUME_LEVEL_SET, "density", 0, 1, true, 0); /* the class decides */
    expect_choice(VOLUME_DENSITY, "phi", -1, 1, false, 0.1);
    expect_choice(VOLUME_UNKNOWN, "phi", 0, 1, true, 0);       /* then the name */
    expect_choice(VOLUME_UNKNOWN, "Density", -1, 1, false, 0.1);
    expect_choice(VOLUME_UNKNOWN, "", -1, 1, true, 0);         /* then the values */
    expect_choice(VOLUME_UNKNOWN, "thing", 0, 1, false, 0.1);
    expect_choice(VOLUME_UNKNOWN, "thing", -2, -1, false, 0.1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_orders_give_the_same_grid),        cmocka_unit_test(reads_types_versions_and_spellings),
        cmocka_unit_test(refuses_every_prefix_and_longer_files), cmocka_unit_test(refuses_damaged_headers),
        cmocka_unit_test(refuses_what_is_no_volume),             cmocka_unit_test(chooses_the_surface),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
