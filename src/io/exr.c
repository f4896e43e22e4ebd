/* exr.c: a grid as OpenEXR slices: a file of several parts, each a z-slice, in the file's order; or one image with the
 * slices below one another and an integer-vector attribute `dims` (samples in x, y, z). Columns are x, lines are y from
 * the top; channels are grids. Attributes `spacing` and `origin` (vectors of floats or doubles), where they are there,
 * place the samples.
 *
 * The library is OpenEXR's C core. What it may allocate at a time is bounded by the file's length. */
#include "io/io_priv.h"

#include <OpenEXR/openexr.h>

#include <string.h>

/* Of zip, the most that any of the codecs without loss can. */
enum { RATIO_MAX = 1032, ALLOCATION_FREE = 1 << 24 };

typedef struct ExrFile {
    VolumeFile base;
    exr_context_t core;
    int64_t length, most; /* bytes: of the file; what it may unpack to */
    int width, height, nslice; /* of an image of a part; parts, or images stacked in one */
    int n[3];
    Affine xform;
} ExrFile;

/* The core has no way to hand these through. A file is read by one thread. */
static _Thread_local size_t allocation_most;
static _Thread_local char core_said[200];

static void *core_alloc(size_t size) { return size > allocation_most ? NULL : mem_alloc(size, 1); }

static void core_says(exr_const_context_t core, exr_result_t code, const char *text)
{
    (void)core;
    (void)code;
    snprintf(core_said, sizeof core_said, "%.190s", text);
}

static bool exr_fail(const VolumeFile *f, Err *err)
{
    return fail(err, ERR_INPUT, "%.600s: cannot be read as OpenEXR (%s); write or copy the file again", f->path, core_said);
}

static void set_limits(const ExrFile *exr)
{
    allocation_most = exr->most < ALLOCATION_FREE ? ALLOCATION_FREE : (size_t)exr->most;
    snprintf(core_said, sizeof core_said, "it is damaged");
}

/* --- what the header says ----------------------------------------------------------------------- */

static bool is_image(const ExrFile *exr, int part, int *width, int *height)
{
    exr_storage_t storage;
    exr_attr_box2i_t box;
    if (exr_get_storage(exr->core, part, &storage) != EXR_ERR_SUCCESS || storage != EXR_STORAGE_SCANLINE) return false;
    if (exr_get_data_window(exr->core, part, &box) != EXR_ERR_SUCCESS) return false;
    int64_t w = (int64_t)box.max.x - box.min.x + 1, h = (int64_t)box.max.y - box.min.y + 1;
    if (w < 1 || h < 1 || w > DENSE_SIDE_MAX || h > INT32_MAX) return false;
    *width = (int)w;
    *height = (int)h;
    return true;
}

static bool check_parts(ExrFile *exr, int count, Err *err)
{
    const char *path = exr->base.path;
    for (int p = 0; p < count; p++) {
        int w = 0, h = 0;
        if (!is_image(exr, p, &w, &h))
            return fail(err, ERR_INPUT, "%.600s: part %d is no flat scanline image of at most %d columns; write slices as scanlines", path, p, DENSE_SIDE_MAX);
        if (p == 0) exr->width = w, exr->height = h;
        if (w != exr->width || h != exr->height)
            return fail(err, ERR_INPUT, "%.600s: part %d has %d x %d pixels, part 0 %d x %d; slices of one size are needed", path, p, w, h, exr->width, exr->height);
    }
    return true;
}

/* One part, stacked slices: the attribute tells them apart. */
static bool check_dims(ExrFile *exr, Err *err)
{
    exr_attr_v3i_t dims;
    const char *path = exr->base.path;
    if (exr_attr_get_v3i(exr->core, 0, "dims", &dims) != EXR_ERR_SUCCESS)
        return fail(err, ERR_INPUT, "%.600s: is one image without a vector of integers `dims`; write a part for each z-slice, or stack the slices and add dims", path);
    bool fits = dims.x == exr->width && dims.y > 0 && dims.z > 0 && (int64_t)dims.y * dims.z == exr->height;
    if (!fits)
        return fail(err, ERR_INPUT, "%.600s: its `dims` of %d x %d x %d do not make its image of %d x %d pixels (nx, ny * nz)", path,
                    dims.x, dims.y, dims.z, exr->width, exr->height);
    exr->n[1] = dims.y;
    exr->n[2] = dims.z;
    return true;
}

static bool get_vector(const ExrFile *exr, const char *name, double v[3])
{
    exr_attr_v3d_t d;
    exr_attr_v3f_t f;
    if (exr_attr_get_v3d(exr->core, 0, name, &d) == EXR_ERR_SUCCESS) {
        v[0] = d.x, v[1] = d.y, v[2] = d.z;
    } else if (exr_attr_get_v3f(exr->core, 0, name, &f) == EXR_ERR_SUCCESS) {
        v[0] = (double)f.x, v[1] = (double)f.y, v[2] = (double)f.z;
    } else {
        return false;
    }
    return true;
}

static bool get_place(ExrFile *exr, Err *err)
{
    double spacing[3] = {1, 1, 1}, origin[3] = {0};
    get_vector(exr, "spacing", spacing);
    get_vector(exr, "origin", origin);
    for (int a = 0; a < 3; a++) {
        if (!(spacing[a] > 0 && spacing[a] <= 1e12))
            return fail(err, ERR_INPUT, "%.600s: its attribute `spacing` is no voxel size; write it again without", exr->base.path);
        exr->xform.m[a][a] = spacing[a];
        v_set(&exr->xform.t, a, origin[a]);
    }
    return true;
}

