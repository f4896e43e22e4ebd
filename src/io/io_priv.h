/* io_priv.h: what the readers of src/io share. A reader fills an empty grid; what it leaves there on failure is given back
 * by whoever called it. */
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

/* --- a format (format.c has the table) --------------------------------------------------------- */

/* What all formats know of an open file; the first member of each format's own. */
struct VolumeFile {
    const struct Format *format; /* what the file is */
    const struct Format *reader; /* who reads it: the same, or REMOTE_FORMAT */
    const char *path;
    const VolumeRequest *request;
    int nentry, capentry;
    VolumeEntry *entry; /* [nentry] */
};

typedef struct Format {
    const char *name, *ending;
    size_t file_size;                                              /* of the format's own file */
    bool (*open)(VolumeFile *f, Err *err);                         /* f is zeroed beyond VolumeFile; fills entry */
    bool (*read)(VolumeFile *f, int i, Grid *out, Err *err);       /* entry i, of 1 or 3 components */
    void (*close)(VolumeFile *f);                                  /* also where open failed */
} Format;

extern const Format VDB_FORMAT, NVDB_FORMAT, NPY_FORMAT, RAW_FORMAT, NRRD_FORMAT, NHDR_FORMAT, UNI_FORMAT, EXR_FORMAT;

/* A file of any format read by another process (remote.c). */
extern const Format REMOTE_FORMAT;

/* volume_open in this process, whatever isolate.h says. */
VolumeFile *volume_open_here(const char *path, const VolumeRequest *request, Err *err);

/* Appends an entry; the name is cut to what fits, unprintable characters become '?'. */
VolumeEntry *volume_add_entry(VolumeFile *f, const char *name, const char *type, int ncomp);
/* By exact name, else the first ("name[0]") of several that bear it; or NONE. */
int volume_find(const VolumeFile *f, const char *name);

/* --- dense arrays (dense.c) --------------------------------------------------------------------- */

typedef struct Stream Stream; /* stream.h */

typedef struct DenseType {
    char kind; /* 'f' 'i' 'u' */
    int size;  /* bytes: f 2 4 8; i and u 1 2 4 8 */
    bool big_endian;
} DenseType;

/* Samples in x, y and z, and the order they come in. */
typedef struct DenseShape {
    int n[3];
    bool x_fastest; /* else z is */
} DenseShape;

/* One sample from its bytes. */
float dense_sample(DenseType type, const uint8_t *p);

enum { DENSE_SIDE_MAX = 1 << 20 };

/* Each fills an empty grid of 1 or 3 components (the components of a sample one behind the other) with what is left of
 * the stream. False where that is not exactly so many samples. */
bool dense_read(Stream *s, const char *path, DenseType type, DenseShape shape, Grid *out, Err *err);
/* The same from numbers as text, with blanks or commas between. */
bool dense_read_text(Stream *s, const char *path, DenseShape shape, Grid *out, Err *err);
/* Holds the numbers of samples to what a volume may have, and gives how many values those are. */
bool dense_count(const char *path, const int n[3], int ncomp, int64_t *count, Err *err);
/* Places a grid as the request says, and where it says nothing as the file does: `own` maps samples to the world; NULL:
 * voxels of size 1, the first sample at the origin. */
bool dense_place(const char *path, const VolumeRequest *request, const Affine *own, Grid *out, Err *err);

/* --- which grids are meant (choose.c, join.c) ------------------------------------------------------ */

bool volume_read_velocity(VolumeFile *f, const char *name, Grid *out, Err *err);
/* A scalar or a vector, whichever is there. `out` is not yet initialised; on failure it is empty. */
bool volume_read_attribute(VolumeFile *f, const char *name, Grid *out, Err *err);
/* Three scalar grids as the components of `out`, an empty grid of 3. False where their transforms differ by more than the
 * half voxels of a staggered grid. */
bool volume_join(const Grid part[3], bool staggered, Grid *out);

/* --- what a surface is, where the file does not say (surface.c) ------------------------------------ */

VolumeClass volume_classify(const char *name, const Grid *g);
