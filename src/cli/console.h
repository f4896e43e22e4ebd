/* console.h: words for people on standard error, and the progress bar, which only a terminal sees; or both as lines of JSON
 * for a program: {"level":"problem" | "note" | "detail","message":TEXT} and {"level":"progress","done":N,"total":N or null}. */
#pragma once
#include "base/base.h"

typedef enum Loudness { LOUD_QUIET, LOUD_NORMAL, LOUD_VERBOSE } Loudness;

typedef struct Console {
    Loudness loudness;
    bool json;
    bool terminal;         /* standard error is one */
    bool bar_shown;
    double started_s, shown_s;
} Console;

Console console_make(Loudness loudness);
/* Seconds of a clock that never goes back. */
double console_clock(void);

/* A sentence: problems are always said, notes unless quiet, details only when verbose. */
void console_problem(Console *c, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
void console_note(Console *c, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
void console_detail(Console *c, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* total: 0 when it is not known. */
void console_progress(Console *c, int done, int total);
/* Wipes the bar. */
void console_clear(Console *c);
