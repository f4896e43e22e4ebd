/* Images of every type of channel, read again through OpenEXR's own decoder. */
#include "io/image.h"

#include "base/thread.h"

#include <OpenEXR/openexr.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

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

/* Each channel in full, 4 bytes a sample, in the order of `channel`. */
static void get(const char *path, void *const *plane)
{
    exr_context_t c;
    exr_attr_box2i_t box;
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    assert_int_equal(exr_start_read(&c, path, &how), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_data_window(c, 0, &box), EXR_ERR_SUCCESS);
    assert_int_equal(box.max.x, WIDTH - 1);
    assert_int_equal(box.max.y, HEIGHT - 1);
    exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
    for (int row = 0; row < HEIGHT; row += IMAGE_BLOCK) {
        exr_chunk_info_t chunk;
        assert_int_equal(exr_read_scanline_chunk_info(c, 0, row, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(chunk.compression, EXR_COMPRESSION_ZIP);
        if (row == 0) assert_int_equal(exr_decoding_initialize(c, 0, &chunk, &decode), EXR_ERR_SUCCESS);
        else assert_int_equal(exr_decoding_update(c, 0, &chunk, &decode), EXR_ERR_SUCCESS);
        assert_int_equal(decode.channel_count, CHANNELS);
        for (int i = 0; i < CHANNELS; i++) {
            exr_coding_channel_info_t *to = &decode.channels[i];
            int which = 0;
            while (strcmp(channel[which].name, to->channel_name) != 0) which++;
            to->user_bytes_per_element = 4;
            to->user_data_type = channel[which].type == IMAGE_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
            to->user_pixel_stride = 4;
            to->user_line_stride = 4 * WIDTH;
            to->decode_to_ptr = (uint8_t *)plane[which] + 4 * row * WIDTH;
            assert_int_equal(to->data_type == EXR_PIXEL_HALF, channel[which].type == IMAGE_HALF);
        }
        if (row == 0) assert_int_equal(exr_decoding_choose_default_routines(c, 0, &decode), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(c, 0, &decode), EXR_ERR_SUCCESS);
    }
    exr_decoding_destroy(c, &decode);
    exr_finish(&c);
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
    get(temp_path("a.exr"), out);
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
