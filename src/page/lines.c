#include "page/page_priv.h"

#include <jansson.h>

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* --- what the lines of each file are ----------------------------------------------------------------- */

static bool is_text(const json_t *line, const char *name) { return json_is_string(json_object_get(line, name)); }

static bool is_one_of(const json_t *line, const char *name, const char *const *texts)
{
    const char *text = json_string_value(json_object_get(line, name));
    for (; text && *texts; texts++)
        if (strcmp(text, *texts) == 0) return true;
    return false;
}

static bool is_place(const json_t *place)
{
    for (size_t a = 0; a < 3; a++)
        if (!json_is_number(json_array_get(place, a))) return false;
    return json_array_size(place) == 3;
}

static bool are_places(const json_t *places)
{
    for (size_t i = 0; i < json_array_size(places); i++)
        if (!is_place(json_array_get(places, i))) return false;
    return json_is_array(places);
}

static bool is_totals(const json_t *line) { return json_is_object(json_object_get(line, "totals")); }

static bool is_settings(const json_t *line) { return is_text(line, "version") && json_is_object(json_object_get(line, "settings")); }

static bool is_frame(const json_t *line)
{
    static const char *const fates[] = {"tracked", "held", "skipped", NULL};
    const json_t *events = json_object_get(line, "events"), *surface = json_object_get(line, "surface");
    return is_text(line, "frame") && is_one_of(line, "fate", fates) && (!events || json_is_object(events)) &&
           (!surface || json_is_string(surface));
}

static bool is_event(const json_t *line)
{
    static const char *const census[] = {"components", NULL};
    if (!is_text(line, "frame") || !is_text(line, "kind") || !json_is_array(json_object_get(line, "before")) ||
        !json_is_array(json_object_get(line, "after")))
        return false;
    return is_one_of(line, "kind", census) || (is_place(json_object_get(line, "place")) && are_places(json_object_get(line, "places")));
}

static bool is_timing(const json_t *line) { return is_text(line, "frame"); }

typedef struct LineRule {
    const char *is;                       /* for the sentence */
    bool (*first)(const json_t *line);    /* NULL: as all */
    bool (*usual)(const json_t *line);
} LineRule;

static const LineRule rule[] = {
    [LINES_REPORT] = {"a report", is_settings, is_frame},
    [LINES_EVENTS] = {"a list of events", NULL, is_event},
    [LINES_TIMINGS] = {"a list of times", NULL, is_timing},
};

/* --- one file after the other ------------------------------------------------------------------------ */

typedef struct Lines {
    const char *path;
    const LineRule *rule;
    long number;        /* of the line at hand, from 1 */
    bool ended;         /* the totals were there */
} Lines;

static bool line_is_good(Lines *l, const json_t *line)
{
    if (l->ended) return false;
    if (l->number == 1 && l->rule->first) return l->rule->first(line);
    l->ended = is_totals(line);
    return l->ended || l->rule->usual(line);
}

static bool check_line(Lines *l, const char *text, size_t size, Err *err)
{
    json_error_t error;
    json_t *line = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    bool good = line && line_is_good(l, line);
    if (!line)
        fail(err, ERR_INPUT, "%.500s: line %ld is no JSON (%.200s); take the file that twinmesh mesh wrote", l->path, l->number, error.text);
    else if (!good)
        fail(err, ERR_INPUT, "%.500s: line %ld is none of %s by twinmesh mesh; take the file that it wrote", l->path, l->number, l->rule->is);
    json_decref(line);
    return good;
}

/* In JSON a < stands in texts alone, where it may be written so. */
static bool put_line(OutFile *f, const char *text, size_t size, Err *err)
{
    const char *end = text + size;
    while (text < end) {
        const char *sign = memchr(text, '<', (size_t)(end - text)), *stop = sign ? sign : end;
        if (!outfile_write(f, text, (size_t)(stop - text), err) || (sign && !outfile_write(f, "\\u003c", 6, err))) return false;
        text = stop + (sign != NULL);
    }
    return true;
}

static bool take_line(OutFile *f, Lines *l, const char *text, size_t size, Err *err)
{
    while (size > 0 && (text[size - 1] == '\n' || text[size - 1] == '\r')) size--;
    return check_line(l, text, size, err) && outfile_write(f, l->number > 1 ? ",\n" : "[\n", 2, err) && put_line(f, text, size, err);
}

static bool read_lines(OutFile *f, Lines *l, FILE *in, Err *err)
{
    char *text = NULL;
    size_t room = 0;
    ssize_t size;
    bool good = true;
    while (good && (size = getline(&text, &room, in)) > 0) {
        l->number++;
        good = take_line(f, l, text, (size_t)size, err);
    }
    free(text); /* getline's own */
    if (good && ferror(in)) return fail(err, ERR_INPUT, "%.500s: cannot be read (%s)", l->path, strerror(errno));
    if (good && l->number == 0) return fail(err, ERR_INPUT, "%.500s: is empty; take the file that twinmesh mesh wrote", l->path);
    return good && outfile_write(f, "\n]", 2, err);
}

bool lines_embed(OutFile *f, const char *path, LineKind kind, Err *err)
{
    Lines l = {.path = path, .rule = &rule[kind]};
    FILE *in = fopen(path, "rb");
    if (!in) return fail(err, ERR_INPUT, "%.500s: cannot be opened (%s)", path, strerror(errno));
    bool good = read_lines(f, &l, in, err);
    fclose(in);
    return good;
}
