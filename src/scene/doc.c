#include "scene/doc.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { DEPTH_MAX = 16 };
#define COORDINATE_MAX 1e6

/* --- the file --------------------------------------------------------------------------------------- */

static bool read_text(Doc *d, FILE *f, size_t *length)
{
    size_t cap = 1 << 16;
    d->text = NEW(char, cap);
    for (*length = 0;;) {
        *length += fread(d->text + *length, 1, cap - 1 - *length, f);
        if (ferror(f)) return fail(d->err, ERR_INPUT, "%s: cannot be read (%s)", d->path, strerror(errno));
        if (*length > JSON_BYTES_MAX) return fail(d->err, ERR_INPUT, "%s: a scene file is at most %d bytes; draw points with \"random\"", d->path, JSON_BYTES_MAX);
        if (*length < cap - 1) break;
        cap *= 2;
        RESIZE(d->text, cap);
    }
    d->text[*length] = 0;
    return true;
}

/* The library's words are for programmers and may have line ends. */
static bool fail_syntax(const Doc *d, const json_error_t *e)
{
    char text[JSON_ERROR_TEXT_LENGTH];
    snprintf(text, sizeof text, "%s", e->text);
    for (char *c = text; *c; c++)
        if ((unsigned char)*c < ' ') *c = ' ';
    return fail(d->err, ERR_INPUT, "%s:%d: is no JSON: %s; mend the text there", d->path, e->line, text);
}

bool doc_open(Doc *d, const char *path, Err *err)
{
    *d = (Doc){.path = path, .err = err};
    FILE *f = fopen(path, "rb");
    if (!f) return fail(err, ERR_INPUT, "%s: cannot be opened (%s)", path, strerror(errno));
    size_t length;
    bool ok = read_text(d, f, &length);
    fclose(f);
    json_error_t e;
    if (ok && !(d->root = json_loadb(d->text, length, JSON_REJECT_DUPLICATES, &e))) ok = fail_syntax(d, &e);
    if (ok && !json_is_object(d->root)) ok = fail(err, ERR_INPUT, "%s:1: a scene is one object, { ... }", path);
    if (!ok) doc_close(d);
    return ok;
}

void doc_close(Doc *d)
{
    json_decref(d->root);
    mem_free(d->text);
    d->root = NULL;
    d->text = NULL;
}

/* --- places: the text is known to be JSON ---------------------------------------------------------------- */

static const char *skip_blanks(const char *p)
{
    while (*p == ' ' || *p == '\t' || *p == '\n' || *p == '\r') p++;
    return p;
}

/* From an opening quote to behind the closing one. */
static const char *skip_string(const char *p)
{
    for (p++; *p && *p != '"'; p++)
        if (*p == '\\' && p[1]) p++;
    return *p ? p + 1 : p;
}

static const char *skip_value(const char *p)
{
    int depth = 0;
    do {
        p = skip_blanks(p);
        if (*p == '"') {
            p = skip_string(p);
        } else if (strchr("{[", *p) && *p) {
            depth++, p++;
        } else if (strchr("}]", *p) && *p) {
            depth--, p++;
        } else if (strchr(",:", *p) && *p) {
            p++;
        } else {
            while (*p && !strchr(" \t\r\n,:]}", *p)) p++;
        }
    } while (*p && depth > 0);
    return p;
}

/* The place's key or item in the container that opens at p, and its value; NULL: it is not there. */
static const char *find_step(const char *p, const Place *step, const char **value)
{
    int i = 0;
    for (p = skip_blanks(p + 1); *p && *p != '}' && *p != ']'; i++) {
        const char *name = p, *end = name;
        if (step->key) {
            end = skip_string(p);
            p = skip_blanks(skip_blanks(end) + 1);
        }
        bool hit = step->key ? (size_t)(end - name) == strlen(step->key) + 2 && strncmp(name + 1, step->key, strlen(step->key)) == 0 : i == step->index;
        if (hit) return *value = p, name;
        p = skip_blanks(skip_value(p));
        if (*p == ',') p = skip_blanks(p + 1);
    }
    return NULL;
}

static int steps_of(const Place *at, const Place *step[DEPTH_MAX])
{
    int n = 0;
    for (; at && n < DEPTH_MAX; at = at->up) step[n++] = at;
    return n;
}

