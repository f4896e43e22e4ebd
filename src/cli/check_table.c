#include "cli/check_table.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- limits --------------------------------------------------------------------------------------- */

static int find_figure(const char *name, size_t n)
{
    for (int i = 0; i < CHECK_FIGURES; i++)
        if (strlen(check_figure[i].name) == n && strncmp(check_figure[i].name, name, n) == 0) return i;
    return NONE;
}

static void add_limit(CheckTable *t, const char *kind, int figure, double value)
{
    RESERVE(t->limit, t->caplimit, t->nlimit + 1);
    t->limit[t->nlimit++] = (CheckLimit){kind, (CheckFigure)figure, value};
}

/* "geometric." or "mechanical." before a figure's name, which *at is moved to. */
static const char *take_kind(const char **at)
{
    static const char *const kind[] = {"geometric", "mechanical"};
    for (int k = 0; k < 2; k++) {
        size_t n = strlen(kind[k]);
        if (strncmp(*at, kind[k], n) != 0 || (*at)[n] != '.') continue;
        *at += n + 1;
        return kind[k];
    }
    return NULL;
}

/* FIGURE=VALUE at *at, which moves behind it and a comma. */
static bool take_limit(CheckTable *t, const char **at, Err *err)
{
    const char *kind = take_kind(at), *name = *at;
    size_t n = strcspn(name, "=,");
    int figure = find_figure(name, n);
    char *end;
    if (figure == NONE || check_figure[figure].bad == CHECK_BAD_PLAIN)
        return fail(err, ERR_USAGE, "--limit: %.*s is no figure that can be limited (see twinmesh help check)", (int)n,
                    name);
    double value = name[n] == '=' ? strtod(name + n + 1, &end) : NAN;
    if (!isfinite(value) || end == name + n + 1 || (*end && *end != ','))
        return fail(err, ERR_USAGE, "--limit: %s wants a number, such as %s=0.1", check_figure[figure].name,
                    check_figure[figure].name);
    add_limit(t, kind, figure, value);
    *at = *end ? end + 1 : end;
    return true;
}

bool check_table_open(CheckTable *t, const char *limits, Err *err)
{
    *t = (CheckTable){0};
    for (int i = 0; i < CHECK_FIGURES; i++)
        if (!isnan(check_figure[i].limit)) add_limit(t, NULL, i, check_figure[i].limit);
    for (const char *at = limits; at && *at;)
        if (!take_limit(t, &at, err)) return false;
    return true;
}

void check_table_free(CheckTable *t)
{
    mem_free(t->limit);
    mem_free(t->row);
    *t = (CheckTable){0};
}

/* The last one that goes with the kind and figure, or NULL. */
static const CheckLimit *limit_of(const CheckTable *t, const char *kind, int figure)
{
    for (int i = t->nlimit - 1; i >= 0; i--)
        if ((int)t->limit[i].figure == figure && (!t->limit[i].kind || strcmp(t->limit[i].kind, kind) == 0))
            return &t->limit[i];
    return NULL;
}

static bool is_worse(int figure, double a, double b) { return check_figure[figure].bad == CHECK_BAD_LOW ? a < b : a > b; }

static bool is_within(const CheckTable *t, const char *kind, int figure, double value)
{
    const CheckLimit *limit = limit_of(t, kind, figure);
    return !limit || isnan(value) || !is_worse(figure, value, limit->value);
}

static bool line_passed(const CheckTable *t, const CheckLine *line)
{
    for (int i = 0; i < CHECK_FIGURES; i++)
        if (!is_within(t, line->kind, i, line->row.value[i])) return false;
    return true;
}

bool check_table_add(CheckTable *t, const char *kind, const char *frame, const CheckRow *row)
{
    RESERVE(t->row, t->caprow, t->nrow + 1);
    CheckLine *line = &t->row[t->nrow++];
    *line = (CheckLine){.kind = kind, .row = *row};
    snprintf(line->frame, sizeof line->frame, "%s", frame);
    return line_passed(t, line);
}

static bool was_measured(const CheckTable *t, const CheckLimit *limit)
{
    for (int i = 0; i < t->nrow; i++)
        if ((!limit->kind || strcmp(limit->kind, t->row[i].kind) == 0) && !isnan(t->row[i].row.value[limit->figure]))
            return true;
    return false;
}

/* Those that stand in figures.def go with what was measured only. */
static bool was_asked(const CheckLimit *limit)
{
    return limit->kind || limit->value != check_figure[limit->figure].limit;
}

bool check_table_passed(const CheckTable *t)
{
    for (int i = 0; i < t->nrow; i++)
        if (!line_passed(t, &t->row[i])) return false;
    for (int i = 0; i < t->nlimit; i++)
        if (was_asked(&t->limit[i]) && !was_measured(t, &t->limit[i])) return false;
    return t->nrow > 0;
}

/* --- sums over the frames ------------------------------------------------------------------------- */

typedef struct Sum {
    int n;
    double median, worst;
    const char *frame;    /* of the worst, the first of several */
} Sum;

static int compare_reals(const void *pa, const void *pb)
{
    double a = *(const double *)pa, b = *(const double *)pb;
    return a < b ? -1 : a > b;
}

