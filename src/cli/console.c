#include "cli/console.h"

#include "report/report.h"

#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 30 };

double console_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

Console console_make(Loudness loudness)
{
    return (Console){.loudness = loudness, .terminal = isatty(STDERR_FILENO), .started_s = console_clock()};
}

static void say(Console *c, Loudness level, const char *fmt, va_list args)
{
    static const char *const name[] = {[LOUD_QUIET] = "problem", [LOUD_NORMAL] = "note", [LOUD_VERBOSE] = "detail"};
    char text[1400];
    vsnprintf(text, sizeof text, fmt, args);
    console_clear(c);
    if (c->json) {
        fprintf(stderr, "{\"level\":\"%s\",\"message\":", name[level]);
        report_put_text(stderr, text);
        fputs("}\n", stderr);
    } else {
        fprintf(stderr, "twinmesh: %s\n", text);
    }
}

#define SAY_FROM(least)                                                                                      \
    do {                                                                                                     \
        if (c->loudness < (least)) return;                                                                   \
        va_list args;                                                                                        \
        va_start(args, fmt);                                                                                 \
        say(c, least, fmt, args);                                                                                   \
        va_end(args);                                                                                        \
    } while (0)

void console_problem(Console *c, const char *fmt, ...) { SAY_FROM(LOUD_QUIET); }
void console_note(Console *c, const char *fmt, ...) { SAY_FROM(LOUD_NORMAL); }
void console_detail(Console *c, const char *fmt, ...) { SAY_FROM(LOUD_VERBOSE); }

static void put_time_left(double seconds)
{
    int s = (int)(seconds + 0.5);
    if (s >= 3600)
        fprintf(stderr, "  %d:%02d:%02d left", s / 3600, s / 60 % 60, s % 60);
    else
        fprintf(stderr, "  %d:%02d left", s / 60, s % 60);
}

static void put_progress_line(int done, int total)
{
    fprintf(stderr, "{\"level\":\"progress\",\"done\":%d,\"total\":", done);
    fprintf(stderr, total ? "%d}\n" : "null}\n", total);
}

void console_progress(Console *c, int done, int total)
{
    if (c->json && c->loudness > LOUD_QUIET) put_progress_line(done, total);
    double now = console_clock();
    bool often = c->bar_shown && now - c->shown_s < 0.1 && done != total;
    if (!c->terminal || c->json || c->loudness == LOUD_QUIET || done == 0 || often) return;
    double rate = done / real_max(now - c->started_s, 1e-6);
    if (total) {
        int full = BAR_WIDTH * int_min(done, total) / total;
        fputs("\r[", stderr);
        for (int i = 0; i < BAR_WIDTH; i++) fputc(i < full ? '#' : '.', stderr);
        fprintf(stderr, "] %d/%d frames  %.2f frames/s", done, total, rate);
        put_time_left((total - done) / rate);
    } else {
        fprintf(stderr, "\r%d frames  %.2f frames/s", done, rate);
    }
    fputs("\033[K", stderr);
    fflush(stderr);
    c->bar_shown = true;
    c->shown_s = now;
}

void console_clear(Console *c)
{
    if (!c->bar_shown) return;
    fputs("\r\033[K", stderr);
    c->bar_shown = false;
}