int doc_line(const Doc *d, const Place *at)
{
    const Place *step[DEPTH_MAX];
    const char *value = skip_blanks(d->text), *found = value;
    for (int k = steps_of(at, step) - 1; k >= 0; k--) {
        const char *next = *value == '{' || *value == '[' ? find_step(value, step[k], &value) : NULL;
        if (!next) break;
        found = next;
    }
    int line = 1;
    for (const char *p = d->text; p < found; p++) line += *p == '\n';
    return line;
}

/* `element 3, "translate.keys[2]"` */
static void say_place(const Place *at, char *out, size_t size)
{
    const Place *step[DEPTH_MAX];
    int k = steps_of(at, step) - 1;
    size_t n = 0;
    out[0] = 0;
    if (k >= 1 && step[k]->key && strcmp(step[k]->key, "elements") == 0 && !step[k - 1]->key) {
        n = (size_t)snprintf(out, size, "element %d%s", step[k - 1]->index + 1, k >= 2 ? ", " : ": ");
        k -= 2;
    }
    if (k < 0) return;
    n += (size_t)snprintf(out + n, size - n, "\"");
    for (bool first = true; k >= 0 && n + 40 < size; k--, first = false)
        n += (size_t)(step[k]->key ? snprintf(out + n, size - n, "%s%.30s", first ? "" : ".", step[k]->key) : snprintf(out + n, size - n, "[%d]", step[k]->index + 1));
    snprintf(out + n, size - n, "\": ");
}

bool doc_fail(const Doc *d, const Place *at, const char *fmt, ...)
{
    char place[400], what[400];
    say_place(at, place, sizeof place);
    va_list args;
    va_start(args, fmt);
    vsnprintf(what, sizeof what, fmt, args);
    va_end(args);
    return fail(d->err, ERR_INPUT, "%.300s:%d: %s%s", d->path, doc_line(d, at), place, what);
}

/* --- values ------------------------------------------------------------------------------------------------- */

static void say_names(const char *const *names, char *out, size_t size)
{
    size_t n = 0;
    out[0] = 0;
    for (int i = 0; names[i] && n + 40 < size; i++) n += (size_t)snprintf(out + n, size - n, "%s%s", i == 0 ? "" : names[i + 1] ? ", " : " or ", names[i]);
}

bool doc_check_keys(const Doc *d, const Place *at, const json_t *object, const char *const *known)
{
    char all[400];
    for (void *i = json_object_iter((json_t *)object); i; i = json_object_iter_next((json_t *)object, i)) {
        const char *key = json_object_iter_key(i);
        int k = 0;
        while (known[k] && strcmp(known[k], key) != 0) k++;
        if (known[k]) continue;
        say_names(known, all, sizeof all);
        Place wrong = place_key(at, key);
        return doc_fail(d, &wrong, "is no field that is known there; take it out, or mend its name: %s", all);
    }
    return true;
}

bool doc_real(const Doc *d, const Place *at, const json_t *v, double low, double high, double *out)
{
    double x = json_is_number(v) ? json_number_value(v) : NAN;
    if (!(isfinite(x) && x >= low && x <= high)) return doc_fail(d, at, "must be a number from %.9g to %.9g", low, high);
    *out = x;
    return true;
}

bool doc_reals(const Doc *d, const Place *at, const json_t *v, int n, double low, double high, double *out)
{
    if (!json_is_array(v) || json_array_size(v) != (size_t)n) return doc_fail(d, at, "must be %d numbers in brackets", n);
    for (int i = 0; i < n; i++) {
        Place item = place_item(at, i);
        if (!doc_real(d, &item, json_array_get(v, (size_t)i), low, high, &out[i])) return false;
    }
    return true;
}

bool doc_point(const Doc *d, const Place *at, const json_t *v, Vec3 *out)
{
    double x[3];
    if (!doc_reals(d, at, v, 3, -COORDINATE_MAX, COORDINATE_MAX, x)) return false;
    *out = vec3(x[0], x[1], x[2]);
    return true;
}

bool doc_choice(const Doc *d, const Place *at, const json_t *v, const char *const *names, int *out)
{
    const char *text = json_string_value(v);
    for (int i = 0; text && names[i]; i++)
        if (strcmp(text, names[i]) == 0) return *out = i, true;
    char all[200];
    say_names(names, all, sizeof all);
    return doc_fail(d, at, "must be %s, in quotes", all);
}
