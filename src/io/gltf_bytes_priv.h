/* gltf_bytes_priv.h: the accessors of a glTF, read piece by piece from its buffers; each is held to the files' lengths first. */
#pragma once
#include "io/gltf_json_priv.h"

typedef struct GltfBuffer {
    bool open;
    char *path;
    InFile file;
    int64_t at, bytes;      /* within the file */
} GltfBuffer;

typedef struct GltfBytes {
    const char *path;       /* borrowed, as the JSON is */
    const GltfJson *json;
    int nbuffer;
    GltfBuffer *buffer;     /* [nbuffer] opened when first asked for */
} GltfBytes;

/* Component types, as the specification numbers them. */
enum { GLTF_READ_I8 = 5120, GLTF_READ_U8, GLTF_READ_I16, GLTF_READ_U16, GLTF_READ_U32 = 5125, GLTF_READ_F32 };

/* Of a view that EXT_meshopt_compression has packed. */
typedef struct GltfPacking {
    bool is_indices, is_triangles; /* else attributes */
    int64_t at, bytes;      /* within the buffer; 0 bytes: it is not packed */
    int64_t count;          /* rows, at most what the bytes justify */
} GltfPacking;

typedef struct GltfRows {
    int buffer, component, width, stride;
    bool normalized;        /* whole numbers that stand for 0 ... 1 or -1 ... 1 */
    int64_t at;             /* within the buffer, or the unpacked view */
    int count;              /* at most what the buffer's length justifies */
    GltfPacking packing;
} GltfRows;

void gltf_bytes_init(GltfBytes *b, const char *path, const GltfJson *json);
void gltf_bytes_free(GltfBytes *b);

/* Where accessor i is. False with a sentence where it is not wholly in its file, or is of a kind that is not read. */
bool gltf_rows_find(GltfBytes *b, int64_t i, GltfRows *out, Err *err);
/* Rows from ... from + count - 1 as floats, whatever they are stored as, or as unsigned whole numbers, which they must be:
 * [count * width]. */
bool gltf_rows_floats(GltfBytes *b, const GltfRows *rows, int from, int count, float *out, Err *err);
bool gltf_rows_wholes(GltfBytes *b, const GltfRows *rows, int from, int count, uint32_t *out, Err *err);
/* "…: what; remedy": always false. */
bool gltf_refuse(const GltfBytes *b, const char *why, Err *err);
