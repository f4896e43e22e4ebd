#include "io/gltf_bytes_priv.h"

#include "io/bytes.h"

#include <stdio.h>
#include <string.h>

enum { STRIDE_MOST = 252, BLOCK = 1 << 16 };

bool gltf_refuse(const GltfBytes *b, const char *why, Err *err)
{
    return fail(err, ERR_INPUT, "%.600s: %s", b->path, why);
}

static bool damaged(const GltfBytes *b, Err *err)
{
    return gltf_refuse(
        b, "an accessor is not wholly in its buffer; the file is damaged or cut short, write or copy it again", err);
}

void gltf_bytes_init(GltfBytes *b, const char *path, const GltfJson *json)
{
    *b = (GltfBytes){.path = path, .json = json};
    b->nbuffer = (int)json_array_size(json_object_get(json->root, "buffers"));
    b->buffer = NEW0(GltfBuffer, b->nbuffer);
}

void gltf_bytes_free(GltfBytes *b)
{
    for (int i = 0; i < b->nbuffer; i++) {
        if (b->buffer[i].open) infile_close(&b->buffer[i].file);
        mem_free(b->buffer[i].path);
    }
    mem_free(b->buffer);
}

/* --- buffers -------------------------------------------------------------------------------------- */

static int hex(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : NONE;
}

/* The path of a URI beside the glTF; NULL for one that is no plain file name. The caller frees it. */
static char *path_beside(const char *gltf, const char *uri)
{
    const char *slash = strrchr(gltf, '/');
    size_t folder = slash ? (size_t)(slash - gltf) + 1 : 0, n = folder;
    char *path = NEW(char, folder + strlen(uri) + 1);
    memcpy(path, gltf, folder);
    for (const char *c = uri; *c; c++) {
        bool coded = c[0] == '%' && hex(c[1]) != NONE && hex(c[2]) != NONE;
        path[n] = coded ? (char)(16 * hex(c[1]) + hex(c[2])) : *c;
        if (path[n] == '/' || path[n] == 0) {
            mem_free(path);
            return NULL;
        }
        if (coded) c += 2;
        n++;
    }
    path[n] = 0;
    return path;
}

static bool open_buffer(GltfBytes *b, int i, Err *err)
{
    GltfBuffer *buffer = &b->buffer[i];
    const char *uri = json_string_value(json_object_get(gltf_at(json_object_get(b->json->root, "buffers"), i), "uri"));
    if (buffer->open) return true;
    if (uri && strncmp(uri, "data:", 5) == 0)
        return gltf_refuse(b, "its buffers stand in its JSON, which is not read; write it with a .bin file, or as .glb",
                           err);
    if (!uri && !b->json->chunk_bytes) return gltf_refuse(b, "a buffer is nowhere; write or copy the file again", err);
    buffer->path = uri ? path_beside(b->path, uri) : mem_text(b->path);
    if (!buffer->path) return gltf_refuse(b, "a buffer is no file beside it; only such are read", err);
    if (!infile_open(&buffer->file, buffer->path, err)) return false;
    buffer->open = true;
    buffer->at = uri ? 0 : b->json->chunk_at;
    buffer->bytes = uri ? buffer->file.length : b->json->chunk_bytes;
    return true;
}

/* --- accessors ------------------------------------------------------------------------------------ */

static int component_bytes(int64_t component)
{
    return component == GLTF_READ_U8                                  ? 1
           : component == GLTF_READ_U16                               ? 2
           : component == GLTF_READ_U32 || component == GLTF_READ_F32 ? 4
                                                                      : 0;
}

static int width_of(const char *type)
{
    return !type                         ? 0
           : strcmp(type, "SCALAR") == 0 ? 1
           : strcmp(type, "VEC2") == 0   ? 2
           : strcmp(type, "VEC3") == 0   ? 3
                                         : 0;
}

/* 0 where the key is absent, NONE where its value is no offset. */
static int64_t offset_of(json_t *object, const char *key)
{
    return json_object_get(object, key) ? gltf_whole(object, key) : 0;
}

