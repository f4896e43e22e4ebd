/* stream.h: a file's bytes one after the other, unpacked on the way where they are packed.
 *
 * What a file can unpack to is bounded before anything is made for it: stream_most. */
#pragma once
#include "io/io_priv.h"

typedef enum StreamCodec {
    STREAM_PLAIN,
    STREAM_DEFLATE, /* gzip or zlib, told apart by their first bytes */
    STREAM_BZIP2,
} StreamCodec;

/* From byte `at` to the file's end. NULL with a sentence. The file stays the caller's and open. */
Stream *stream_open(InFile *in, int64_t at, StreamCodec codec, Err *err);
void stream_close(Stream *s);
/* More bytes than this do not follow: exact for plain files, from the codec's largest ratio for others (for bzip2, whose
 * ratio has no useful bound, 64 MiB or 1032 times what is left of the file). */
int64_t stream_most(const Stream *s);
/* The next `size` bytes; false with a sentence where they are not there. */
bool stream_read(Stream *s, size_t size, void *to, Err *err);
/* The same, where fewer may be left: *got says how many. */
bool stream_take(Stream *s, size_t size, void *to, size_t *got, Err *err);
bool stream_skip(Stream *s, int64_t size, Err *err);
