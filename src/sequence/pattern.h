/* pattern.h: the FRAME... arguments of the command line as a run of frames.
 *
 * An argument is a file; a pattern (phi.####.vdb, phi.%04d.vdb, phi.$F4.vdb) with --frames A-B[xS], or without it
 * for all files that match; a directory, for all files in it that is_volume knows; or, alone, "-": names on
 * standard input, one a line, taken as they arrive. A file that exists is a file, whatever its name looks like.
 *
 * A frame's number is the last group of digits in the file's name before its ending; a file without one gets its
 * place, 0001, 0002, ... Frames come sorted by number (names on standard input: as they arrive). No two frames of
 * a run bear the same number. */
#pragma once
#include "base/base.h"
#include "base/hash.h"

#include <stdio.h>

enum { FRAME_PATH_MAX = 4096, FRAME_DIGITS_MAX = 18 };

typedef struct Frame {
    char path[FRAME_PATH_MAX];
    char digits[FRAME_DIGITS_MAX + 2]; /* the number as the input writes it, "0012": for the names of outputs */
    int64_t number;
} Frame;

typedef enum SequenceStep { SEQUENCE_FRAME, SEQUENCE_END, SEQUENCE_ERROR } SequenceStep;

typedef struct SequenceEntry SequenceEntry;
typedef bool IsVolumeFn(const char *path);

typedef struct Sequence {
    int nentry, capentry, next;
    SequenceEntry *entry;   /* owned */
    FILE *names;            /* "-": where they come from (stdin; not closed), else NULL */
    int narrived;
    Map arrived;            /* numbers seen on it */
    IsVolumeFn *is_wanted;  /* names on it that this does not know are passed over; NULL: none are */
} Sequence;

/* `frames` is the text of --frames or NULL; it goes with patterns and directories, and then frames that are missing
 * are part of the run: reading them will tell. A failure leaves nothing to close. */
bool sequence_open(Sequence *s, int nargs, char *const *args, const char *frames, IsVolumeFn *is_volume, Err *err);
/* Names on standard input, of which those that is_wanted does not know are passed over. */
void sequence_open_names(Sequence *s, IsVolumeFn *is_wanted);
/* A run of frames that one file holds (a scene): numbers first ... last, of which `frames` (or NULL) picks some. */
bool sequence_open_numbers(Sequence *s, const char *path, int64_t first, int64_t last, const char *frames, Err *err);
/* Leaves `count` frames, from the place-th on; standard input has no places. */
void sequence_pick(Sequence *s, int place, int count);
void sequence_close(Sequence *s);
/* The next frame; waits for it where names come on standard input. */
SequenceStep sequence_next(Sequence *s, Frame *out, Err *err);
/* Waits for the file of the frame that sequence_next gave last, while a running simulation writes it: until it has not
 * changed for two seconds, or the next frame's is there. False where a signal came instead. */
bool sequence_await(const Sequence *s, const Frame *f);
/* Frames in the run, or NONE where only the end of standard input will tell. */
int sequence_length(const Sequence *s);

/* The name that a pattern gives a frame. A name without a place for the number serves where `alone`, for one frame only. */
bool pattern_name(const char *pattern, int64_t number, bool alone, char out[FRAME_PATH_MAX], Err *err);

/* A-B, A-BxS or A: first, last and step, 0 <= first <= last, step >= 1. */
typedef struct FrameRange {
    int64_t first, last, step;
} FrameRange;
bool frame_range_parse(const char *text, FrameRange *out, Err *err);
