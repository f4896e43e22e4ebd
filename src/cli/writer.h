/* writer.h: writes one frame behind: while a frame is solved, a thread of its own writes the last one. That thread never
 * calls parallel_for, which belongs to the solve. */
#pragma once
#include "cli/outputs.h"

typedef struct Writer Writer;

/* `out` is the writer's until writer_close. NULL when no thread can be had. */
Writer *writer_open(Outputs *out, Err *err);
/* Takes the frame over (*f is zeroed, in any case) once the one before is written; what it borrows must stay until the next
 * call returns, or writer_close. False where that one could not be written; nothing is written after it. */
bool writer_give(Writer *w, OutFrame *f, Err *err);
/* Waits for the last frame; false where one could not be written and writer_give did not say so. */
bool writer_close(Writer *w, Err *err);
