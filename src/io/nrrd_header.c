#include "io/nrrd_priv.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HEADER_MAX = 1 << 20 };

/* The lines read so far, before they are put together. */
typedef struct Fields {
    const char *path;
    NrrdHeader *out;
    Err *err;
    bool has_sizes, has_type, has_encoding, has_dimension, has_directions, has_origin;
    double spacing[3], min[3], max[3]; /* NaN: not given */
    bool cell[3];                      /* samples sit in the middle of cells that the axis min and max bound */
    double direction[3][3], origin[3]; /* direction[axis][coordinate] */
} Fields;

static bool wrong(Fields *f, const char *field, const char *why)
{
    return fail(f->err, ERR_INPUT, "%.600s: its NRRD header's `%s` %s", f->path, field, why);
}

/* Exactly n numbers. */
static bool numbers(const char *text, int n, double *to)
{
    char *end;
    for (int i = 0; i < n; i++) {
        to[i] = strtod(text, &end);
        if (end == text) return false;
        text = end;
    }
    return text[strspn(text, " \t")] == 0;
}

static bool whole(const char *text, int64_t low, int64_t high, int64_t *to)
{
    double v;
    if (!numbers(text, 1, &v) || !(v >= (double)low && v <= (double)high) || v != floor(v)) return false;
    *to = (int64_t)v;
    return true;
}

/* Vectors in brackets: (1,0,0) (0,1,0) (0,0,1). */
static bool vectors(const char *text, int n, double (*to)[3])
{
    for (int i = 0; i < n; i++) {
        text += strspn(text, " \t");
        if (*text++ != '(') return false;
        for (int k = 0; k < 3; k++) {
            char *end;
            to[i][k] = strtod(text, &end);
            if (end == text) return false;
            text = end + strspn(end, " \t");
            if (*text++ != (k < 2 ? ',' : ')')) return false;
        }
    }
    return text[strspn(text, " \t")] == 0;
}

/* --- fields ------------------------------------------------------------------------------------- */

static bool field_dimension(Fields *f, const char *value)
{
    int64_t n;
    f->has_dimension = whole(value, 1, 16, &n);
    if (!f->has_dimension) return wrong(f, "dimension", "is no number of axes");
    if (n != 3) return wrong(f, "dimension", "is not 3; a volume has three axes: crop or reshape it (unu slice, unu axdelete)");
    return true;
}

static bool field_sizes(Fields *f, const char *value)
{
    double n[3];
    f->has_sizes = numbers(value, 3, n);
    for (int a = 0; f->has_sizes && a < 3; a++) {
        f->has_sizes = n[a] >= 0 && n[a] <= INT32_MAX && n[a] == floor(n[a]);
        if (f->has_sizes) f->out->shape.n[a] = (int)n[a];
    }
    return f->has_sizes || wrong(f, "sizes", "are not three counts of samples");
}

static bool field_type(Fields *f, const char *value)
{
    static const struct {
        DenseType type;
        const char *names; /* with | on both sides */
    } known[] = {
        {{'i', 1, false}, "|signed char|int8|int8_t|"},
        {{'u', 1, false}, "|uchar|unsigned char|uint8|uint8_t|"},
        {{'i', 2, false}, "|short|short int|signed short|signed short int|int16|int16_t|"},
        {{'u', 2, false}, "|ushort|unsigned short|unsigned short int|uint16|uint16_t|"},
        {{'i', 4, false}, "|int|signed int|int32|int32_t|"},
        {{'u', 4, false}, "|uint|unsigned int|uint32|uint32_t|"},
        {{'i', 8, false}, "|longlong|long long|long long int|signed long long|signed long long int|int64|int64_t|"},
        {{'u', 8, false}, "|ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t|"},
        {{'f', 4, false}, "|float|"},
        {{'f', 8, false}, "|double|"},
    };
    char name[48];
    snprintf(name, sizeof name, "|%.40s|", value);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strstr(known[i].names, name)) {
            f->out->type = known[i].type;
            snprintf(f->out->type_name, sizeof f->out->type_name, "%.39s", value);
            return f->has_type = true;
        }
    return wrong(f, "type", "is none of float, double and the integers; convert it (unu convert -t float)");
}