bool gltf_rows_find(GltfBytes *b, int64_t i, GltfRows *out, Err *err)
{
    json_t *root = b->json->root, *accessor = gltf_at(json_object_get(root, "accessors"), i);
    json_t *view = gltf_at(json_object_get(root, "bufferViews"), gltf_whole(accessor, "bufferView"));
    int64_t buffer = gltf_whole(view, "buffer"), view_at = offset_of(view, "byteOffset"),
            view_bytes = gltf_whole(view, "byteLength");
    int64_t at = offset_of(accessor, "byteOffset"), count = gltf_whole(accessor, "count"),
            stride = offset_of(view, "byteStride");
    int64_t component = gltf_whole(accessor, "componentType");
    int width = width_of(json_string_value(json_object_get(accessor, "type"))),
        bytes = component_bytes(component) * width;
    if (!view || json_object_get(accessor, "sparse") || bytes == 0)
        return gltf_refuse(b, "an accessor is missing, or of a kind that is not read", err);
    if (stride == 0) stride = bytes;
    if (buffer == NONE || buffer >= b->nbuffer || stride < bytes || stride > STRIDE_MOST) return damaged(b, err);
    if (!open_buffer(b, (int)buffer, err)) return false;
    int64_t length = b->buffer[buffer].bytes;
    if (view_at == NONE || view_at > length || view_bytes == NONE || view_bytes > length - view_at)
        return damaged(b, err);
    if (at == NONE || at > view_bytes || count < 1 || bytes > view_bytes - at ||
        count - 1 > (view_bytes - at - bytes) / stride)
        return damaged(b, err);
    if (count > INT32_MAX / 3) return gltf_refuse(b, "an accessor has more rows than are read", err);
    *out = (GltfRows){(int)buffer, (int)component, width, (int)stride, view_at + at, (int)count};
    return true;
}

/* Gives the rows' bytes in blocks of whole strides to `take`, which gets where its first value goes. */
typedef void TakeRow(const uint8_t *from, int component, int width, void *to);

static bool read_rows(GltfBytes *b, const GltfRows *rows, int from, int count, size_t value_bytes, void *out,
                      TakeRow *take, Err *err)
{
    GltfBuffer *buffer = &b->buffer[rows->buffer];
    ASSERT(buffer->open && from >= 0 && count >= 0 && from <= rows->count - count);
    uint8_t *block = NEW(uint8_t, BLOCK);
    int bytes = component_bytes(rows->component) * rows->width, most = BLOCK / rows->stride;
    bool ok = true;
    for (int done = 0; ok && done < count;) {
        int n = int_min(most, count - done);
        int64_t at = buffer->at + rows->at + (int64_t)(from + done) * rows->stride;
        ok = infile_read(&buffer->file, at, (size_t)(n - 1) * (size_t)rows->stride + (size_t)bytes, block, err);
        for (int k = 0; ok && k < n; k++, done++)
            take(block + (size_t)k * (size_t)rows->stride, rows->component, rows->width,
                 (uint8_t *)out + (size_t)done * (size_t)rows->width * value_bytes);
    }
    mem_free(block);
    return ok;
}

static void take_floats(const uint8_t *from, int component, int width, void *to)
{
    (void)component;
    for (int k = 0; k < width; k++) ((float *)to)[k] = get_f32(from + 4 * k);
}

static void take_wholes(const uint8_t *from, int component, int width, void *to)
{
    for (int k = 0; k < width; k++)
        ((uint32_t *)to)[k] = component == GLTF_READ_U8    ? from[k]
                              : component == GLTF_READ_U16 ? get_u16(from + 2 * k)
                                                           : get_u32(from + 4 * k);
}

bool gltf_rows_floats(GltfBytes *b, const GltfRows *rows, int from, int count, float *out, Err *err)
{
    if (rows->component != GLTF_READ_F32)
        return gltf_refuse(b, "it holds quantised numbers where only 32-bit floats are read", err);
    return read_rows(b, rows, from, count, sizeof *out, out, take_floats, err);
}

bool gltf_rows_wholes(GltfBytes *b, const GltfRows *rows, int from, int count, uint32_t *out, Err *err)
{
    if (rows->component == GLTF_READ_F32)
        return gltf_refuse(b, "it holds floats where whole numbers should be; it is damaged", err);
    return read_rows(b, rows, from, count, sizeof *out, out, take_wholes, err);
}
