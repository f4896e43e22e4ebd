/* inputs.h: the frames that a run has done, so that another can tell whether it goes on with the same. */
#pragma once
#include "base/store.h"
#include "sequence/pattern.h"

typedef struct Input {
    int64_t number;
    uint64_t digest;  /* of the file; 0: it could not be read */
} Input;

typedef struct Inputs {
    int n, cap;
    Input *input;
} Inputs;

void inputs_add(Inputs *in, int64_t number, uint64_t digest);
void inputs_store(Inputs *in, Store *s);
void inputs_free(Inputs *in);
/* The digest of a frame's file, 0 where it cannot be read. */
uint64_t input_digest(const Frame *f);
/* Forgets all but this one; false where it is none of them. */
bool inputs_keep(Inputs *in, int64_t number);
/* Takes the frames done from the sequence, which must hold them as they were, and no others between; `skip`: but others
 * before the first. The frame numbered `tracked` (or NONE) is put in *last. */
bool inputs_pass(const Inputs *in, bool skip, Sequence *sequence, int64_t tracked, Frame *last, Err *err);
