#include "page/page_priv.h"

#include <zlib.h>

#include <errno.h>
#include <string.h>

/* A script's text stays far below what a browser takes as one string; a multiple of 3, so that each part ends without padding. */
enum { PART_BYTES = 3 << 20, READ_BYTES = 1 << 18, GZIP_WINDOW = 15 + 16 };

typedef struct Part {
    OutFile *f;
    const char *kind;
    uint8_t *byte;      /* [PART_BYTES] */
    uint8_t *text;      /* [4 * PART_BYTES / 3] */
    size_t n;
} Part;

static size_t base64(size_t n, const uint8_t *byte, uint8_t *text)
{
    static const char sign[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint8_t *at = text;
    for (size_t i = 0; i < n; i += 3) {
        unsigned left = (unsigned)(n - i < 3 ? n - i : 3);
        unsigned bits = (unsigned)byte[i] << 16 | (left > 1 ? (unsigned)byte[i + 1] << 8 : 0) | (left > 2 ? byte[i + 2] : 0u);
        for (unsigned k = 0; k < 4; k++) *at++ = k <= left ? (uint8_t)sign[bits >> (18 - 6 * k) & 63] : '=';
    }
    return (size_t)(at - text);
}

static bool put_part(Part *p, Err *err)
{
    size_t n = base64(p->n, p->byte, p->text);
    char head[80];
    int size = snprintf(head, sizeof head, "<script type=\"text/plain\" data-mesh=\"%s\">", p->kind);
    p->n = 0;
    return outfile_write(p->f, head, (size_t)size, err) && outfile_write(p->f, p->text, n, err) && outfile_write(p->f, "</script>\n", 10, err);
}

/* What `z` has to give, into parts; at the end all of it. */
static bool drain(z_stream *z, Part *p, int flush, Err *err)
{
    int status;
    do {
        z->next_out = p->byte + p->n;
        z->avail_out = (uInt)(PART_BYTES - p->n);
        status = deflate(z, flush);
        ASSERT(status != Z_STREAM_ERROR);
        p->n = PART_BYTES - z->avail_out;
        if (p->n == PART_BYTES && !put_part(p, err)) return false;
    } while (flush == Z_FINISH ? status != Z_STREAM_END : z->avail_in > 0);
    return flush != Z_FINISH || p->n == 0 || put_part(p, err);
}

static bool compress_file(FILE *in, const char *path, z_stream *z, Part *p, Err *err)
{
    uint8_t *read = NEW(uint8_t, READ_BYTES);
    bool good = true;
    do {
        z->next_in = read;
        z->avail_in = (uInt)fread(read, 1, READ_BYTES, in);
        good = z->avail_in == 0 || drain(z, p, Z_NO_FLUSH, err);
    } while (good && !feof(in) && !ferror(in));
    if (good && ferror(in)) good = fail(err, ERR_INPUT, "%.800s: cannot be read (%s)", path, strerror(errno));
    mem_free(read);
    return good && drain(z, p, Z_FINISH, err);
}

bool mesh_embed(OutFile *f, const char *path, const char *kind, Err *err)
{
    z_stream z = {0};
    FILE *in = fopen(path, "rb");
    if (!in) return fail(err, ERR_INPUT, "%.800s: cannot be opened (%s)", path, strerror(errno));
    bool good = deflateInit2(&z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, GZIP_WINDOW, 9, Z_DEFAULT_STRATEGY) == Z_OK;
    if (good) {
        Part p = {.f = f, .kind = kind, .byte = NEW(uint8_t, PART_BYTES), .text = NEW(uint8_t, 4 * PART_BYTES / 3)};
        good = compress_file(in, path, &z, &p, err);
        mem_free(p.byte);
        mem_free(p.text);
        deflateEnd(&z);
    } else {
        fail(err, ERR_RESOURCE, "%.800s: cannot be compressed: there is not enough memory", path);
    }
    fclose(in);
    return good;
}
