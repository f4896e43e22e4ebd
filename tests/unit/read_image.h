/* read_image.h: an image of image.h read again by OpenEXR's own decoder. Behind cmocka.h. */
#pragma once
#include "io/image.h"

#include <OpenEXR/openexr.h>
#include <string.h>

/* Each channel in full, 4 bytes a sample, in the order of `channel`; asserts that the image is of that size, has these channels in
 * these types and no others, and is ZIP. plane: [nchannel][width * height], float, or uint32_t of an IMAGE_UINT channel. */
static void read_image(const char *path, int width, int height, int nchannel, const ImageChannel *channel, void *const *plane)
{
    exr_context_t c;
    exr_attr_box2i_t box;
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    assert_int_equal(exr_start_read(&c, path, &how), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_data_window(c, 0, &box), EXR_ERR_SUCCESS);
    assert_int_equal(box.max.x, width - 1);
    assert_int_equal(box.max.y, height - 1);
    exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
    for (int row = 0; row < height; row += IMAGE_BLOCK) {
        exr_chunk_info_t chunk;
        assert_int_equal(exr_read_scanline_chunk_info(c, 0, row, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(chunk.compression, EXR_COMPRESSION_ZIP);
        if (row == 0) assert_int_equal(exr_decoding_initialize(c, 0, &chunk, &decode), EXR_ERR_SUCCESS);
        else assert_int_equal(exr_decoding_update(c, 0, &chunk, &decode), EXR_ERR_SUCCESS);
        assert_int_equal(decode.channel_count, nchannel);
        for (int i = 0; i < nchannel; i++) {
            exr_coding_channel_info_t *to = &decode.channels[i];
            int which = 0;
            while (which < nchannel && strcmp(channel[which].name, to->channel_name) != 0) which++;
            assert_true(which < nchannel);
            ImageType type = channel[which].type;
            assert_int_equal(to->data_type, type == IMAGE_HALF ? EXR_PIXEL_HALF : type == IMAGE_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT);
            to->user_bytes_per_element = 4;
            to->user_data_type = type == IMAGE_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
            to->user_pixel_stride = 4;
            to->user_line_stride = 4 * width;
            to->decode_to_ptr = (uint8_t *)plane[which] + 4 * row * width;
        }
        if (row == 0) assert_int_equal(exr_decoding_choose_default_routines(c, 0, &decode), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(c, 0, &decode), EXR_ERR_SUCCESS);
    }
    exr_decoding_destroy(c, &decode);
    exr_finish(&c);
}
