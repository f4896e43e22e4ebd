/* The reader of PLY: header to a table of properties, each with the place its values go to; then row by row.
 * Nothing is allocated before the file's length has borne out what its header claims. */
#include "io/ply.h"
#include "io/bytes.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

enum {
    MAX_ELEMENT = 16,
    MAX_PROPERTY = 256, /* of one element */
    MAX_NAME = 420,     /* longer than any name that ply_write writes */
    MAX_LINE = 4096,
    MAX_HEADER = 1 << 20,
    MAX_TOKEN = 400, /* of an ascii number */
};

typedef enum Type { T_NONE, T_I8, T_U8, T_I16, T_U16, T_I32, T_U32, T_F32, T_F64 } Type;

static const struct {
    const char *name, *other;
    int bytes;
} type_table[] = {
    [T_NONE] = {"", "", 0},          [T_I8] = {"char", "int8", 1},      [T_U8] = {"uchar", "uint8", 1},
    [T_I16] = {"short", "int16", 2}, [T_U16] = {"ushort", "uint16", 2}, [T_I32] = {"int", "int32", 4},
    [T_U32] = {"uint", "uint32", 4}, [T_F32] = {"float", "float32", 4}, [T_F64] = {"double", "float64", 8},
};

/* Where a property's value of row r goes: f[r * step], or i[r * step], or nowhere. */
typedef struct Property {
    char *name;
    Type type;
    Type count; /* of a list's length; T_NONE: no list */
    float *f;
    int32_t *i;
    int step;
    bool corners; /* the list of a face's vertices */
} Property;

typedef struct Element {
    char *name;
    int64_t count;
    int nprop;
    Property prop[MAX_PROPERTY];
} Element;

typedef struct Reader {
    const char *path;
    FILE *stream;
    Err *err;
    uint64_t left; /* bytes of the file that are not in the buffer yet */
    size_t at, end;
    uint8_t buf[1 << 16];
    bool ascii;
    int nelement;
    Element *element; /* [MAX_ELEMENT] */
    TriMesh *mesh;
} Reader;

static bool refuse(Reader *r, const char *why) { return fail(r->err, ERR_INPUT, "%.800s: %s", r->path, why); }

static bool cut_off(Reader *r)
{
    return refuse(r, "the PLY file ends early (or, ascii, without a last newline); it was cut off, write or "
                     "copy it again");
}

/* --- bytes and words ------------------------------------------------------------------------ */

static void fill(Reader *r)
{
    memmove(r->buf, r->buf + r->at, r->end - r->at);
    r->end -= r->at;
    r->at = 0;
    size_t want = sizeof r->buf - r->end;
    if (want > r->left) want = (size_t)r->left;
    size_t got = want ? fread(r->buf + r->end, 1, want, r->stream) : 0;
    r->end += got;
    r->left = got < want ? 0 : r->left - got;
}

/* The next n bytes, or NULL at the file's end. */
static const uint8_t *take(Reader *r, size_t n)
{
    if (r->end - r->at < n) fill(r);
    if (r->end - r->at < n) return NULL;
    r->at += n;
    return r->buf + r->at - n;
}

static uint64_t bytes_left(const Reader *r) { return r->left + (r->end - r->at); }

/* Skips white space, then takes a word of at most size - 1 characters; empty at the end or where it is too
 * long. A number that touches the file's end may have been cut off: only white space proves it whole. */
static bool take_word(Reader *r, char *word, size_t size)
{
    size_t n = 0;
    const uint8_t *p;
    while ((p = take(r, 1)) != NULL) {
        if (!isspace(*p)) {
            if (n + 1 == size) return false;
            word[n++] = (char)*p;
        } else if (n) {
            break;
        }
    }
    word[n] = 0;
    return n && p;
}

/* --- header ------------------------------------------------------------------------ */

/* A line without its end; false at the file's end or where it is too long. */
static bool take_line(Reader *r, char *line)
{
    for (size_t n = 0; n < MAX_LINE; n++) {
        const uint8_t *p = take(r, 1);
        if (!p) return false;
        if (*p == '\n') {
            if (n && line[n - 1] == '\r') n--;
            line[n] = 0;
            return true;
        }
        line[n] = (char)*p;
    }
    return false;
}

static Type type_of(const char *word)
{
    for (int t = T_I8; word && t <= T_F64; t++)
        if (strcmp(word, type_table[t].name) == 0 || strcmp(word, type_table[t].other) == 0) return (Type)t;
    return T_NONE;
}

