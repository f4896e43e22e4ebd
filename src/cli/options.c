#include "cli/options.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROW(id, letter, name, kind, argument, fallback, low, high, choices, echo, help)                       \
    {letter, name, OPTION_##kind, argument, fallback, low, high, choices, OPTION_##echo, help},
const OptionSpec option_table[OPTION_COUNT] = {
#define SECTION(heading)
#define OPTION ROW
#include "cli/options.def"
};

/* The tables of the other commands have no headings, and nothing that the report's settings hold. */
#define OPTION ROW
static const OptionSpec field_table[] = {
#include "cli/field.def"
};
#define OPTION ROW
static const OptionSpec info_table[] = {
#include "cli/info.def"
};
#define SECTION(heading)
#define OPTION ROW
static const OptionSpec skin_table[] = {
#include "cli/skin.def"
};
#define OPTION ROW
static const OptionSpec check_table[] = {
#include "cli/check.def"
};
#define OPTION ROW
static const OptionSpec diff_table[] = {
#include "cli/diff.def"
};
#define OPTION ROW
static const OptionSpec render_table[] = {
#include "cli/render.def"
};
#define OPTION ROW
static const OptionSpec report_table[] = {
#include "cli/report.def"
};
#define OPTION ROW
static const OptionSpec farm_table[] = { /* what mesh takes, in the same places, and its own */
#define SECTION(heading)
#include "cli/options.def"
#define OPTION ROW
#include "cli/farm.def"
};
_Static_assert((int)FIELD_OPTION_COUNT <= (int)FARM_OPTION_COUNT && (int)INFO_OPTION_COUNT <= (int)FARM_OPTION_COUNT &&
                   (int)CHECK_OPTION_COUNT <= (int)FARM_OPTION_COUNT && (int)DIFF_OPTION_COUNT <= (int)FARM_OPTION_COUNT &&
                   (int)SKIN_OPTION_COUNT <= (int)FARM_OPTION_COUNT && (int)RENDER_OPTION_COUNT <= (int)FARM_OPTION_COUNT &&
                   (int)REPORT_OPTION_COUNT <= (int)FARM_OPTION_COUNT,
               "Options has room for the largest table");

const OptionTable mesh_options = {"mesh", OPTION_COUNT, option_table};
const OptionTable field_options = {"field", FIELD_OPTION_COUNT, field_table};
const OptionTable info_options = {"info", INFO_OPTION_COUNT, info_table};
const OptionTable skin_options = {"skin", SKIN_OPTION_COUNT, skin_table};
const OptionTable check_options = {"check", CHECK_OPTION_COUNT, check_table};
const OptionTable diff_options = {"diff", DIFF_OPTION_COUNT, diff_table};
const OptionTable render_options = {"render", RENDER_OPTION_COUNT, render_table};
const OptionTable report_options = {"report", REPORT_OPTION_COUNT, report_table};
const OptionTable farm_options = {"farm", FARM_OPTION_COUNT, farm_table};

/* --- values --------------------------------------------------------------------------------------- */

/* Which of the choices the first n letters of text are, or NONE. */
static int choice_find(const char *choices, const char *text, size_t n)
{
    int index = 0;
    for (const char *c = choices;; index++) {
        size_t len = strcspn(c, "|");
        if (len == n && strncmp(c, text, n) == 0) return index;
        if (c[len] == 0) return NONE;
        c += len + 1;
    }
}

/* "a, b or c" */
static void choices_say(const char *choices, char *out, size_t size)
{
    size_t used = 0;
    for (const char *c = choices; *c && used + 8 < size; c++) {
        const char *between = strchr(c + 1, '|') ? ", " : " or ";
        if (*c == '|')
            used += (size_t)snprintf(out + used, size - used, "%s", between);
        else
            out[used++] = *c;
    }
    out[used] = 0;
}

static bool fail_choice(const OptionSpec *spec, const char *text, Err *err)
{
    char all[200];
    choices_say(spec->choices, all, sizeof all);
    return fail(err, ERR_USAGE, "--%s %s: must be %s%s", spec->name, text,
                spec->kind == OPTION_LIST ? "some of (with commas between) " : "", all);
}

static bool parse_list(const OptionSpec *spec, OptionValue *v, Err *err)
{
    v->set = 0;
    for (const char *at = v->text;; at++) {
        size_t n = strcspn(at, ",");
        int c = choice_find(spec->choices, at, n);
        if (c == NONE) return fail_choice(spec, v->text, err);
        v->set |= 1u << c;
        at += n;
        if (*at == 0) return true;
    }
}

/* One number of the wanted kind at *at, which moves behind it. */
static bool take_number(const OptionSpec *spec, const char **at, double *out)
{
    char *end;
    double x = strtod(*at, &end);
    bool whole = spec->kind == OPTION_INT || spec->kind == OPTION_INTS3;
    if (end == *at || !(x >= spec->low && x <= spec->high) || (whole && x != floor(x))) return false;
    *at = end;
    *out = x;
    return true;
}

static bool fail_number(const OptionSpec *spec, const char *text, Err *err)
{
    const char *what = spec->kind == OPTION_REALS3   ? "three numbers with commas between, each"
                       : spec->kind == OPTION_INTS3  ? "three whole numbers with commas between, each"
                       : spec->kind == OPTION_INT    ? "a whole number"
                       : spec->kind == OPTION_LENGTH ? "a length (world units, or voxels with v behind it)"
                                                     : "a number";
    return fail(err, ERR_USAGE, "--%s %s: must be %s from %.9g to %.9g", spec->name, text, what, spec->low,
                spec->high);
}

static bool parse_numbers(const OptionSpec *spec, OptionValue *v, Err *err)
{
    const char *at = v->text;
    int most = spec->kind == OPTION_REALS3 || spec->kind == OPTION_INTS3 ? 3 : 1;
    int n = 0;
    do {
        at += n > 0; /* the comma */
        if (!take_number(spec, &at, &v->real[n])) return fail_number(spec, v->text, err);
    } while (++n < most && *at == ',');
    if (n < most && n != 1) return fail_number(spec, v->text, err);
    if (n < most) v->real[1] = v->real[2] = v->real[0];
    v->in_voxels = spec->kind == OPTION_LENGTH && at[0] == 'v';
    if (v->in_voxels) at++;
    return *at ? fail_number(spec, v->text, err) : true;
}

static bool parse_value(const OptionSpec *spec, OptionValue *v, const char *text, Err *err)
{
    v->text = text;
    switch (spec->kind) {
    case OPTION_FLAG: return true;
    case OPTION_TEXT: return *text ? true : fail(err, ERR_USAGE, "--%s: its %s is empty", spec->name, spec->argument);
    case OPTION_CHOICE:
        v->choice = choice_find(spec->choices, text, strlen(text));
        return v->choice == NONE ? fail_choice(spec, text, err) : true;
    case OPTION_LIST: return parse_list(spec, v, err);
    case OPTION_LATER: return fail(err, ERR_USAGE, "--%s: not in this version", spec->name);
    default: return parse_numbers(spec, v, err);
    }
}

/* --- the command line ----------------------------------------------------------------------------- */

static int find_long(const OptionTable *t, const char *name, size_t n)
{
    for (int i = 0; i < t->count; i++)
        if (strlen(t->spec[i].name) == n && strncmp(t->spec[i].name, name, n) == 0) return i;
    return NONE;
}

static int find_letter(const OptionTable *t, char letter)
{
    for (int i = 0; i < t->count; i++)
        if (t->spec[i].letter == letter) return i;
    return NONE;
}

static bool set_option(Options *o, int id, const char *text, Err *err)
{
    o->value[id].given = true;
    return parse_value(&o->table->spec[id], &o->value[id], text, err);
}

/* argv[*i] is --name or --name=value; *i moves on when the value is the next argument. */
static bool parse_long(Options *o, int argc, char **argv, int *i, Err *err)
{
    const char *name = argv[*i] + 2;
    size_t n = strcspn(name, "=");
    int id = find_long(o->table, name, n);
    if (id == NONE)
        return fail(err, ERR_USAGE, "--%.*s: there is no such option (see twinmesh help %s)", (int)n, name, o->table->command);
    const OptionSpec *spec = &o->table->spec[id];
    if (spec->kind == OPTION_LATER) return set_option(o, id, "", err);
    if (!spec->argument)
        return name[n] ? fail(err, ERR_USAGE, "--%s: takes no value", spec->name) : set_option(o, id, "", err);
    if (name[n]) return set_option(o, id, name + n + 1, err);
    if (*i + 1 >= argc) return fail(err, ERR_USAGE, "--%s: its %s is missing", spec->name, spec->argument);
    return set_option(o, id, argv[++*i], err);
}

/* argv[*i] is -x, -xyz or -xVALUE. */
static bool parse_letters(Options *o, int argc, char **argv, int *i, Err *err)
{
    for (const char *c = argv[*i] + 1; *c; c++) {
        int id = find_letter(o->table, *c);
        if (id == NONE) return fail(err, ERR_USAGE, "-%c: there is no such option (see twinmesh help %s)", *c, o->table->command);
        const OptionSpec *spec = &o->table->spec[id];
        if (spec->argument) {
            if (c[1]) return set_option(o, id, c + 1, err);
            if (*i + 1 >= argc) return fail(err, ERR_USAGE, "-%c: its %s is missing", *c, spec->argument);
            return set_option(o, id, argv[++*i], err);
        }
        if (!set_option(o, id, "", err)) return false;
    }
    return true;
}

bool options_parse(Options *o, int argc, char **argv, Err *err) { return options_parse_by(o, &mesh_options, argc, argv, err); }

bool options_parse_by(Options *o, const OptionTable *table, int argc, char **argv, Err *err)
{
    *o = (Options){.table = table, .operand = NEW0(char *, argc + 1)};
    for (int i = 0; i < table->count; i++) {
        const OptionSpec *spec = &table->spec[i];
        bool good = !spec->fallback || parse_value(spec, &o->value[i], spec->fallback, err);
        ASSERT(good);
        (void)good;
    }
    bool only_operands = false;
    for (int i = 0; i < argc; i++) {
        char *a = argv[i];
        bool is_option = !only_operands && a[0] == '-' && a[1];
        if (!is_option)
            o->operand[o->noperand++] = a;
        else if (strcmp(a, "--") == 0)
            only_operands = true, o->behind = o->noperand;
        else if (!(a[1] == '-' ? parse_long : parse_letters)(o, argc, argv, &i, err))
            return false;
    }
    if (!only_operands) o->behind = o->noperand;
    return true;
}

void options_free(Options *o)
{
    mem_free(o->operand);
    *o = (Options){0};
}

int options_find(const Options *o, const char *name)
{
    int id = find_long(o->table, name, strlen(name));
    ASSERT(id != NONE);
    return id;
}

bool options_suggest(Options *o, int id, const char *text, Err *err)
{
    return o->value[id].given || set_option(o, id, text, err);
}

/* --- help ----------------------------------------------------------------------------------------- */

/* " (0 to 180; default 20)" */
static void print_range(FILE *out, const OptionSpec *spec)
{
    char range[200] = "";
    if (spec->choices)
        choices_say(spec->choices, range, sizeof range);
    else if (spec->low < spec->high)
        snprintf(range, sizeof range, "%.9g to %.9g", spec->low, spec->high);
    if (range[0] && spec->fallback)
        fprintf(out, " (%s; default %s)", range, spec->fallback);
    else if (range[0])
        fprintf(out, " (%s)", range);
}

static void print_option(FILE *out, const OptionSpec *spec)
{
    char left[80];
    snprintf(left, sizeof left, "%c%c%s --%s%s%s", spec->letter ? '-' : ' ', spec->letter ? spec->letter : ' ',
             spec->letter ? "," : " ", spec->name, spec->argument ? " " : "", spec->argument ? spec->argument : "");
    fprintf(out, "  %-32s %s", left, spec->help);
    print_range(out, spec);
    fputc('\n', out);
}

void options_print(FILE *out)
{
#define SECTION(heading) fprintf(out, "\n%s:\n", heading);
#define OPTION(id, ...) print_option(out, &option_table[OPT_##id]);
#include "cli/options.def"
}

void options_print_table(FILE *out, const OptionTable *table)
{
    fputc('\n', out);
    for (int i = 0; i < table->count; i++) print_option(out, &table->spec[i]);
}

void farm_print_options(FILE *out)
{
    options_print_table(out, &(OptionTable){"farm", FARM_OPTION_COUNT - OPTION_COUNT, farm_table + OPTION_COUNT});
}