static bool field_encoding(Fields *f, const char *value)
{
    static const char *const names[] = {"|raw|", "|txt|text|ascii|", "|gz|gzip|", "|bz2|bzip2|"};
    char name[32];
    snprintf(name, sizeof name, "|%.16s|", value);
    for (char *c = name; *c; c++)
        if (*c >= 'A' && *c <= 'Z') *c = (char)(*c - 'A' + 'a');
    int i = 0;
    while (i < 4 && !strstr(names[i], name)) i++;
    f->out->encoding = (NrrdEncoding)i;
    f->has_encoding = i < 4;
    return f->has_encoding || wrong(f, "encoding", "is none of raw, text, gzip and bzip2; save it again as one of them (unu save -e gzip)");
}

static bool field_endian(Fields *f, const char *value)
{
    f->out->endian_known = strcmp(value, "little") == 0 || strcmp(value, "big") == 0;
    f->out->type.big_endian = value[0] == 'b';
    return f->out->endian_known || wrong(f, "endian", "is neither little nor big");
}

static bool field_centers(Fields *f, const char *value)
{
    for (int a = 0; a < 3; a++) {
        value += strspn(value, " \t");
        f->cell[a] = strncmp(value, "cell", 4) == 0;
        value += strcspn(value, " \t");
    }
    return true;
}

static bool field_spacings(Fields *f, const char *value) { return numbers(value, 3, f->spacing) || wrong(f, "spacings", "are not three numbers"); }
static bool field_mins(Fields *f, const char *value) { return numbers(value, 3, f->min) || wrong(f, "axis mins", "are not three numbers"); }
static bool field_maxs(Fields *f, const char *value) { return numbers(value, 3, f->max) || wrong(f, "axis maxs", "are not three numbers"); }

static bool field_directions(Fields *f, const char *value)
{
    f->has_directions = vectors(value, 3, f->direction);
    return f->has_directions || wrong(f, "space directions", "are not three vectors such as (1,0,0) (0,1,0) (0,0,1)");
}

static bool field_origin(Fields *f, const char *value)
{
    f->has_origin = vectors(value, 1, &f->origin);
    return f->has_origin || wrong(f, "space origin", "is no vector such as (0,0,0)");
}

static bool field_content(Fields *f, const char *value)
{
    snprintf(f->out->content, sizeof f->out->content, "%s", value);
    return true;
}

static bool field_data_file(Fields *f, const char *value)
{
    if (strncmp(value, "LIST", 4) == 0 || strchr(value, '%'))
        return wrong(f, "data file", "names several files; join them into one (unu join, unu save)");
    if (!*value || strlen(value) >= sizeof f->out->data_file) return wrong(f, "data file", "is no file name");
    strcpy(f->out->data_file, value);
    return true;
}

static bool field_line_skip(Fields *f, const char *value) { return whole(value, 0, 1 << 20, &f->out->line_skip) || wrong(f, "line skip", "is no count of lines"); }
static bool field_byte_skip(Fields *f, const char *value) { return whole(value, -1, (int64_t)1 << 50, &f->out->byte_skip) || wrong(f, "byte skip", "is no count of bytes"); }

/* By name without blanks; what is not here does not matter for a surface. */
static const struct {
    const char *name;
    bool (*read)(Fields *f, const char *value);
} FIELDS[] = {
    {"dimension", field_dimension}, {"sizes", field_sizes},       {"type", field_type},
    {"encoding", field_encoding},   {"endian", field_endian},     {"spacings", field_spacings},
    {"axismins", field_mins},       {"axismaxs", field_maxs},     {"centers", field_centers},
    {"centerings", field_centers},  {"content", field_content},   {"spacedirections", field_directions},
    {"spaceorigin", field_origin},  {"datafile", field_data_file}, {"lineskip", field_line_skip},
    {"byteskip", field_byte_skip},
};

