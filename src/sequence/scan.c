#include "sequence/sequence_priv.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

bool sequence_add(Sequence *s, const char *path, NumberSpan span, Err *err)
{
    if (strlen(path) >= FRAME_PATH_MAX) return fail(err, ERR_USAGE, "a path is too long: %.60s...", path);
    RESERVE(s->entry, s->capentry, s->nentry + 1);
    s->entry[s->nentry] = (SequenceEntry){.path = mem_text(path),
                                          .number = span.count ? digits_value(path + span.at, span.count) : NONE,
                                          .digits_at = span.at,
                                          .ndigit = span.count,
                                          .place = s->nentry};
    s->nentry++;
    return true;
}

bool sequence_add_range(Sequence *s, const Pattern *p, const FrameRange *r, Err *err)
{
    /* the suffix alone may be as long as a path: three parts fit 3 * FRAME_PATH_MAX, sequence_add refuses too long ones */
    char *path = NEW(char, 3 * FRAME_PATH_MAX);
    bool ok = true;
    for (int64_t f = r->first; ok && f <= r->last; f += r->step) {
        char digits[32];
        int n = snprintf(digits, sizeof digits, "%0*lld", p->width, (long long)f);
        snprintf(path, 3 * FRAME_PATH_MAX, "%s%s%s", p->prefix, digits, p->suffix);
        ok = sequence_add(s, path, (NumberSpan){(int)strlen(p->prefix), n}, err);
    }
    mem_free(path);
    return ok;
}

/* Names in a directory, sorted, so that nothing depends on the file system's order. */
typedef struct NameList {
    int count, cap;
    char **name;
} NameList;

