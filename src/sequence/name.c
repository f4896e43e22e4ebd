#include "sequence/sequence_priv.h"

#include <string.h>

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

int64_t digits_value(const char *digits, int n)
{
    ASSERT(n <= FRAME_DIGITS_MAX);
    int64_t v = 0;
    for (int i = 0; i < n; i++) v = 10 * v + (digits[i] - '0');
    return v;
}

bool name_find_number(const char *path, NumberSpan *out)
{
    const char *base = strrchr(path, '/');
    base = base ? base + 1 : path;
    const char *dot = strrchr(base, '.');
    /* "phi.0012" has no ending but a number */
    bool ending = dot && dot > base && dot[1] && strspn(dot + 1, "0123456789") != strlen(dot + 1);
    const char *end = ending ? dot : base + strlen(base);
    while (end > base && !is_digit(end[-1])) end--;
    const char *begin = end;
    while (begin > base && is_digit(begin[-1])) begin--;
    *out = (NumberSpan){(int)(begin - path), (int)(end - begin)};
    return out->count <= FRAME_DIGITS_MAX;
}

/* The length of a place for the number that starts at p, or 0; *width is how many digits it asks for. */
static int placeholder_length(const char *p, int *width)
{
    int n = 0;
    if (*p == '#') {
        while (p[n] == '#') n++;
        *width = n;
        return n;
    }
    if (*p == '$' && p[1] == 'F') {
        *width = 1;
        if (!is_digit(p[2])) return 2;
        *width = p[2] - '0';
        return is_digit(p[3]) ? 0 : 3;
    }
    if (*p != '%') return 0;
    *width = 1;
    if (p[1] == 'd') return 2;
    if (p[1] == '0' && is_digit(p[2]) && p[3] == 'd') {
        *width = p[2] - '0';
        return 4;
    }
    return 0;
}

PatternKind pattern_parse(const char *text, Pattern *out, Err *err)
{
    int at = NONE, length = 0, count = 0;
    const char *slash = strrchr(text, '/');
    if (strlen(text) >= FRAME_PATH_MAX) return fail(err, ERR_USAGE, "a path is too long: %.60s...", text), PATTERN_WRONG;
    for (const char *p = text; *p;) {
        int width, n = placeholder_length(p, &width);
        if (n) {
            count++;
            at = (int)(p - text);
            length = n;
            out->width = int_max(width, 1);
        }
        p += n ? n : 1;
    }
    if (!count) return PATTERN_NONE;
    if (count > 1 || (slash && text + at < slash)) {
        fail(err, ERR_USAGE, "%s: a pattern has one place for the frame number (####, %%04d or $F4), in the file's name", text);
        return PATTERN_WRONG;
    }
    if (out->width > FRAME_DIGITS_MAX) {
        fail(err, ERR_USAGE, "%s: a frame number has at most %d digits", text, FRAME_DIGITS_MAX);
        return PATTERN_WRONG;
    }
    memcpy(out->prefix, text, (size_t)at);
    out->prefix[at] = 0;
    snprintf(out->suffix, sizeof out->suffix, "%s", text + at + length);
    return PATTERN_ONE;
}

bool pattern_name(const char *text, int64_t number, bool alone, char out[FRAME_PATH_MAX], Err *err)
{
    Pattern *p = NEW(Pattern, 1);
    PatternKind kind = pattern_parse(text, p, err);
    int n = 0;
    if (kind == PATTERN_ONE) n = snprintf(out, FRAME_PATH_MAX, "%s%0*lld%s", p->prefix, p->width, (long long)number, p->suffix);
    if (kind == PATTERN_NONE && alone) n = snprintf(out, FRAME_PATH_MAX, "%s", text);
    mem_free(p);
    if (kind == PATTERN_NONE && !alone) return fail(err, ERR_USAGE, "%.400s: has no place for the frame's number; give a pattern such as name.####.vdb", text);
    if (n >= FRAME_PATH_MAX) return fail(err, ERR_USAGE, "a path is too long: %.60s...", text);
    return kind != PATTERN_WRONG;
}

/* A number of at most 18 digits; *p moves behind it. */
static bool range_number(const char **p, int64_t *out)
{
    int n = 0;
    while (is_digit((*p)[n])) n++;
    if (n == 0 || n > FRAME_DIGITS_MAX) return false;
    *out = digits_value(*p, n);
    *p += n;
    return true;
}

bool frame_range_parse(const char *text, FrameRange *out, Err *err)
{
    const char *p = text;
    *out = (FrameRange){0, 0, 1};
    bool ok = range_number(&p, &out->first);
    out->last = out->first;
    if (ok && *p == '-') {
        p++;
        ok = range_number(&p, &out->last);
        if (ok && *p == 'x') {
            p++;
            ok = range_number(&p, &out->step);
        }
    }
    if (!ok || *p) return fail(err, ERR_USAGE, "--frames %s: frames are given as 1-120 or 1-120x2", text);
    if (out->step < 1) return fail(err, ERR_USAGE, "--frames %s: the step must be 1 or more", text);
    if (out->last < out->first) return fail(err, ERR_USAGE, "--frames %s: the last frame comes before the first", text);
    if ((out->last - out->first) / out->step >= FRAME_COUNT_MAX)
        return fail(err, ERR_USAGE, "--frames %s: more than %d frames", text, FRAME_COUNT_MAX);
    return true;
}
