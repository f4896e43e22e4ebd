#include "cli/run_report.h"

#include <stdlib.h>
#include <string.h>

enum { LINE_MOST = 1 << 20, LABEL_MOST = 18 };

static int64_t common_divisor(int64_t a, int64_t b)
{
    while (b) {
        int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a < 0 ? -a : a;
}

/* The number of a frame's line, or NONE. */
static int64_t number_of(json_t *line)
{
    const char *label = json_string_value(json_object_get(line, "frame")),
               *fate = json_string_value(json_object_get(line, "fate"));
    if (!label || !fate || strcmp(fate, "skipped") == 0 || strlen(label) > LABEL_MOST) return NONE;
    return strspn(label, "0123456789") == strlen(label) ? strtoll(label, NULL, 10) : NONE;
}

static void take_line(RunReport *r, json_t *line, int64_t *last)
{
    json_t *settings = json_object_get(line, "settings");
    if (!r->settings && json_is_object(settings)) r->settings = json_incref(settings);
    int64_t number = number_of(line);
    if (number == NONE) return;
    if (r->first == NONE) r->first = number;
    else r->step = common_divisor(number - *last, r->step == NONE ? 0 : r->step);
    *last = number;
}

RunReport run_report_read(const char *prefix)
{
    RunReport r = {.first = NONE, .step = NONE};
    size_t size = strlen(prefix) + 16;
    char *path = NEW(char, size), *text = NEW(char, LINE_MOST);
    int64_t last = NONE;
    snprintf(path, size, "%s.report.jsonl", prefix);
    FILE *f = fopen(path, "r");
    while (f && fgets(text, LINE_MOST, f)) {
        json_t *line = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
        if (!line) break;
        take_line(&r, line, &last);
        json_decref(line);
    }
    if (f) fclose(f);
    if (r.first != NONE && r.step < 1) r.step = 1;
    mem_free(text);
    mem_free(path);
    return r;
}

void run_report_free(RunReport *r)
{
    json_decref(r->settings);
    r->settings = NULL;
}

/* The report tells defaults too: an option is given only where it is another. */
static bool suggest(Options *o, int id, const json_t *value, Err *err)
{
    const OptionSpec *spec = &o->table->spec[id];
    char number[32];
    const char *text = json_string_value(value);
    if (json_is_number(value)) {
        snprintf(number, sizeof number, "%.17g", json_number_value(value));
        text = number;
    }
    if (!text || (spec->fallback && strcmp(spec->fallback, text) == 0)) return true;
    if (!options_suggest(o, id, text, err)) return false;
    if (text == number && o->value[id].text == number) o->value[id].text = NULL; /* the number itself is kept */
    return true;
}

bool run_report_suggest(const RunReport *r, Options *o, Err *err)
{
    for (int id = 0; r->settings && id < o->table->count; id++) {
        const char *name = o->table->spec[id].name;
        if (strcmp(name, "frames") != 0 && !suggest(o, id, json_object_get(r->settings, name), err)) return false;
    }
    return true;
}
