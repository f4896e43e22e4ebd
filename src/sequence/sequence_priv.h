/* sequence_priv.h: names with a number in them, and the entries a sequence is made of. */
#pragma once
#include "sequence/pattern.h"

struct SequenceEntry {
    char *path;
    int64_t number; /* NONE: the name has none (yet) */
    int digits_at, ndigit;
    int place;      /* in the arguments: keeps sorting stable */
};

enum { FRAME_COUNT_MAX = 10 * 1000 * 1000 };

/* A file's path in three: before the number, the number, the rest. The number may be empty. */
typedef struct NumberSpan {
    int at, count;
} NumberSpan;
/* The last group of digits in the base name before its ending. False where the group is too long for a number. */
bool name_find_number(const char *path, NumberSpan *out);
int64_t digits_value(const char *digits, int n);

/* A path with a place for the number. */
typedef struct Pattern {
    char prefix[FRAME_PATH_MAX], suffix[FRAME_PATH_MAX];
    int width; /* at least so many digits, filled up with zeros */
} Pattern;
/* Whether the text holds a place for the number; a sentence where that place is not as it must be. */
typedef enum PatternKind { PATTERN_NONE, PATTERN_ONE, PATTERN_WRONG } PatternKind;
PatternKind pattern_parse(const char *text, Pattern *out, Err *err);

/* scan.c: what there is on disk. */
bool sequence_add(Sequence *s, const char *path, NumberSpan span, Err *err);
bool sequence_add_range(Sequence *s, const Pattern *p, const FrameRange *r, Err *err);
bool sequence_add_matches(Sequence *s, const Pattern *p, const char *text, Err *err);
bool sequence_add_directory(Sequence *s, const char *path, const FrameRange *r, IsVolumeFn *is_volume, Err *err);