static bool field_read(Fields *f, char *line)
{
    char name[32], *colon = strchr(line, ':');
    if (line[0] == '#') return true;
    if (!colon) return fail(f->err, ERR_INPUT, "%.600s: a line of its NRRD header is no `field: value`; write the file again", f->path);
    if (colon[1] == '=') return true; /* a key of somebody's own */
    size_t n = 0;
    for (const char *c = line; c < colon && n + 1 < sizeof name; c++)
        if (*c != ' ') name[n++] = *c;
    name[n] = 0;
    const char *value = colon + 1 + strspn(colon + 1, " \t");
    for (size_t i = 0; i < sizeof FIELDS / sizeof *FIELDS; i++)
        if (strcasecmp(FIELDS[i].name, name) == 0) return FIELDS[i].read(f, value);
    return true;
}

/* --- the whole ---------------------------------------------------------------------------------- */

/* Spacings and axis mins serve where there are no directions; a spacing may also follow from min and max. */
static void place(Fields *f)
{
    Affine *x = &f->out->xform;
    for (int a = 0; a < 3; a++) {
        int n = f->out->shape.n[a], gaps = f->cell[a] ? n : n - 1;
        double h = f->spacing[a];
        if (isnan(h) && !isnan(f->min[a]) && !isnan(f->max[a]) && gaps > 0) h = (f->max[a] - f->min[a]) / gaps;
        if (isnan(h)) h = 1;
        double first = isnan(f->min[a]) ? 0 : f->min[a] + (f->cell[a] ? 0.5 * h : 0);
        for (int b = 0; b < 3; b++) x->m[b][a] = f->has_directions ? f->direction[a][b] : a == b ? h : 0;
        v_set(&x->t, a, f->has_origin ? f->origin[a] : f->has_directions ? 0 : first);
    }
}

static bool finish(Fields *f)
{
    const char *missing = !f->has_dimension ? "dimension" : !f->has_sizes ? "sizes" : !f->has_type ? "type" : !f->has_encoding ? "encoding" : NULL;
    if (missing) return wrong(f, missing, "is missing; write the file again");
    if (f->out->type.size > 1 && f->out->encoding != NRRD_TEXT && !f->out->endian_known)
        return wrong(f, "endian", "is missing; add `endian: little` or `endian: big`");
    place(f);
    Affine *x = &f->out->xform;
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            if (!(fabs(x->m[a][b]) <= 1e12)) return wrong(f, "spacings", "or directions are no lengths; give --spacing");
    if (!affine_invert(x)) return wrong(f, "spacings", "or directions span no volume; give --spacing");
    return true;
}

bool nrrd_header_read(InFile *in, NrrdHeader *out, Err *err)
{
    *out = (NrrdHeader){.shape.x_fastest = true};
    Fields f = {.path = in->path, .out = out, .err = err};
    for (int a = 0; a < 3; a++) f.spacing[a] = f.min[a] = f.max[a] = NAN;
    size_t size = in->length < HEADER_MAX ? (size_t)in->length : HEADER_MAX;
    char *text = NEW0(char, size + 1);
    bool ok = infile_read(in, 0, size, text, err);
    if (ok && (size < 9 || strncmp(text, "NRRD000", 7) != 0)) ok = fail(err, ERR_INPUT, "%.600s: is no NRRD file", in->path);
    char *line = text;
    for (bool first = true; ok; first = false) {
        char *stop = memchr(line, '\n', size - (size_t)(line - text));
        if (!stop && size == HEADER_MAX) {
            ok = fail(err, ERR_INPUT, "%.600s: its NRRD header does not end", in->path);
            break;
        }
        char *next = stop ? stop + 1 : text + size;
        char *last = stop ? stop : next;
        if (last > line && last[-1] == '\r') last--;
        *last = 0;
        out->end = next - text;
        if (last == line) break;
        ok = first || field_read(&f, line);
        line = next;
    }
    mem_free(text);
    return ok && finish(&f);
}
