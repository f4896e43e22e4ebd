/* image.h: images of named channels as OpenEXR files: scanlines from the top, ZIP in blocks of 16 rows, one part.
 *
 * Rows are handed over as they are made, so that an image may be larger than memory; they are packed on all threads, and the
 * bytes are the same for any number of them. The file bears its final name when it is whole. */
#pragma once
#include "base/base.h"

typedef enum ImageType { IMAGE_HALF, IMAGE_FLOAT, IMAGE_UINT } ImageType;

typedef struct ImageChannel {
    const char *name; /* "R", "Z"; "normal.X": X of the layer `normal`. Unique in its image, at most 31 bytes */
    ImageType type;   /* as stored; a half beyond 65504 becomes infinite */
} ImageChannel;

enum { IMAGE_BLOCK = 16 };

typedef struct ImageFile ImageFile;

/* Copies the channels. NULL with a sentence where the file cannot be made. */
ImageFile *image_open(const char *path, int width, int height, int nchannel, const ImageChannel *channel, Err *err);
/* The next rows from the top: a multiple of IMAGE_BLOCK, or all that are left. plane: [nchannel][rows * width], float, or
 * uint32_t of an IMAGE_UINT channel. After a failure only image_abort is left to do. */
bool image_put_rows(ImageFile *f, int rows, const void *const *plane, Err *err);
/* Once all rows were put. Frees in any case. */
bool image_close(ImageFile *f, Err *err);
void image_abort(ImageFile *f);
