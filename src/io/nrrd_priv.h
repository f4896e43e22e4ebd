/* nrrd_priv.h: a NRRD file's header, parsed strictly (a line NRRD000x, then `field: value` lines up to an
 * empty one or the file's end, then the samples, here or in a file of their own).
 *
 * Why not teem, whose format this is: its reader allocates what a header claims before it looks at the file's length,
 * and takes files that are cut short for whole ones under some encodings. The header is a page of text; the
 * samples are zlib's and bzip2's. */
#pragma once
#include "io/stream.h"

typedef enum NrrdEncoding { NRRD_RAW, NRRD_TEXT, NRRD_GZIP, NRRD_BZIP2, NRRD_UNKNOWN } NrrdEncoding;

typedef struct NrrdHeader {
    DenseType type;
    char type_name[40];
    DenseShape shape;
    NrrdEncoding encoding;
    bool endian_known;
    Affine xform;            /* samples to world; the inverse is not filled */
    char content[256];       /* "": none */
    char data_file[1024];    /* "": behind the header */
    int64_t line_skip, byte_skip; /* byte_skip -1: the samples end the file */
    int64_t end;             /* first byte behind the header */
} NrrdHeader;

/* Reads the header of an open file. */
bool nrrd_header_read(InFile *in, NrrdHeader *out, Err *err);
