#include "io/gltf_bytes_priv.h"

#include "io/bytes.h"

#include <meshoptimizer.h>
#include <stdio.h>
#include <string.h>

enum { STRIDE_MOST = 252, BLOCK = 1 << 16 };
enum { PACKED_MOST = 1 << 30 }; /* bytes of one view, unpacked */

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
    if (!uri && (i > 0 || !b->json->chunk_bytes))
        return gltf_refuse(b, "a buffer is nowhere; write or copy the file again", err);
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
    return component == GLTF_READ_U8 || component == GLTF_READ_I8     ? 1
           : component == GLTF_READ_U16 || component == GLTF_READ_I16 ? 2
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

/* The packed bytes of a view of `bytes` bytes in rows of `stride`, where it has such. No codec packs more than 64 bytes into
 * one: a view may not claim more. */
static bool find_packing(const GltfBytes *b, json_t *view, int64_t bytes, int64_t stride, int64_t *buffer, GltfRows *out,
                         Err *err)
{
    json_t *packed = json_object_get(json_object_get(view, "extensions"), "EXT_meshopt_compression");
    if (!packed) return true;
    const char *mode = json_string_value(json_object_get(packed, "mode")),
               *filter = json_string_value(json_object_get(packed, "filter"));
    GltfPacking *p = &out->packing;
    *buffer = gltf_whole(packed, "buffer");
    *p = (GltfPacking){.is_indices = mode && strcmp(mode, "INDICES") == 0,
                       .is_triangles = mode && strcmp(mode, "TRIANGLES") == 0,
                       .at = offset_of(packed, "byteOffset"),
                       .bytes = gltf_whole(packed, "byteLength"),
                       .count = gltf_whole(packed, "count")};
    int64_t size = gltf_whole(packed, "byteStride");
    if (filter && strcmp(filter, "NONE") != 0)
        return gltf_refuse(b, "its arrays are packed behind a filter, which is not read; write it without", err);
    bool indices = p->is_indices || p->is_triangles;
    bool good = mode && (indices || strcmp(mode, "ATTRIBUTES") == 0) && size == stride && p->count > 0 && p->bytes > 0 &&
                p->at != NONE && bytes <= PACKED_MOST && bytes / 64 <= p->bytes && p->count == bytes / size &&
                bytes % size == 0;
    good = good && (indices ? size == 2 || size == 4 : size % 4 == 0) && (!p->is_triangles || p->count % 3 == 0);
    return good || damaged(b, err);
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
    if (stride < bytes || stride > STRIDE_MOST || view_at == NONE || view_bytes == NONE) return damaged(b, err);
    *out = (GltfRows){.component = (int)component, .width = width, .stride = (int)stride,
                      .normalized = json_is_true(json_object_get(accessor, "normalized"))};
    if (!find_packing(b, view, view_bytes, stride, &buffer, out, err)) return false;
    if (buffer == NONE || buffer >= b->nbuffer) return damaged(b, err);
    if (!open_buffer(b, (int)buffer, err)) return false;
    const GltfPacking *p = &out->packing;
    int64_t length = b->buffer[buffer].bytes, begin = p->bytes ? p->at : view_at, size = p->bytes ? p->bytes : view_bytes;
    if (begin > length || size > length - begin) return damaged(b, err);
    if (at == NONE || at > view_bytes || count < 1 || bytes > view_bytes - at ||
        count - 1 > (view_bytes - at - bytes) / stride)
        return damaged(b, err);
    if (count > INT32_MAX / 3) return gltf_refuse(b, "an accessor has more rows than are read", err);
    out->buffer = (int)buffer;
    out->at = p->bytes ? at : view_at + at;
    out->count = (int)count;
    return true;
}

typedef struct Sink {
    void *out;              /* [count * width] */
    size_t value_bytes;
    void (*take)(const uint8_t *from, const GltfRows *rows, void *to); /* one row */
} Sink;

static void take_rows(const Sink *sink, const GltfRows *rows, const uint8_t *from, int done, int n)
{
    for (int k = 0; k < n; k++)
        sink->take(from + (size_t)k * (size_t)rows->stride, rows,
                   (uint8_t *)sink->out + (size_t)(done + k) * (size_t)rows->width * sink->value_bytes);
}