static int compare_names(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static bool list_directory(const char *path, NameList *out, Err *err)
{
    *out = (NameList){0};
    DIR *d = opendir(path);
    if (!d) return fail(err, ERR_INPUT, "%s: cannot be listed (%s)", path, strerror(errno));
    struct dirent *e;
    while (errno = 0, (e = readdir(d)) != NULL) {
        if (e->d_name[0] == '.') continue;
        RESERVE(out->name, out->cap, out->count + 1);
        out->name[out->count++] = mem_text(e->d_name);
    }
    bool ok = errno == 0 || fail(err, ERR_INPUT, "%s: cannot be listed (%s)", path, strerror(errno));
    closedir(d);
    if (out->count) qsort(out->name, (size_t)out->count, sizeof *out->name, compare_names);
    return ok;
}

static void list_free(NameList *l)
{
    for (int i = 0; i < l->count; i++) mem_free(l->name[i]);
    mem_free(l->name);
}

/* The digits in `name` between the pattern's prefix and suffix, or none. Only what the pattern itself would write:
 * phi.####.vdb has no 00012. */
static NumberSpan pattern_match(const Pattern *p, const char *prefix_base, const char *name)
{
    size_t n = strlen(name), a = strlen(prefix_base), b = strlen(p->suffix);
    NumberSpan none = {0, 0};
    if (n <= a + b || strncmp(name, prefix_base, a) != 0 || strcmp(name + n - b, p->suffix) != 0) return none;
    size_t count = n - a - b;
    if (count < (size_t)p->width || count > FRAME_DIGITS_MAX || strspn(name + a, "0123456789") < count) return none;
    if (count > (size_t)p->width && name[a] == '0') return none;
    return (NumberSpan){(int)a, (int)count};
}

/* "." for a bare name; the base of the prefix is what follows the last slash. */
static const char *split_prefix(const Pattern *p, char *directory)
{
    const char *slash = strrchr(p->prefix, '/');
    if (!slash) {
        strcpy(directory, ".");
        return p->prefix;
    }
    snprintf(directory, FRAME_PATH_MAX, "%.*s", slash == p->prefix ? 1 : (int)(slash - p->prefix), p->prefix);
    return slash + 1;
}

bool sequence_add_matches(Sequence *s, const Pattern *p, const char *text, Err *err)
{
    char directory[FRAME_PATH_MAX], *path = NEW(char, 2 * FRAME_PATH_MAX);
    const char *base = split_prefix(p, directory);
    int stem = (int)(base - p->prefix), before = s->nentry;
    NameList list;
    bool ok = list_directory(directory, &list, err);
    for (int i = 0; ok && i < list.count; i++) {
        NumberSpan span = pattern_match(p, base, list.name[i]);
        if (!span.count) continue;
        snprintf(path, 2 * FRAME_PATH_MAX, "%.*s%s", stem, p->prefix, list.name[i]);
        span.at += stem;
        ok = sequence_add(s, path, span, err);
    }
    list_free(&list);
    mem_free(path);
    if (ok && s->nentry == before) ok = fail(err, ERR_INPUT, "%s: no file matches this pattern", text);
    return ok;
}

/* --- a directory --------------------------------------------------------------------------------- */

/* A name with its digits as '#': files of one sequence share it, whatever the count of digits. */
static void sequence_key(const char *name, NumberSpan span, char *to, size_t size)
{
    snprintf(to, size, "%.*s%s%s", span.at, name, span.count ? "####" : "", name + span.at + span.count);
}

static bool fail_several(const char *path, const NameList *l, Err *err)
{
    char text[500] = "", key[300], seen[300] = "";
    size_t n = 0;
    for (int i = 0; i < l->count && n < sizeof text - 1; i++) {
        NumberSpan span;
        name_find_number(l->name[i], &span);
        sequence_key(l->name[i], span, key, sizeof key);
        if (strcmp(key, seen) == 0) continue;
        strcpy(seen, key);
        snprintf(text + n, sizeof text - n, "%s%s", n ? ", " : "", key);
        n = strlen(text);
    }
    return fail(err, ERR_INPUT, "%s: holds several sequences; give one of them as a pattern: %s", path, text);
}

/* Keeps the volumes; false where they are none, or of several sequences. *width is that of the shortest number. */
static bool keep_one_sequence(const char *path, NameList *l, IsVolumeFn *is_volume, int *width, Err *err)
{
    char first[300] = "", key[300];
    int kept = 0;
    bool several = false;
    *width = FRAME_DIGITS_MAX;
    for (int i = 0; i < l->count; i++) {
        if (is_volume && !is_volume(l->name[i])) {
            mem_free(l->name[i]);
            continue;
        }
        l->name[kept++] = l->name[i];
    }
    l->count = kept;
    for (int i = 0; i < kept; i++) {
        NumberSpan span;
        if (!name_find_number(l->name[i], &span))
            return fail(err, ERR_INPUT, "%s/%s: a frame number has at most %d digits", path, l->name[i], FRAME_DIGITS_MAX);
        sequence_key(l->name[i], span, i ? key : first, sizeof key);
        several |= i && strcmp(key, first) != 0;
        *width = int_min(*width, span.count);
    }
    if (several) return fail_several(path, l, err);
    return kept || fail(err, ERR_INPUT, "%s: holds no volume files", path);
}

bool sequence_add_directory(Sequence *s, const char *path, const FrameRange *r, IsVolumeFn *is_volume, Err *err)
{
    NameList list;
    int width;
    Pattern *p = NEW(Pattern, 1);
    char *file = NEW(char, 2 * FRAME_PATH_MAX);
    const char *slash = path[strlen(path) - 1] == '/' ? "" : "/";
    bool ok = list_directory(path, &list, err) && keep_one_sequence(path, &list, is_volume, &width, err);
    if (ok && r && width) {
        /* a range makes the directory a pattern: frames that are missing in it belong to the run */
        NumberSpan span;
        name_find_number(list.name[0], &span);
        snprintf(p->prefix, sizeof p->prefix, "%s%s%.*s", path, slash, span.at, list.name[0]);
        snprintf(p->suffix, sizeof p->suffix, "%s", list.name[0] + span.at + span.count);
        p->width = width;
        ok = sequence_add_range(s, p, r, err);
    } else if (ok) {
        for (int i = 0; ok && i < list.count; i++) {
            NumberSpan span;
            snprintf(file, 2 * FRAME_PATH_MAX, "%s%s%s", path, slash, list.name[i]);
            name_find_number(file, &span);
            ok = sequence_add(s, file, span, err);
        }
    }
    list_free(&list);
    mem_free(file);
    mem_free(p);
    return ok;
}
