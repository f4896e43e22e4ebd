/* writer.h: writes one frame behind: while a frame is solved, a thread of its own writes the last one. That thread never
 * calls parallel_for, which belongs to the solve. */
#pragma once
#include "cli/outputs.h"

typedef struct Writer Writer;

/* `out` is the writer's while there is a frame to be written. NULL when no thread can be had. */
Writer *writer_open(Outputs *out, Err *err);
/* Until the last frame given is written. False where it could not be; then no other may be given. */
bool writer_wait(Writer *w, Err *err);
/* Takes the frame over (*f is zeroed); comes after writer_wait. What the frame borrows must stay until the next wait returns. */
void writer_give(Writer *w, OutFrame *f);
/* Waits for the last frame; false where one could not be written and writer_wait did not say so. */
bool writer_close(Writer *w, Err *err);
