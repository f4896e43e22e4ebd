/* io_priv.h: what the readers of src/io share. A reader fills `out`, which volume_read has emptied; on failure
 * volume_read gives back what it left there. */
#pragma once
#include "io/volume.h"

#include <stdio.h>

/* --- a file open for reading, whose length is known: every claimed size is measured against it --- */

typedef struct InFile {
    FILE *stream;
    const char *path; /* the caller's */
    int64_t length;
} InFile;

bool infile_open(InFile *in, const char *path, Err *err);
void infile_close(InFile *in);
/* `size` bytes at `at`; false with a sentence where the file ends before them. */
bool infile_read(InFile *in, int64_t at, size_t size, void *to, Err *err);

/* --- the readers of format.c's table ------------------------------------------------------------ */

typedef bool ReadVolumeFn(const char *path, const VolumeRequest *request, Volume *out, Err *err);
ReadVolumeFn vdb_read, npy_read, raw_read;

/* --- dense arrays (dense.c) --------------------------------------------------------------------- */

typedef struct DenseType {
    char kind; /* 'f' 'i' 'u' */
    int size;  /* bytes: f 2 4 8, i and u 1 2 */
    bool big_endian;
} DenseType;

enum { DENSE_SIDE_MAX = 1 << 20 };

/* Reads n[0]*n[1]*n[2] samples from byte `at` to the file's end into an empty grid, placed as the request says.
 * False where the file's length is not exactly that. */
bool dense_read(InFile *in, int64_t at, DenseType type, const int n[3], bool x_fastest, const VolumeRequest *request,
                Grid *out, Err *err);

/* --- what a surface is, where the file does not say (surface.c) ------------------------------------ */

VolumeClass volume_classify(const char *name, const Grid *g);
