#include "io/stream.h"

#include <bzlib.h>
#include <string.h>
#include <zlib.h>

enum { PACKED_BYTES = 1 << 16 };

/* Of deflate: a match of 258 bytes takes two bits at least. bzip2 has no such limit, so that a small file may unpack to
 * so much anyway, and a larger one to what deflate could. */
enum { DEFLATE_RATIO = 1032, BZIP2_FREE_BYTES = 1 << 26 };

struct Stream {
    InFile *in;
    StreamCodec codec;
    int64_t at;         /* next byte of the file to be taken */
    bool ended;         /* of the packed data */
    z_stream z;
    bz_stream b;
    uint8_t packed[PACKED_BYTES];
};

static bool stream_damaged(const Stream *s, Err *err)
{
    return fail(err, ERR_INPUT, "%.600s: its compressed samples are damaged or cut short; write or copy the file again", s->in->path);
}

Stream *stream_open(InFile *in, int64_t at, StreamCodec codec, Err *err)
{
    Stream *s = NEW0(Stream, 1);
    s->in = in;
    s->codec = codec;
    s->at = at < in->length ? at : in->length;
    bool good = codec == STREAM_DEFLATE  ? inflateInit2(&s->z, MAX_WBITS + 32) == Z_OK
                : codec == STREAM_BZIP2 ? BZ2_bzDecompressInit(&s->b, 0, 0) == BZ_OK
                                        : true;
    if (good) return s;
    fail(err, ERR_RESOURCE, "%.600s: there is no memory to unpack it", in->path);
    mem_free(s);
    return NULL;
}

void stream_close(Stream *s)
{
    if (!s) return;
    if (s->codec == STREAM_DEFLATE) inflateEnd(&s->z);
    if (s->codec == STREAM_BZIP2) BZ2_bzDecompressEnd(&s->b);
    mem_free(s);
}

int64_t stream_most(const Stream *s)
{
    int64_t left = s->in->length - s->at, most;
    if (s->codec == STREAM_PLAIN) return left;
    left += s->codec == STREAM_DEFLATE ? s->z.avail_in + 1 : s->b.avail_in; /* taken and not unpacked; 1: single bits */
    if (__builtin_mul_overflow(left, (int64_t)DEFLATE_RATIO, &most)) return INT64_MAX;
    return s->codec == STREAM_BZIP2 && most < BZIP2_FREE_BYTES ? BZIP2_FREE_BYTES : most;
}

/* More packed bytes; 0 at the file's end. */
static bool refill(Stream *s, unsigned *count, Err *err)
{
    int64_t left = s->in->length - s->at;
    *count = left < PACKED_BYTES ? (unsigned)left : PACKED_BYTES;
    if (!infile_read(s->in, s->at, *count, s->packed, err)) return false;
    s->at += *count;
    return true;
}

/* As many bytes as there are, at most `size`. Files may hold several packed members one behind the other. */
static bool inflate_some(Stream *s, size_t size, uint8_t *to, size_t *got, Err *err)
{
    *got = 0;
    while (*got < size) {
        if (s->z.avail_in == 0) {
            if (!refill(s, &s->z.avail_in, err)) return false;
            s->z.next_in = s->packed;
            if (s->z.avail_in == 0) return s->ended || stream_damaged(s, err);
        }
        if (s->ended && inflateReset(&s->z) != Z_OK) return stream_damaged(s, err);
        s->ended = false;
        unsigned room = size - *got < (1u << 30) ? (unsigned)(size - *got) : 1u << 30;
        s->z.next_out = to + *got;
        s->z.avail_out = room;
        int code = inflate(&s->z, Z_NO_FLUSH);
        if (code != Z_OK && code != Z_STREAM_END) return stream_damaged(s, err);
        s->ended = code == Z_STREAM_END;
        *got += room - s->z.avail_out;
    }
    return true;
}

static bool bunzip_some(Stream *s, size_t size, uint8_t *to, size_t *got, Err *err)
{
    *got = 0;
    while (*got < size && !s->ended) {
        if (s->b.avail_in == 0) {
            if (!refill(s, &s->b.avail_in, err)) return false;
            s->b.next_in = (char *)s->packed;
            if (s->b.avail_in == 0) return stream_damaged(s, err);
        }
        unsigned room = size - *got < (1u << 30) ? (unsigned)(size - *got) : 1u << 30;
        s->b.next_out = (char *)to + *got;
        s->b.avail_out = room;
        int code = BZ2_bzDecompress(&s->b);
        if (code != BZ_OK && code != BZ_STREAM_END) return stream_damaged(s, err);
        s->ended = code == BZ_STREAM_END;
        *got += room - s->b.avail_out;
    }
    return true;
}

bool stream_take(Stream *s, size_t size, void *to, size_t *got, Err *err)
{
    if (s->codec == STREAM_DEFLATE) return inflate_some(s, size, to, got, err);
    if (s->codec == STREAM_BZIP2) return bunzip_some(s, size, to, got, err);
    int64_t left = s->in->length - s->at;
    *got = (uint64_t)left < size ? (size_t)left : size;
    if (!infile_read(s->in, s->at, *got, to, err)) return false;
    s->at += (int64_t)*got;
    return true;
}

bool stream_read(Stream *s, size_t size, void *to, Err *err)
{
    size_t got;
    if (!stream_take(s, size, to, &got, err)) return false;
    if (got == size) return true;
    return fail(err, ERR_INPUT, "%.600s: is cut short; write or copy the file again", s->in->path);
}

bool stream_skip(Stream *s, int64_t size, Err *err)
{
    uint8_t gone[4096];
    if (size > stream_most(s))
        return fail(err, ERR_INPUT, "%.600s: is shorter than what is to be skipped of it; write or copy the file again", s->in->path);
    for (; size > 0; size -= (int64_t)sizeof gone)
        if (!stream_read(s, size < (int64_t)sizeof gone ? (size_t)size : sizeof gone, gone, err)) return false;
    return true;
}