static bool parse_element(Reader *r, const char *name, const char *count)
{
    char *end = NULL;
    errno = 0;
    long long n = count && isdigit((unsigned char)*count) ? strtoll(count, &end, 10) : -1;
    if (!name || n < 0 || n > INT32_MAX || errno || *end)
        return refuse(r, "an element line of the PLY header has no usable count");
    if (r->nelement == MAX_ELEMENT) return refuse(r, "the PLY header has more than 16 elements");
    Element *e = &r->element[r->nelement++];
    e->name = mem_text(name);
    e->count = n;
    return true;
}

static bool parse_property(Reader *r, char **save)
{
    static const char bad[] = "a property line of the PLY header cannot be understood";
    if (r->nelement == 0) return refuse(r, bad);
    Element *e = &r->element[r->nelement - 1];
    if (e->nprop == MAX_PROPERTY) return refuse(r, "an element of the PLY file has more than 256 properties");

    Property p = {0};
    const char *word = strtok_r(NULL, " \t", save);
    if (word && strcmp(word, "list") == 0) {
        p.count = type_of(strtok_r(NULL, " \t", save));
        if (p.count == T_NONE || p.count >= T_F32) return refuse(r, bad);
        word = strtok_r(NULL, " \t", save);
    }
    p.type = type_of(word);
    const char *name = strtok_r(NULL, " \t", save);
    if (p.type == T_NONE || !name || strlen(name) >= MAX_NAME) return refuse(r, bad);
    for (int k = 0; k < e->nprop; k++)
        if (strcmp(e->prop[k].name, name) == 0) return refuse(r, "the PLY header names a property twice");
    p.name = mem_text(name);
    e->prop[e->nprop++] = p;
    return true;
}

static bool parse_format(Reader *r, const char *format)
{
    r->ascii = format && strcmp(format, "ascii") == 0;
    if (r->ascii || (format && strcmp(format, "binary_little_endian") == 0)) return true;
    return refuse(r, "only ascii and binary_little_endian PLY are read; convert the file first");
}

static bool parse_header(Reader *r)
{
    char line[MAX_LINE + 1];
    uint64_t whole = bytes_left(r);
    if (!take_line(r, line) || strcmp(line, "ply") != 0)
        return refuse(r, "this is no PLY file: it does not begin with `ply`");
    bool has_format = false;
    while (take_line(r, line)) {
        if (whole - bytes_left(r) > MAX_HEADER) return refuse(r, "the PLY header is longer than a mebibyte");
        char *save = NULL, *word = strtok_r(line, " \t", &save);
        if (!word || strcmp(word, "comment") == 0 || strcmp(word, "obj_info") == 0) continue;
        if (strcmp(word, "end_header") == 0) {
            return has_format ? true : refuse(r, "the PLY header has no format line");
        } else if (strcmp(word, "format") == 0) {
            if (!parse_format(r, strtok_r(NULL, " \t", &save))) return false;
            has_format = true;
        } else if (strcmp(word, "element") == 0) {
            const char *name = strtok_r(NULL, " \t", &save);
            if (!parse_element(r, name, strtok_r(NULL, " \t", &save))) return false;
        } else if (strcmp(word, "property") == 0) {
            if (!parse_property(r, &save)) return false;
        } else {
            return refuse(r, "a line of the PLY header cannot be understood");
        }
    }
    return cut_off(r);
}

/* --- sizes, columns ------------------------------------------------------------------------ */

static Element *find_element(Reader *r, const char *name)
{
    for (int e = 0; e < r->nelement; e++)
        if (strcmp(r->element[e].name, name) == 0) return &r->element[e];
    return NULL;
}

static Property *find_property(Element *e, const char *name, bool list)
{
    for (int k = 0; e && k < e->nprop; k++)
        if (strcmp(e->prop[k].name, name) == 0 && (e->prop[k].count != T_NONE) == list) return &e->prop[k];
    return NULL;
}

static Property *find_corners(Element *face)
{
    Property *p = find_property(face, "vertex_indices", true);
    return p ? p : find_property(face, "vertex_index", true);
}

/* The fewest bytes that a row can take: in ascii a digit and a space each, and three corners where faces list
 * them. */
