/* isolate_priv.h: the processes that read (isolate.c), and what is spoken with them (remote.c). */
#pragma once
#include "io/io_priv.h"
#include "io/isolate.h"

enum { WIRE_BYTES = 1 << 13 };

/* One end of a connection. What is put is sent when there is much of it, or when something is to be got. Once something
 * fails, all further steps do. */
typedef struct Wire {
    int fd;
    double left_s; /* how long to wait yet; INFINITY: for ever */
    bool failed, late;
    size_t held, at, end; /* bytes in `out`; those not taken from `in` */
    uint8_t out[WIRE_BYTES], in[WIRE_BYTES];
} Wire;

bool wire_put(Wire *w, const void *data, size_t size);
bool wire_get(Wire *w, void *to, size_t size);
bool wire_flush(Wire *w);

/* --- in the program ------------------------------------------------------------------------------ */

typedef struct ReaderProcess {
    Wire wire;
    int fate; /* a pipe: the process's number, and how it ended */
    int pid;  /* 0: not asked for yet */
} ReaderProcess;

bool isolate_is_on(void);
/* One that waits for a file. */
ReaderProcess *process_start(Err *err);
/* Ends it, whatever it is at. NULL is allowed. */
void process_end(ReaderProcess *p);
/* Keeps it for the next file: it must be waiting for one. */
void process_keep(ReaderProcess *p);
/* Gives it as long as `bytes` of file may take for what comes next. */
void process_allow(ReaderProcess *p, int64_t bytes);
/* Copies from its memory, where the system allows that. */
bool process_copy(ReaderProcess *p, uint64_t address, void *to, size_t size);
/* Says what became of a process that does not answer. Always false. */
bool process_fail(ReaderProcess *p, const char *path, Err *err);
/* Whether a process that reads `bytes` of file may hold so many items. */
bool process_can_hold(int64_t bytes, int64_t count, size_t size);

/* --- in the process that reads -------------------------------------------------------------------- */

/* A file of so many bytes was opened: its share of memory is added. Does nothing elsewhere. */
void isolate_grant(int64_t bytes);
int64_t isolate_granted(void);
/* All grants are taken back. */
void isolate_ungrant(void);

/* remote.c: answers until the other end is closed. */
void remote_serve(Wire *wire);
