#include "cli/info.h"

#include <string.h>

json_t *info_text(const char *s)
{
    char *plain = mem_text(s);
    for (char *c = plain; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?'; /* nothing from a file speaks to the terminal */
    json_t *text = json_string(plain);
    for (char *c = plain; !text && *c; c++)
        if ((unsigned char)*c >= 128) *c = '?'; /* no UTF-8: what is not ASCII is not shown */
    if (!text) text = json_string(plain);
    mem_free(plain);
    return text;
}

json_t *info_real(double x) { return isfinite(x) ? json_real(x == 0 ? 0 : x) : json_null(); }

json_t *info_reals(int n, const double *x)
{
    json_t *array = json_array();
    for (int i = 0; i < n; i++) json_array_append_new(array, info_real(x[i]));
    return array;
}

static void print_value(const json_t *v, int indent, FILE *out);

static void print_scalar(const json_t *v, FILE *out)
{
    if (json_is_string(v)) fputs(json_string_value(v), out);
    else if (json_is_integer(v)) fprintf(out, "%lld", (long long)json_integer_value(v));
    else if (json_is_real(v)) fprintf(out, "%.9g", json_real_value(v));
    else fputs(json_is_true(v) ? "yes" : json_is_false(v) ? "no" : "none", out);
}

static void print_object(const json_t *object, int indent, bool first_in_line, FILE *out)
{
    const char *key;
    json_t *v;
    json_object_foreach((json_t *)object, key, v)
    {
        fprintf(out, "%*s%s:", first_in_line ? 0 : indent, "", key);
        print_value(v, indent + 2, out);
        first_in_line = false;
    }
}

/* Behind `key:`, to the end of the line or lines. */
static void print_value(const json_t *v, int indent, FILE *out)
{
    size_t i;
    json_t *item;
    if (json_is_object(v)) {
        fputc('\n', out);
        print_object(v, indent, false, out);
    } else if (json_is_array(v) && json_is_object(json_array_get(v, 0))) {
        fputc('\n', out);
        json_array_foreach((json_t *)v, i, item)
        {
            fprintf(out, "%*s- ", indent, "");
            print_object(item, indent + 2, true, out);
        }
    } else if (json_is_array(v)) {
        json_array_foreach((json_t *)v, i, item)
        {
            fputc(' ', out);
            print_scalar(item, out);
        }
        fputc('\n', out);
    } else {
        fputc(' ', out);
        print_scalar(v, out);
        fputc('\n', out);
    }
}

void info_print(const json_t *object, FILE *out) { print_object(object, 0, false, out); }
