/* file.h: files that bear their final name only when they are whole. */
#pragma once
#include "base/base.h"
#include <stdio.h>

typedef struct OutFile {
    FILE *stream;
    char *path, *part; /* part: path with ".part" behind it */
} OutFile;

bool outfile_open(OutFile *f, const char *path, Err *err);
/* Flushes, syncs, renames. On failure removes the part and says why (a full disk by name). Closes in any case. */
bool outfile_commit(OutFile *f, Err *err);
void outfile_abort(OutFile *f);
