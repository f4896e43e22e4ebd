/* Images of every type of channel, read again through OpenEXR's own decoder. */
#include "io/image.h"

#include "base/thread.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "read_image.h"
#include "temp_dir.h"

/* More than the rows that are packed at a time; the last block is not full. */
enum { WIDTH = 37, HEIGHT = 603, CHANNELS = 4 };

/* Not sorted by name. */
static const ImageChannel channel[CHANNELS] = {
    {"normal.X", IMAGE_FLOAT}, {"id.vertex", IMAGE_UINT}, {"Z", IMAGE_FLOAT}, {"G", IMAGE_HALF}};

static float *fill_reals(float first, float step)
{
    float *plane = NEW(float, WIDTH * HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) plane[i] = first + step * (float)i;
    return plane;
}

static uint32_t *fill_numbers(void)
{
    uint32_t *plane = NEW(uint32_t, WIDTH * HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) plane[i] = 4294967295u - 7u * (uint32_t)i;
    return plane;
}

static bool put(const char *path, int rows_at_a_time, const void *const *plane, Err *err)
{
    ImageFile *f = image_open(path, WIDTH, HEIGHT, CHANNELS, channel, err);
    for (int row = 0; f && row < HEIGHT; row += rows_at_a_time) {
        const void *from[CHANNELS];
        for (int c = 0; c < CHANNELS; c++) from[c] = (const uint8_t *)plane[c] + 4 * row * WIDTH;
        assert_true(image_put_rows(f, int_min(rows_at_a_time, HEIGHT - row), from, err));
    }
    return f && image_close(f, err);
}

static void comes_back(void **state)
{
    (void)state;
    Err err = {0};
    /* steps of G are halves exactly */
    void *out[CHANNELS], *in[CHANNELS] = {fill_reals(-3.7f, 1e-3f), fill_numbers(), fill_reals(1e9f, -77), fill_reals(-64, 0)};
    for (int i = 0; i < WIDTH * HEIGHT; i++) ((float *)in[3])[i] = (float)(i % 1000) / 8;
    for (int c = 0; c < CHANNELS; c++) out[c] = NEW0(float, WIDTH * HEIGHT);
    assert_true(put(temp_path("a.exr"), HEIGHT, (const void *const *)in, &err));
    read_image(temp_path("a.exr"), WIDTH, HEIGHT, CHANNELS, channel, out);
    for (int c = 0; c < CHANNELS; c++) {
        assert_memory_equal(in[c], out[c], 4 * WIDTH * HEIGHT);
        mem_free(in[c]);
        mem_free(out[c]);
    }
}

static bool is_same(const char *a, const char *b)
{
    FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
    assert_true(f && g);
    int x, y;
    do x = fgetc(f), y = fgetc(g);
    while (x == y && x != EOF);
    fclose(f);
    fclose(g);
    return x == y;
}

static void rows_by_and_by_are_the_same_bytes(void **state)
{
    (void)state;
    Err err = {0};
    void *in[CHANNELS] = {fill_reals(0, 0.25f), fill_numbers(), fill_reals(5, 0), fill_reals(0, 1)};
    assert_true(put(temp_path("a.exr"), HEIGHT, (const void *const *)in, &err));
    assert_true(put(temp_path("b.exr"), 3 * IMAGE_BLOCK, (const void *const *)in, &err));
    assert_true(is_same(temp_path("a.exr"), temp_path("b.exr")));
    for (int c = 0; c < CHANNELS; c++) mem_free(in[c]);
}

static void given_up_leaves_nothing(void **state)
{
    (void)state;
    Err err = {0};
    void *in[CHANNELS] = {fill_reals(0, 0.25f), fill_numbers(), fill_reals(5, 0), fill_reals(0, 1)};
    ImageFile *f = image_open(temp_path("gone.exr"), WIDTH, HEIGHT, CHANNELS, channel, &err);
    assert_true(image_put_rows(f, IMAGE_BLOCK, (const void *const *)in, &err));
    image_abort(f);
    assert_int_equal(access(temp_path("gone.exr"), F_OK), -1);
    assert_int_equal(access(temp_path("gone.exr.part"), F_OK), -1);
    assert_null(image_open(temp_path("no/such.exr"), WIDTH, HEIGHT, CHANNELS, channel, &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    for (int c = 0; c < CHANNELS; c++) mem_free(in[c]);
}

int main(void)
{
    thread_set_count(3);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(comes_back),
        cmocka_unit_test(rows_by_and_by_are_the_same_bytes),
        cmocka_unit_test(given_up_leaves_nothing),
    };
    int failed = cmocka_run_group_tests(tests, temp_open, temp_close);
    thread_shutdown();
    return failed;
}