static Sum sum_of(const CheckTable *t, const char *kind, int figure)
{
    Sum s = {.worst = NAN, .median = NAN};
    double *value = NEW(double, t->nrow);
    for (int i = 0; i < t->nrow; i++) {
        double x = t->row[i].row.value[figure];
        if (strcmp(t->row[i].kind, kind) != 0 || isnan(x)) continue;
        if (s.n == 0 || is_worse(figure, x, s.worst)) s.worst = x, s.frame = t->row[i].frame;
        value[s.n++] = x;
    }
    qsort(value, (size_t)s.n, sizeof *value, compare_reals);
    if (s.n) s.median = value[s.n / 2];
    mem_free(value);
    return s;
}

static int rows_of(const CheckTable *t, const char *kind)
{
    int n = 0;
    for (int i = 0; i < t->nrow; i++) n += strcmp(t->row[i].kind, kind) == 0;
    return n;
}

/* --- JSON ----------------------------------------------------------------------------------------- */

static json_t *number(double x)
{
    if (!isfinite(x)) return json_null();
    return x == floor(x) && fabs(x) < 1e15 ? json_integer((json_int_t)x) : json_real(x);
}

static void print_json(json_t *o, FILE *out)
{
    json_dumpf(o, out, JSON_COMPACT | JSON_REAL_PRECISION(9));
    fputc('\n', out);
    json_decref(o);
}

void check_table_print_row(const CheckTable *t, int i, FILE *out)
{
    const CheckLine *line = &t->row[i];
    json_t *o = json_pack("{s:s,s:s,s:b}", "frame", line->frame, "kind", line->kind, "passed", line_passed(t, line));
    for (int f = 0; f < CHECK_FIGURES; f++) json_object_set_new(o, check_figure[f].name, number(line->row.value[f]));
    print_json(o, out);
}

static json_t *kind_summary(const CheckTable *t, const char *kind)
{
    json_t *o = json_pack("{s:i}", "frames", rows_of(t, kind));
    for (int f = 0; f < CHECK_FIGURES; f++) {
        Sum s = sum_of(t, kind, f);
        const CheckLimit *limit = limit_of(t, kind, f);
        if (s.n == 0) continue;
        json_t *sum = json_pack("{s:o,s:o,s:s}", "median", number(s.median), "worst", number(s.worst), "frame", s.frame);
        if (limit) json_object_set_new(sum, "limit", number(limit->value));
        if (limit) json_object_set_new(sum, "passed", json_boolean(is_within(t, kind, f, s.worst)));
        json_object_set_new(o, check_figure[f].name, sum);
    }
    return o;
}

void check_table_print_summary(const CheckTable *t, FILE *out)
{
    json_t *o = json_pack("{s:b}", "passed", check_table_passed(t));
    for (int k = 0; k < 2; k++) {
        const char *kind = k == 0 ? "mechanical" : "geometric";
        if (rows_of(t, kind)) json_object_set_new(o, kind, kind_summary(t, kind));
    }
    json_t *missed = json_array();
    for (int i = 0; i < t->nlimit; i++)
        if (was_asked(&t->limit[i]) && !was_measured(t, &t->limit[i]))
            json_array_append_new(missed, json_string(check_figure[t->limit[i].figure].name));
    if (json_array_size(missed)) json_object_set(o, "not_measured", missed);
    json_decref(missed);
    print_json(o, out);
}

/* --- text ----------------------------------------------------------------------------------------- */

static void print_figure(const CheckTable *t, const char *kind, int f, FILE *out)
{
    Sum s = sum_of(t, kind, f);
    const CheckLimit *limit = limit_of(t, kind, f);
    if (s.n == 0) return;
    fprintf(out, "  %-22s %10.6g %10.6g  %-8s", check_figure[f].name, s.median, s.worst,
            check_figure[f].bad == CHECK_BAD_PLAIN ? "" : s.frame);
    if (limit)
        fprintf(out, " %s %.6g%s", check_figure[f].bad == CHECK_BAD_LOW ? ">=" : "<=", limit->value,
                is_within(t, kind, f, s.worst) ? "" : "  FAILED");
    fputc('\n', out);
}

static void print_kind(const CheckTable *t, const char *kind, FILE *out)
{
    int n = rows_of(t, kind);
    if (n == 0) return;
    fprintf(out, "%s meshes, frames: %d\n  %-22s %10s %10s  %-8s limit\n", kind, n, "", "median", "worst", "at frame");
#define SECTION(text)
#define FIGURE(id, ...) print_figure(t, kind, CHECK_##id, out);
#include "check/figures.def"
    fputc('\n', out);
}

void check_table_print(const CheckTable *t, FILE *out)
{
    print_kind(t, "mechanical", out);
    print_kind(t, "geometric", out);
    for (int i = 0; i < t->nlimit; i++)
        if (was_asked(&t->limit[i]) && !was_measured(t, &t->limit[i]))
            fprintf(out, "%s was not measured: FAILED\n", check_figure[t->limit[i].figure].name);
    fputs(check_table_passed(t) ? "within all limits\n" : t->nrow ? "past a limit\n" : "nothing was measured\n", out);
}

void check_figures_print(FILE *out)
{
    fputs("\nFigures, of which those with < or > can be limited, from above or below; lengths are in voxels:\n", out);
    static const char sign[] = {[CHECK_BAD_PLAIN] = ' ', [CHECK_BAD_HIGH] = '<', [CHECK_BAD_LOW] = '>'};
#define SECTION(text) fprintf(out, "\n%s:\n", text);
#define FIGURE(id, name, bad, limit, what) fprintf(out, "  %-22s %c %s\n", name, sign[CHECK_BAD_##bad], what);
#include "check/figures.def"
}
