#include "sequence/sequence_priv.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static int compare_entries(const void *a, const void *b)
{
    const SequenceEntry *x = a, *y = b;
    if (x->number != y->number) return x->number < y->number ? -1 : 1;
    return x->place < y->place ? -1 : x->place > y->place;
}

/* Files without a number get their place among all; then order, and no number twice. */
static bool sequence_sort(Sequence *s, Err *err)
{
    for (int i = 0; i < s->nentry; i++)
        if (s->entry[i].number == NONE) s->entry[i].number = i + 1;
    if (s->nentry) qsort(s->entry, (size_t)s->nentry, sizeof *s->entry, compare_entries);
    for (int i = 1; i < s->nentry; i++)
        if (s->entry[i].number == s->entry[i - 1].number)
            return fail(err, ERR_USAGE, "%.400s and %.400s are both frame %lld; give each frame once", s->entry[i - 1].path,
                        s->entry[i].path, (long long)s->entry[i].number);
    return true;
}

static bool add_file(Sequence *s, const char *path, bool ranged, Err *err)
{
    NumberSpan span;
    if (ranged)
        return fail(err, ERR_USAGE, "%s: --frames goes with a pattern (name.####.vdb) or a directory, not with files", path);
    if (!name_find_number(path, &span))
        return fail(err, ERR_INPUT, "%s: a frame number has at most %d digits", path, FRAME_DIGITS_MAX);
    return sequence_add(s, path, span, err);
}

static bool add_argument(Sequence *s, const char *arg, const FrameRange *range, IsVolumeFn *is_volume, Err *err)
{
    struct stat st;
    if (!*arg) return fail(err, ERR_USAGE, "a frame's name is empty");
    if (stat(arg, &st) == 0)
        return S_ISDIR(st.st_mode) ? sequence_add_directory(s, arg, range, is_volume, err) : add_file(s, arg, range != NULL, err);
    Pattern *p = NEW(Pattern, 1);
    PatternKind kind = pattern_parse(arg, p, err);
    bool ok = kind == PATTERN_NONE ? add_file(s, arg, range != NULL, err)
              : kind == PATTERN_WRONG ? false
              : range                 ? sequence_add_range(s, p, range, err)
                                      : sequence_add_matches(s, p, arg, err);
    mem_free(p);
    return ok;
}

bool sequence_open(Sequence *s, int nargs, char *const *args, const char *frames, IsVolumeFn *is_volume, Err *err)
{
    FrameRange range;
    *s = (Sequence){0};
    if (frames && !frame_range_parse(frames, &range, err)) return false;
    if (nargs < 1) return fail(err, ERR_USAGE, "no frames are given; name files, a pattern, a directory or -");
    for (int i = 0; i < nargs; i++) {
        if (strcmp(args[i], "-") != 0) continue;
        if (nargs > 1) return fail(err, ERR_USAGE, "- (names on standard input) goes with no other frames");
        if (frames) return fail(err, ERR_USAGE, "--frames goes with a pattern or a directory, not with standard input");
        s->names = stdin;
        return true;
    }
    bool ok = true;
    for (int i = 0; ok && i < nargs; i++) ok = add_argument(s, args[i], frames ? &range : NULL, is_volume, err);
    ok = ok && sequence_sort(s, err);
    if (!ok) sequence_close(s);
    return ok;
}

void sequence_open_names(Sequence *s, IsVolumeFn *is_wanted)
{
    *s = (Sequence){.names = stdin, .is_wanted = is_wanted};
}

bool sequence_open_numbers(Sequence *s, const char *path, int64_t first, int64_t last, const char *frames, Err *err)
{
    FrameRange r = {first, last, 1};
    *s = (Sequence){0};
    if (frames && !frame_range_parse(frames, &r, err)) return false;
    bool ok = true;
    for (int64_t f = r.first; ok && f <= r.last && f <= last; f += r.step) {
        if (f < first) continue;
        ok = sequence_add(s, path, (NumberSpan){0, 0}, err);
        if (ok) s->entry[s->nentry - 1].number = f;
    }
    if (ok && s->nentry == 0) ok = fail(err, ERR_USAGE, "--frames %s: %.400s has frames %lld to %lld; name some of them", frames, path, (long long)first, (long long)last);
    if (!ok) sequence_close(s);
    return ok;
}

