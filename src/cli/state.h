/* state.h: PREFIX.state: where a run stands after its last finished frame.
 *
 * It is replaced after each frame, or some of them (outputs.h), in one step, once everything it tells of is on disk. Behind a
 * head that names the program's version come the settings, the frames done with the digests of their files, the tracker's memory
 * (track_store) and the lengths and tables of the growing outputs. A digest of all that guards it against damage; each value
 * is checked as well when it is read. */
#pragma once
#include "base/store.h"

/* Replaces the file. */
bool state_write(const char *prefix, const Store *s, Err *err);
/* Notes in it, in place, that all of the run's files bear their final names. */
bool state_finish(const char *prefix, Err *err);
/* No file: no failure. */
bool state_remove(const char *prefix, Err *err);

char *state_path(const char *prefix); /* to be freed */

typedef struct StateFile {
    bool exists;
    bool finished;
    uint8_t *data;
    Store store;     /* reads from data */
} StateFile;
/* No file is no failure. To be freed in any case. */
bool state_read(const char *path, StateFile *out, Err *err);
void state_free(StateFile *f);