static uint64_t row_bytes(const Reader *r, Element *e)
{
    const Property *corners = strcmp(e->name, "face") == 0 ? find_corners(e) : NULL;
    uint64_t sum = 0;
    for (int k = 0; k < e->nprop; k++) {
        const Property *p = &e->prop[k];
        uint64_t one = r->ascii ? 2 : (uint64_t)type_table[p->type].bytes;
        if (p->count == T_NONE)
            sum += one;
        else
            sum += (r->ascii ? 2 : (uint64_t)type_table[p->count].bytes) + (p == corners ? 3 * one : 0);
    }
    return sum;
}

static bool check_sizes(Reader *r)
{
    uint64_t need = 0;
    for (int e = 0; e < r->nelement; e++) {
        Element *el = &r->element[e];
        if (el->count && el->nprop == 0)
            return refuse(r, "an element of the PLY file has rows but no properties");
        need += (uint64_t)el->count * row_bytes(r, el); /* 16 times 2^31 times 4 KiB at most */
    }
    return need <= bytes_left(r)
               ? true
               : refuse(r, "the PLY header counts more than the file holds; it was cut off or damaged");
}

static void bind_floats(Element *e, const char *const name[3], float *column)
{
    for (int k = 0; k < 3; k++) {
        Property *p = find_property(e, name[k], false);
        if (!p) continue;
        p->f = column + k;
        p->step = 3;
    }
}

static bool has_all(Element *e, const char *const name[3])
{
    return find_property(e, name[0], false) && find_property(e, name[1], false) &&
           find_property(e, name[2], false);
}

/* What is bound to no column yet and holds real numbers becomes an attribute. */
static void bind_attributes(TriMesh *m, Element *vertex)
{
    m->attr_name = NEW(char *, vertex->nprop);
    m->attr = NEW(float *, vertex->nprop);
    for (int k = 0; k < vertex->nprop; k++) {
        Property *p = &vertex->prop[k];
        if (p->count != T_NONE || p->f || p->i || p->type < T_F32) continue;
        m->attr_name[m->nattr] = mem_text(p->name);
        m->attr[m->nattr] = p->f = NEW(float, m->nvert);
        p->step = 1;
        m->nattr++;
    }
}

static bool bind_columns(Reader *r)
{
    static const char *const pos[3] = {"x", "y", "z"}, *const normal[3] = {"nx", "ny", "nz"},
                             *const velocity[3] = {"vx", "vy", "vz"};
    Element *vertex = find_element(r, "vertex"), *face = find_element(r, "face");
    if (!vertex || !has_all(vertex, pos)) return refuse(r, "the PLY file has no vertices with x, y and z");
    Property *corners = find_corners(face), *parent = find_property(face, "mechanical", false);
    if (face && face->count && !corners)
        return refuse(r, "the faces of the PLY file have no list vertex_indices");

    TriMesh *m = r->mesh;
    bool moves = has_all(vertex, velocity), has_normal = has_all(vertex, normal);
    trimesh_init(m, (int)vertex->count, face ? (int)face->count : 0, moves, parent != NULL);
    bind_floats(vertex, pos, m->pos);
    if (moves) bind_floats(vertex, velocity, m->velocity);
    if (has_normal)
        bind_floats(vertex, normal, m->normal);
    else
        for (size_t i = 0; i < 3 * (size_t)m->nvert; i++) m->normal[i] = 0;

    Property *id = find_property(vertex, "id", false);
    if (id) {
        id->i = m->id;
        id->step = 1;
    } else {
        for (int v = 0; v < m->nvert; v++) m->id[v] = v;
    }
    if (parent) {
        parent->i = m->parent;
        parent->step = 1;
    }
    if (corners) corners->corners = true;
    bind_attributes(m, vertex);
    return true;
}

/* --- rows ------------------------------------------------------------------------ */

static double decode(Type type, const uint8_t *p)
{
    switch (type) {
    case T_I8:
        return (int8_t)p[0];
    case T_U8:
        return p[0];
    case T_I16:
        return (int16_t)get_u16(p);
    case T_U16:
        return get_u16(p);
    case T_I32:
        return (int32_t)get_u32(p);
    case T_U32:
        return get_u32(p);
    case T_F32:
        return (double)get_f32(p);
    case T_F64:
        return get_f64(p);
    case T_NONE:
        break;
    }
    return 0;
}