void sequence_close(Sequence *s)
{
    for (int i = 0; i < s->nentry; i++) mem_free(s->entry[i].path);
    mem_free(s->entry);
    map_free(&s->arrived);
    *s = (Sequence){0};
}

void sequence_pick(Sequence *s, int place, int count)
{
    ASSERT(!s->names && place >= 0 && count >= 0 && place <= s->nentry - count);
    for (int i = 0; i < s->nentry; i++)
        if (i < place || i >= place + count) mem_free(s->entry[i].path);
    if (count) memmove(s->entry, s->entry + place, (size_t)count * sizeof *s->entry);
    s->nentry = count;
}

static void frame_fill(Frame *out, const char *path, NumberSpan span, int64_t number)
{
    snprintf(out->path, sizeof out->path, "%s", path);
    out->number = number;
    if (span.count)
        snprintf(out->digits, sizeof out->digits, "%.*s", span.count, path + span.at);
    else
        snprintf(out->digits, sizeof out->digits, "%04d", (int)number);
}

/* The next line that is not empty, without its end. */
static SequenceStep read_name(FILE *f, char *line, size_t size, Err *err)
{
    size_t n = 0;
    errno = 0;
    for (;;) {
        int c = getc(f);
        if (c == EOF && ferror(f)) {
            fail(err, ERR_INPUT, "standard input cannot be read (%s)", strerror(errno));
            return SEQUENCE_ERROR;
        }
        if (c == EOF && n == 0) return SEQUENCE_END;
        if (c == EOF || c == '\n') {
            if (n && line[n - 1] == '\r') n--;
            line[n] = 0;
            if (n) return SEQUENCE_FRAME;
            if (c == EOF) return SEQUENCE_END;
            continue;
        }
        if (c == 0 || n + 1 == size) {
            fail(err, ERR_INPUT, "a name on standard input is %s", c == 0 ? "no text" : "too long");
            return SEQUENCE_ERROR;
        }
        line[n++] = (char)c;
    }
}

static SequenceStep next_arrival(Sequence *s, Frame *out, Err *err)
{
    char line[FRAME_PATH_MAX];
    SequenceStep step;
    do step = read_name(s->names, line, sizeof line, err);
    while (step == SEQUENCE_FRAME && s->is_wanted && !s->is_wanted(line));
    if (step != SEQUENCE_FRAME) return step;
    NumberSpan span;
    if (!name_find_number(line, &span)) {
        fail(err, ERR_INPUT, "%.400s: a frame number has at most %d digits", line, FRAME_DIGITS_MAX);
        return SEQUENCE_ERROR;
    }
    s->narrived++;
    int64_t number = span.count ? digits_value(line + span.at, span.count) : s->narrived;
    int count = s->arrived.count;
    map_put(&s->arrived, (uint64_t)number, 0);
    if (s->arrived.count == count) {
        fail(err, ERR_INPUT, "%.400s: frame %lld came before already; name each frame once", line, (long long)number);
        return SEQUENCE_ERROR;
    }
    frame_fill(out, line, span, number);
    return SEQUENCE_FRAME;
}

SequenceStep sequence_next(Sequence *s, Frame *out, Err *err)
{
    if (s->names) return next_arrival(s, out, err);
    if (s->next == s->nentry) return SEQUENCE_END;
    const SequenceEntry *e = &s->entry[s->next++];
    frame_fill(out, e->path, (NumberSpan){e->digits_at, e->ndigit}, e->number);
    return SEQUENCE_FRAME;
}

int sequence_length(const Sequence *s) { return s->names ? NONE : s->nentry; }