/* In blocks of whole strides. */
static bool read_plain(GltfBuffer *buffer, const GltfRows *rows, int from, int count, const Sink *sink, Err *err)
{
    uint8_t *block = NEW(uint8_t, BLOCK);
    int bytes = component_bytes(rows->component) * rows->width, most = BLOCK / rows->stride;
    bool ok = true;
    for (int done = 0; ok && done < count;) {
        int n = int_min(most, count - done);
        int64_t at = buffer->at + rows->at + (int64_t)(from + done) * rows->stride;
        ok = infile_read(&buffer->file, at, (size_t)(n - 1) * (size_t)rows->stride + (size_t)bytes, block, err);
        if (ok) take_rows(sink, rows, block, done, n);
        done += n;
    }
    mem_free(block);
    return ok;
}

static bool unpack(const GltfRows *rows, const uint8_t *packed, uint8_t *to)
{
    const GltfPacking *p = &rows->packing;
    size_t n = (size_t)p->count, size = (size_t)rows->stride, bytes = (size_t)p->bytes;
    int bad = p->is_triangles ? meshopt_decodeIndexBuffer(to, n, size, packed, bytes)
              : p->is_indices ? meshopt_decodeIndexSequence(to, n, size, packed, bytes)
                              : meshopt_decodeVertexBuffer(to, n, size, packed, bytes);
    return bad == 0;
}

/* The view is unpacked whole. */
static bool read_packed(GltfBytes *b, GltfBuffer *buffer, const GltfRows *rows, int from, int count, const Sink *sink,
                        Err *err)
{
    const GltfPacking *p = &rows->packing;
    uint8_t *packed = NEW(uint8_t, p->bytes), *view = NEW(uint8_t, p->count * rows->stride);
    bool ok = infile_read(&buffer->file, buffer->at + p->at, (size_t)p->bytes, packed, err);
    if (ok && !unpack(rows, packed, view)) ok = gltf_refuse(b, "a packed array is damaged; write or copy the file again", err);
    if (ok) take_rows(sink, rows, view + rows->at + (size_t)from * (size_t)rows->stride, 0, count);
    mem_free(packed);
    mem_free(view);
    return ok;
}

static bool read_rows(GltfBytes *b, const GltfRows *rows, int from, int count, const Sink *sink, Err *err)
{
    GltfBuffer *buffer = &b->buffer[rows->buffer];
    ASSERT(buffer->open && from >= 0 && count >= 0 && from <= rows->count - count);
    if (rows->packing.bytes) return read_packed(b, buffer, rows, from, count, sink, err);
    return read_plain(buffer, rows, from, count, sink, err);
}

static uint32_t get_whole(const uint8_t *from, int component, int k)
{
    int size = component_bytes(component);
    return size == 1 ? from[k] : size == 2 ? get_u16(from + 2 * k) : get_u32(from + 4 * k);
}

static float get_float(const uint8_t *from, const GltfRows *rows, int k)
{
    static const float one[] = {127, 255, 32767, 65535}; /* from GLTF_READ_I8 on */
    if (rows->component == GLTF_READ_F32) return get_f32(from + 4 * k);
    uint32_t bits = get_whole(from, rows->component, k);
    float x = rows->component == GLTF_READ_I8    ? (float)(int8_t)bits
              : rows->component == GLTF_READ_I16 ? (float)(int16_t)bits
                                                 : (float)bits;
    if (!rows->normalized || rows->component == GLTF_READ_U32) return x;
    x /= one[rows->component - GLTF_READ_I8];
    return x < -1 ? -1 : x;
}

static void take_floats(const uint8_t *from, const GltfRows *rows, void *to)
{
    for (int k = 0; k < rows->width; k++) ((float *)to)[k] = get_float(from, rows, k);
}

static void take_wholes(const uint8_t *from, const GltfRows *rows, void *to)
{
    for (int k = 0; k < rows->width; k++) ((uint32_t *)to)[k] = get_whole(from, rows->component, k);
}

bool gltf_rows_floats(GltfBytes *b, const GltfRows *rows, int from, int count, float *out, Err *err)
{
    return read_rows(b, rows, from, count, &(Sink){out, sizeof *out, take_floats}, err);
}

bool gltf_rows_wholes(GltfBytes *b, const GltfRows *rows, int from, int count, uint32_t *out, Err *err)
{
    int c = rows->component;
    if (c == GLTF_READ_F32 || c == GLTF_READ_I8 || c == GLTF_READ_I16)
        return gltf_refuse(b, "it holds other numbers where unsigned whole ones should be; it is damaged", err);
    return read_rows(b, rows, from, count, &(Sink){out, sizeof *out, take_wholes}, err);
}
