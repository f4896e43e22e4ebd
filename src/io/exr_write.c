/* A grid as OpenEXR slices. Rows are stored as they are; a row is a chunk. */
#include "io/bytes.h"
#include "io/exr_priv.h"
#include "io/volume_write_priv.h"

enum { PARTS_MAX = 16384 };

static int64_t put_bytes(exr_const_context_t context, void *user, const void *data, uint64_t size, uint64_t at, exr_stream_error_func_ptr_t error)
{
    (void)context, (void)error;
    OutFile *f = user;
    if (fseeko(f->stream, (off_t)at, SEEK_SET) != 0 || fwrite(data, 1, size, f->stream) != size) return -1;
    return (int64_t)size;
}

/* Its words go nowhere: outfile_fail says what the disk said. */
static void say_nothing(exr_const_context_t context, exr_result_t code, const char *text)
{
    (void)context, (void)code, (void)text;
}

bool exr_begin(exr_context_t *c, OutFile *f, Err *err)
{
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    how.user_data = f;
    how.write_fn = put_bytes;
    how.error_handler_fn = say_nothing;
    return exr_start_write(c, f->path, EXR_WRITE_FILE_DIRECTLY, &how) == EXR_ERR_SUCCESS || outfile_fail(f, err);
}

/* Where the samples are, as the reader wants to know it: in the first part. */
static bool add_place(exr_context_t c, const Affine *xform)
{
    const exr_attr_v3d_t spacing = {.x = xform->m[0][0], .y = xform->m[1][1], .z = xform->m[2][2]};
    const exr_attr_v3d_t origin = {.x = xform->t.x, .y = xform->t.y, .z = xform->t.z};
    return exr_attr_set_v3d(c, 0, "spacing", &spacing) == EXR_ERR_SUCCESS && exr_attr_set_v3d(c, 0, "origin", &origin) == EXR_ERR_SUCCESS;
}

static bool add_parts(exr_context_t c, const Affine *xform, const int n[3])
{
    bool ok = true;
    for (int z = 0; ok && z < n[2]; z++) {
        char name[16];
        int part;
        snprintf(name, sizeof name, "z%04d", z);
        ok = exr_add_part(c, name, EXR_STORAGE_SCANLINE, &part) == EXR_ERR_SUCCESS &&
             exr_initialize_required_attr_simple(c, part, n[0], n[1], EXR_COMPRESSION_NONE) == EXR_ERR_SUCCESS &&
             exr_add_channel(c, part, "phi", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1) == EXR_ERR_SUCCESS;
    }
    return ok && add_place(c, xform) && exr_write_header(c) == EXR_ERR_SUCCESS;
}

static bool add_rows(exr_context_t c, const Grid *g, const int n[3])
{
    float *row = NEW(float, n[0]);
    uint8_t *bytes = NEW(uint8_t, 4 * (size_t)n[0]);
    bool ok = true;
    for (int z = 0; ok && z < n[2]; z++)
        for (int y = 0; ok && y < n[1]; y++) {
            volume_row(g, g->lo[1] + y, g->lo[2] + z, row);
            for (int x = 0; x < n[0]; x++) put_f32(bytes + 4 * x, row[x]);
            ok = exr_write_scanline_chunk(c, z, y, bytes, 4 * (uint64_t)n[0]) == EXR_ERR_SUCCESS;
        }
    mem_free(row);
    mem_free(bytes);
    return ok;
}

bool exr_write(OutFile *f, const Grid *g, Err *err)
{
    int n[3];
    for (int a = 0; a < 3; a++) n[a] = g->hi[a] - g->lo[a] + 1;
    if (n[2] > PARTS_MAX) return fail(err, ERR_OUTPUT, "%.800s: an .exr has at most %d slices; write .vdb", f->path, PARTS_MAX);
    exr_context_t c;
    if (!exr_begin(&c, f, err)) return false;
    bool ok = add_parts(c, &g->xform, n) && add_rows(c, g, n);
    if (!ok) outfile_fail(f, err);
    bool finished = exr_finish(&c) == EXR_ERR_SUCCESS;
    return ok && (finished || outfile_fail(f, err));
}
