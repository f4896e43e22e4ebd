/* What is told of glTF files: of sound ones, of every prefix of one, and of changed ones, which must do no harm. */
#include "io/bytes.h"
#include "io/gltf_info.h"

#include <setjmp.h>
#include <stdarg.h>
#include "temp_dir.h"
#include <cmocka.h>

static const char TEXT[] =
    "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{},{},{}],\"accessors\":["
    "{\"count\":12},{\"count\":30,\"min\":[-1,0,2],\"max\":[1,3,4]},{\"count\":7,\"min\":[0,-5,2.5],\"max\":[0.5,1,3]},{\"count\":2,\"max\":[0.25]},{\"count\":9}],"
    "\"meshes\":[{\"primitives\":[{\"indices\":0,\"attributes\":{\"POSITION\":1,\"_ID\":4,\"NORMAL\":1},\"targets\":[{},{}]}]},"
    "{\"primitives\":[{\"indices\":0,\"attributes\":{\"POSITION\":1},\"targets\":[{}]}]},"
    "{\"primitives\":[{\"attributes\":{\"POSITION\":4}},{\"indices\":2,\"attributes\":{\"POSITION\":2}}]}],"
    "\"animations\":[{\"samplers\":[{\"input\":3},{\"input\":99}]}]}";

static void expect_told(const char *path, bool binary)
{
    GltfInfo g;
    Err err = {0};
    if (!gltf_info_read(path, &g, &err)) fail_msg("%s", err.text);
    assert_int_equal(g.binary, binary);
    assert_true(g.nodes == 3 && g.meshes == 3 && g.nrun == 3);
    assert_true(g.run[0].vertices == 30 && g.run[0].triangles == 4 && g.run[0].pieces == 2 && g.run[0].targets == 3);
    assert_true(g.run[1].vertices == 9 && g.run[1].triangles == 3 && g.run[2].vertices == 7 && g.run[2].triangles == 2);
    assert_true(g.has_bounds && g.lo[0] == -1 && g.lo[1] == -5 && g.lo[2] == 2 && g.hi[1] == 3 && g.hi[2] == 4);
    assert_true(g.seconds == 0.25);
    assert_string_equal(g.attributes, "NORMAL POSITION _ID");
    gltf_info_free(&g);
}

/* The text in a binary file; returns its length. */
static size_t binary_of(uint8_t *to, const char *text, uint32_t n)
{
    memcpy(to, "glTF", 4);
    put_u32(to + 4, 2);
    put_u32(to + 8, 20 + n);
    put_u32(to + 12, n);
    memcpy(to + 16, "JSON", 4);
    memcpy(to + 20, text, n);
    return 20 + n;
}

static void tells_of_both_kinds(void **state)
{
    (void)state;
    uint8_t b[sizeof TEXT + 20];
    expect_told(temp_write("a.gltf", TEXT, sizeof TEXT - 1), false);
    expect_told(temp_write("a.glb", b, binary_of(b, TEXT, sizeof TEXT - 1)), true);
}

static void refuses_every_prefix(void **state)
{
    (void)state;
    uint8_t b[sizeof TEXT + 20];
    size_t size = binary_of(b, TEXT, sizeof TEXT - 1);
    for (size_t n = 0; n < size; n++) {
        GltfInfo g;
        Err err = {0};
        assert_false(gltf_info_read(temp_write("a.glb", b, n), &g, &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_null(g.run);
    }
}

static void changed_files_do_no_harm(void **state)
{
    (void)state;
    static const char bytes[] = "0-9[]{}\",:e\xff";
    uint64_t seed = 5;
    for (int i = 0; i < 3000; i++) {
        uint8_t b[sizeof TEXT + 20];
        size_t size = binary_of(b, TEXT, sizeof TEXT - 1);
        for (int k = 0; k < 2; k++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            b[(seed >> 33) % size] = (uint8_t)bytes[(seed >> 20) % (sizeof bytes - 1)];
        }
        GltfInfo g;
        Err err = {0};
        if (gltf_info_read(temp_write("a.glb", b, size), &g, &err)) gltf_info_free(&g);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tells_of_both_kinds),
        cmocka_unit_test(refuses_every_prefix),
        cmocka_unit_test(changed_files_do_no_harm),
    };
    return cmocka_run_group_tests_name("gltf_info", tests, temp_open, temp_close);
}
