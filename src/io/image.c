#include "io/image.h"

#include "base/thread.h"
#include "io/exr_priv.h"

#include <string.h>

/* Blocks packed at a time. Bounds the memory, does not change the bytes. */
enum { BATCH = 32, NAME_MOST = 31, ZIP_LEVEL = 4 };

struct ImageFile {
    OutFile out;
    exr_context_t core;
    int width, height, nchannel, row; /* row: the next one */
    char (*name)[NAME_MOST + 1];      /* [nchannel] */
    exr_encode_pipeline_t block[BATCH];
    exr_result_t result[BATCH];
};

/* --- header ------------------------------------------------------------------------------------------ */

static exr_pixel_type_t pixel_type(ImageType type)
{
    return type == IMAGE_HALF ? EXR_PIXEL_HALF : type == IMAGE_FLOAT ? EXR_PIXEL_FLOAT : EXR_PIXEL_UINT;
}

static bool put_header(ImageFile *f, const ImageChannel *channel)
{
    int part;
    bool ok = exr_add_part(f->core, "image", EXR_STORAGE_SCANLINE, &part) == EXR_ERR_SUCCESS &&
              exr_initialize_required_attr_simple(f->core, part, f->width, f->height, EXR_COMPRESSION_ZIP) == EXR_ERR_SUCCESS &&
              exr_set_zip_compression_level(f->core, part, ZIP_LEVEL) == EXR_ERR_SUCCESS;
    for (int c = 0; ok && c < f->nchannel; c++)
        ok = exr_add_channel(f->core, part, channel[c].name, pixel_type(channel[c].type), EXR_PERCEPTUALLY_LINEAR, 1, 1) ==
             EXR_ERR_SUCCESS;
    return ok && exr_write_header(f->core) == EXR_ERR_SUCCESS;
}

ImageFile *image_open(const char *path, int width, int height, int nchannel, const ImageChannel *channel, Err *err)
{
    ASSERT(width > 0 && height > 0 && nchannel > 0);
    ImageFile *f = NEW0(ImageFile, 1);
    if (!outfile_open(&f->out, path, err) || !exr_begin(&f->core, &f->out, err)) {
        image_abort(f);
        return NULL;
    }
    f->width = width;
    f->height = height;
    f->nchannel = nchannel;
    f->name = mem_zero((size_t)nchannel, sizeof *f->name);
    for (int c = 0; c < nchannel; c++) {
        ASSERT(strlen(channel[c].name) <= NAME_MOST);
        memcpy(f->name[c], channel[c].name, strlen(channel[c].name));
    }
    if (put_header(f, channel)) return f;
    outfile_fail(&f->out, err);
    image_abort(f);
    return NULL;
}

/* --- rows -------------------------------------------------------------------------------------------- */

typedef struct PackJob {
    ImageFile *f;
    const void *const *plane; /* from row f->row on */
} PackJob;

/* The core sorts the channels by name. */
static const uint8_t *plane_named(const PackJob *job, const char *name)
{
    int c = 0;
    while (strcmp(job->f->name[c], name) != 0) c++;
    return job->plane[c];
}

static exr_result_t pack_block(const PackJob *job, exr_encode_pipeline_t *block, int row)
{
    ImageFile *f = job->f;
    exr_chunk_info_t chunk;
    exr_result_t r = exr_write_scanline_chunk_info(f->core, 0, f->row + row, &chunk);
    if (r == EXR_ERR_SUCCESS)
        r = block->context ? exr_encoding_update(f->core, 0, &chunk, block) : exr_encoding_initialize(f->core, 0, &chunk, block);
    if (r != EXR_ERR_SUCCESS) return r;
    for (int c = 0; c < f->nchannel; c++) {
        exr_coding_channel_info_t *to = &block->channels[c];
        to->user_bytes_per_element = 4;
        to->user_data_type = to->data_type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        to->user_pixel_stride = 4;
        to->user_line_stride = 4 * f->width;
        to->encode_from_ptr = plane_named(job, to->channel_name) + 4 * (size_t)row * (size_t)f->width;
    }
    r = exr_encoding_choose_default_routines(f->core, 0, block);
    block->write_fn = NULL; /* blocks are written in their order, by put_blocks */
    block->yield_until_ready_fn = NULL;
    return r == EXR_ERR_SUCCESS ? exr_encoding_run(f->core, 0, block) : r;
}

static void pack_blocks(void *ctx, int begin, int end)
{
    const PackJob *job = ctx;
    for (int b = begin; b < end; b++) job->f->result[b] = pack_block(job, &job->f->block[b], b * IMAGE_BLOCK);
}

static bool put_blocks(ImageFile *f, int nblock)
{
    bool ok = true;
    for (int b = 0; ok && b < nblock; b++) {
        const exr_encode_pipeline_t *block = &f->block[b];
        ok = f->result[b] == EXR_ERR_SUCCESS &&
             exr_write_scanline_chunk(f->core, 0, f->row + b * IMAGE_BLOCK, block->compressed_buffer, block->compressed_bytes) ==
                 EXR_ERR_SUCCESS;
    }
    return ok;
}

bool image_put_rows(ImageFile *f, int rows, const void *const *plane, Err *err)
{
    ASSERT(rows % IMAGE_BLOCK == 0 || f->row + rows == f->height);
    const void **from = NEW(const void *, f->nchannel);
    bool ok = true;
    for (int at = 0; ok && at < rows; at += BATCH * IMAGE_BLOCK) {
        int n = int_min(rows - at, BATCH * IMAGE_BLOCK), nblock = (n + IMAGE_BLOCK - 1) / IMAGE_BLOCK;
        for (int c = 0; c < f->nchannel; c++) from[c] = (const uint8_t *)plane[c] + 4 * (size_t)at * (size_t)f->width;
        parallel_for(nblock, 1, pack_blocks, &(PackJob){f, from});
        ok = put_blocks(f, nblock);
        f->row += n;
    }
    mem_free(from);
    return ok || outfile_fail(&f->out, err);
}

/* --- end --------------------------------------------------------------------------------------------- */

/* Frees all but what the file is written through. */
static bool finish(ImageFile *f)
{
    for (int b = 0; b < BATCH; b++)
        if (f->block[b].context) exr_encoding_destroy(f->core, &f->block[b]);
    mem_free(f->name);
    return !f->core || exr_finish(&f->core) == EXR_ERR_SUCCESS;
}

bool image_close(ImageFile *f, Err *err)
{
    ASSERT(f->row == f->height);
    bool ok = finish(f) || outfile_fail(&f->out, err);
    if (ok) ok = outfile_commit(&f->out, err);
    else outfile_abort(&f->out);
    mem_free(f);
    return ok;
}

void image_abort(ImageFile *f)
{
    finish(f);
    outfile_abort(&f->out);
    mem_free(f);
}