static bool take_number(Reader *r, Type type, double *out)
{
    if (!r->ascii) {
        const uint8_t *p = take(r, (size_t)type_table[type].bytes);
        if (!p) return cut_off(r);
        *out = decode(type, p);
        return true;
    }
    char word[MAX_TOKEN], *end;
    if (!take_word(r, word, sizeof word)) return cut_off(r);
    *out = strtod(word, &end);
    return *end ? refuse(r, "the PLY file has a word where a number should be") : true;
}

static bool as_int(Reader *r, double x, int32_t *out)
{
    if (!(x >= INT32_MIN && x <= INT32_MAX) || x != floor(x))
        return refuse(r, "the PLY file has an index or identity that is no 32-bit whole number");
    *out = (int32_t)x;
    return true;
}

static bool as_float(Reader *r, double x, float *out)
{
    if (!(fabs(x) <= (double)FLT_MAX))
        return refuse(r, "the PLY file has a value that is not finite or not a 32-bit float");
    *out = (float)x;
    return true;
}

static bool read_corners(Reader *r, const Property *p, int64_t row, int64_t count)
{
    if (count != 3)
        return fail(r->err, ERR_INPUT,
                    "%.800s: face %lld has %lld corners; only triangles are read, triangulate it first",
                    r->path, (long long)row, (long long)count);
    for (int k = 0; k < 3; k++) {
        double x;
        int32_t v = 0;
        if (!take_number(r, p->type, &x) || !as_int(r, x, &v)) return false;
        if (v < 0 || v >= r->mesh->nvert)
            return fail(r->err, ERR_INPUT, "%.800s: face %lld names vertex %d of %d; the file is damaged",
                        r->path, (long long)row, v, r->mesh->nvert);
        r->mesh->tri[3 * row + k] = v;
    }
    return true;
}

static bool read_value(Reader *r, const Property *p, int64_t row)
{
    double x;
    if (p->count != T_NONE) {
        int32_t count = 0;
        if (!take_number(r, p->count, &x) || !as_int(r, x, &count)) return false;
        if (count < 0) return refuse(r, "the PLY file has a list of negative length");
        if (p->corners) return read_corners(r, p, row, count);
        for (int32_t i = 0; i < count; i++)
            if (!take_number(r, p->type, &x)) return false;
        return true;
    }
    if (!take_number(r, p->type, &x)) return false;
    if (p->f) return as_float(r, x, &p->f[row * p->step]);
    if (p->i) return as_int(r, x, &p->i[row * p->step]);
    return true;
}

static bool read_rows(Reader *r)
{
    for (int e = 0; e < r->nelement; e++) {
        const Element *el = &r->element[e];
        for (int64_t row = 0; row < el->count; row++)
            for (int k = 0; k < el->nprop; k++)
                if (!read_value(r, &el->prop[k], row)) return false;
    }
    for (const uint8_t *p; (p = take(r, 1)) != NULL;)
        if (!r->ascii || !isspace(*p))
            return refuse(r, "the PLY file is longer than its header says; it is damaged");
    return true;
}

static bool is_header_sound(Reader *r)
{
    for (int a = 0; a < r->nelement; a++)
        for (int b = 0; b < a; b++)
            if (strcmp(r->element[a].name, r->element[b].name) == 0)
                return refuse(r, "the PLY header names an element twice");
    return true;
}

bool ply_read(const char *path, TriMesh *mesh, Err *err)
{
    *mesh = (TriMesh){0};
    FILE *stream = fopen(path, "rb");
    if (!stream) return fail(err, ERR_INPUT, "%.800s: cannot be opened: %s", path, strerror(errno));
    struct stat st;
    if (fstat(fileno(stream), &st) != 0 || !S_ISREG(st.st_mode)) {
        fclose(stream);
        return fail(err, ERR_INPUT, "%.800s: is no regular file; PLY is read from files only", path);
    }

    Reader *r = NEW0(Reader, 1);
    r->path = path;
    r->stream = stream;
    r->err = err;
    r->left = (uint64_t)st.st_size;
    r->element = NEW0(Element, MAX_ELEMENT);
    r->mesh = mesh;
    bool ok = parse_header(r) && is_header_sound(r) && check_sizes(r) && bind_columns(r) && read_rows(r);

    for (int e = 0; e < r->nelement; e++) {
        for (int k = 0; k < r->element[e].nprop; k++) mem_free(r->element[e].prop[k].name);
        mem_free(r->element[e].name);
    }
    mem_free(r->element);
    mem_free(r);
    fclose(stream);
    if (!ok) trimesh_free(mesh);
    return ok;
}