static bool get_channels(ExrFile *exr, int count, Err *err)
{
    static const char *const types[] = {"uint", "half", "float"};
    const exr_attr_chlist_t *list;
    if (exr_get_channels(exr->core, 0, &list) != EXR_ERR_SUCCESS) return exr_fail(&exr->base, err);
    for (int c = 0; c < list->num_channels; c++) {
        const exr_attr_chlist_entry_t *e = &list->entries[c];
        bool full = e->x_sampling == 1 && e->y_sampling == 1;
        volume_add_entry(&exr->base, e->name.str, e->pixel_type < 3 ? types[e->pixel_type] : "?", full && e->pixel_type < 3 ? 1 : 0);
    }
    /* two bytes a pixel at least */
    int64_t pixels = (int64_t)exr->width * exr->height; /* below 2^51 */
    if (pixels > exr->most / 2 / count)
        return fail(err, ERR_INPUT, "%.600s: %d images of %d x %d pixels cannot be in a file of %lld bytes; write or copy it again",
                    exr->base.path, count, exr->width, exr->height, (long long)exr->length);
    return true;
}

static bool exr_open(VolumeFile *f, Err *err)
{
    ExrFile *exr = (ExrFile *)f;
    InFile in;
    int count = 0;
    if (!infile_open(&in, f->path, err)) return false;
    infile_close(&in);
    exr->length = in.length;
    if (__builtin_mul_overflow(in.length, (int64_t)RATIO_MAX, &exr->most)) exr->most = INT64_MAX;
    set_limits(exr);
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    how.error_handler_fn = core_says;
    how.alloc_fn = core_alloc;
    how.free_fn = mem_free;
    if (exr_start_read(&exr->core, f->path, &how) != EXR_ERR_SUCCESS) return exr_fail(f, err);
    if (exr_get_count(exr->core, &count) != EXR_ERR_SUCCESS || count < 1) return exr_fail(f, err);
    if (!check_parts(exr, count, err)) return false;
    exr->nslice = count;
    exr->n[0] = exr->width;
    exr->n[1] = exr->height;
    exr->n[2] = count;
    if (count == 1 && !check_dims(exr, err)) return false;
    return get_place(exr, err) && get_channels(exr, count, err);
}

/* --- pixels ------------------------------------------------------------------------------------- */

/* Where the pipeline puts the channel's pixels of one chunk; the others are passed over. */
static bool aim(exr_decode_pipeline_t *pipe, const char *name, int width, void *to, bool *whole)
{
    for (int c = 0; c < pipe->channel_count; c++) {
        exr_coding_channel_info_t *ch = &pipe->channels[c];
        ch->decode_to_ptr = NULL;
        if (strcmp(ch->channel_name, name) != 0) continue;
        if (ch->width != width || ch->height != pipe->chunk.height) return false;
        *whole = ch->data_type == EXR_PIXEL_UINT;
        ch->user_data_type = *whole ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        ch->user_bytes_per_element = 4;
        ch->user_pixel_stride = 4;
        ch->user_line_stride = 4 * width;
        ch->decode_to_ptr = to;
        to = NULL;
    }
    if (to) snprintf(core_said, sizeof core_said, "a slice lacks the channel '%.100s'", name);
    return to == NULL;
}

/* Channel `name` of a part: width * height values to `value`. */
static bool read_part(const ExrFile *exr, int part, const char *name, float *value)
{
    exr_attr_box2i_t box;
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    bool ok = exr_get_data_window(exr->core, part, &box) == EXR_ERR_SUCCESS, begun = false;
    for (int done = 0; ok && done < exr->height;) {
        exr_chunk_info_t chunk;
        bool whole = false;
        float *to = value + (size_t)done * (size_t)exr->width;
        ok = exr_read_scanline_chunk_info(exr->core, part, box.min.y + done, &chunk) == EXR_ERR_SUCCESS;
        ok = ok && chunk.start_y == box.min.y + done && chunk.width == exr->width && chunk.height > 0 && chunk.height <= exr->height - done;
        ok = ok && (begun ? exr_decoding_update(exr->core, part, &chunk, &pipe)
                          : exr_decoding_initialize(exr->core, part, &chunk, &pipe)) == EXR_ERR_SUCCESS;
        if (!ok) break;
        ok = aim(&pipe, name, exr->width, to, &whole);
        if (ok && !begun) ok = exr_decoding_choose_default_routines(exr->core, part, &pipe) == EXR_ERR_SUCCESS;
        begun = true;
        ok = ok && exr_decoding_run(exr->core, part, &pipe) == EXR_ERR_SUCCESS;
        size_t n = (size_t)exr->width * (size_t)chunk.height;
        for (size_t i = 0; ok && whole && i < n; i++) {
            uint32_t u;
            memcpy(&u, &to[i], sizeof u);
            to[i] = (float)u;
        }
        done += chunk.height;
    }
    exr_decoding_destroy(exr->core, &pipe);
    return ok;
}

static bool exr_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    ExrFile *exr = (ExrFile *)f;
    int64_t total;
    set_limits(exr);
    if (!dense_count(f->path, exr->n, 1, &total, err) || !dense_place(f->path, f->request, &exr->xform, out, err)) return false;
    float *value = NEW(float, total);
    bool ok = true;
    for (int p = 0; ok && p < exr->nslice; p++)
        ok = read_part(exr, p, f->entry[i].name, value + (size_t)p * (size_t)exr->width * (size_t)exr->height);
    if (ok) grid_from_dense(out, value, exr->n);
    mem_free(value);
    return ok || exr_fail(f, err);
}

static void exr_close(VolumeFile *f)
{
    ExrFile *exr = (ExrFile *)f;
    if (exr->core) exr_finish(&exr->core);
}

const Format EXR_FORMAT = {"OpenEXR slices", ".exr", sizeof(ExrFile), exr_open, exr_read, exr_close};
