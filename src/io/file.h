/* file.h: files that bear their final name only when they are whole.
 *
 * A failure is a sentence with the final path, the reason and the remedy, code ERR_OUTPUT; the part is
 * removed then. (A limit set by `ulimit -f` is such a failure only where the program ignores SIGXFSZ.) */
#pragma once
#include "base/base.h"
#include <stdio.h>

typedef struct OutFile {
    FILE *stream;      /* NULL: not open; may be read back and sought in as well */
    char *path, *part; /* part: path with ".part" behind it */
} OutFile;

/* Replaces a part that a killed run left behind. On failure *f is zeroed. */
bool outfile_open(OutFile *f, const char *path, Err *err);
/* Goes on with the part that a killed run left behind, behind its first `bytes`; what follows them is cut off. On failure
 * *f is zeroed and the part is as it was. */
bool outfile_reopen(OutFile *f, const char *path, uint64_t bytes, Err *err);
/* Appends; the file stays open on failure, to be given up with outfile_abort. */
bool outfile_write(OutFile *f, const void *data, size_t bytes, Err *err);
/* Says why the last call on the stream failed (errno). Always false. */
bool outfile_fail(const OutFile *f, Err *err);
/* What was written outlasts the program, and where it can the machine. */
bool outfile_sync(OutFile *f, Err *err);
/* Bytes written so far. */
uint64_t outfile_length(const OutFile *f);
/* Appends to `f` all that was written to `from`, which stays open. */
bool outfile_append(OutFile *f, OutFile *from, Err *err);
/* Gives a copy of what was written so far the final name; the part stays open. */
bool outfile_publish(OutFile *f, Err *err);
/* Flushes, syncs, renames. On failure removes the part and says why (a full disk by name). Closes in any
 * case. */
bool outfile_commit(OutFile *f, Err *err);
/* Removes the part; does nothing on a zeroed OutFile. */
void outfile_abort(OutFile *f);
/* Removes the part that a killed run left of the file `path`. */
void outfile_sweep(const char *path);
/* Closes and leaves the part for outfile_reopen; does nothing on a zeroed OutFile. */
void outfile_leave(OutFile *f);
