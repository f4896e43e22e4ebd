#include "io/ply.h"
#include "io/bytes.h"
#include "io/file.h"

#include <ctype.h>
#include <limits.h>
#include <stdarg.h>

/* Rows gathered into large writes; the first failure stops all that follow. */
typedef struct Rows {
    OutFile *file;
    Err *err;
    bool ok;
    size_t used;
    uint8_t bytes[1 << 16];
} Rows;

static void rows_flush(Rows *w)
{
    if (w->ok) w->ok = outfile_write(w->file, w->bytes, w->used, w->err);
    w->used = 0;
}

static uint8_t *rows_room(Rows *w, size_t bytes)
{
    ASSERT(bytes <= sizeof w->bytes);
    if (w->used + bytes > sizeof w->bytes) rows_flush(w);
    w->used += bytes;
    return w->bytes + w->used - bytes;
}

static void put_float(Rows *w, float x) { put_f32(rows_room(w, 4), x); }
static void put_int(Rows *w, int32_t x) { put_i32(rows_room(w, 4), x); }

static void put_vec3(Rows *w, const float *v)
{
    uint8_t *p = rows_room(w, 12);
    for (int k = 0; k < 3; k++) put_f32(p + 4 * k, v[k]);
}

__attribute__((format(printf, 2, 3))) static void put_line(Rows *w, const char *fmt, ...)
{
    char line[512];
    va_list args;
    va_start(args, fmt);
    int n = vsnprintf(line, sizeof line, fmt, args);
    va_end(args);
    ASSERT(n >= 0 && n < (int)sizeof line);
    memcpy(rows_room(w, (size_t)n), line, (size_t)n);
}

/* --- names of attributes ------------------------------------------------------------------------ */

enum { NAME_MAX_LENGTH = 200 };

static bool is_taken(const char *name, char **before, int count)
{
    static const char *const own[] = {"x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz", "id"};
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        if (strcmp(name, own[i]) == 0) return true;
    for (int a = 0; a < count; a++)
        if (strcmp(name, before[a]) == 0) return true;
    return false;
}

/* A word of printable ASCII that no other property bears. The caller frees it. */
static char *property_name(const char *grid, char **before, int count)
{
    size_t n = strlen(grid);
    if (n > NAME_MAX_LENGTH) n = NAME_MAX_LENGTH;
    char *name = NEW(char, n + (size_t)count + 16); /* each collision adds one character */
    for (size_t i = 0; i < n; i++) name[i] = isgraph((unsigned char)grid[i]) ? grid[i] : '_';
    if (n == 0) name[n++] = '_';
    name[n] = 0;
    while (is_taken(name, before, count)) {
        name[n++] = '_';
        name[n] = 0;
    }
    return name;
}

/* --- the three parts of a file ------------------------------------------------------------------------ */

static void put_header(Rows *w, const TriMesh *m)
{
    put_line(w, "ply\nformat binary_little_endian 1.0\nelement vertex %d\n", m->nvert);
    put_line(w, "property float x\nproperty float y\nproperty float z\n"
                "property float nx\nproperty float ny\nproperty float nz\n");
    if (m->velocity) put_line(w, "property float vx\nproperty float vy\nproperty float vz\n");
    put_line(w, "property int id\n");

    char **name = NEW(char *, m->nattr);
    for (int a = 0; a < m->nattr; a++) {
        name[a] = property_name(m->attr_name[a], name, a);
        put_line(w, "property float %.400s\n", name[a]);
    }
    for (int a = 0; a < m->nattr; a++) mem_free(name[a]);
    mem_free(name);

    put_line(w, "element face %d\nproperty list uchar int vertex_indices\n", m->ntri);
    put_line(w, "%send_header\n", m->parent ? "property int mechanical\n" : "");
}

static void put_vertices(Rows *w, const TriMesh *m)
{
    for (int v = 0; v < m->nvert && w->ok; v++) {
        put_vec3(w, m->pos + 3 * (size_t)v);
        put_vec3(w, m->normal + 3 * (size_t)v);
        if (m->velocity) put_vec3(w, m->velocity + 3 * (size_t)v);
        put_int(w, m->id[v]);
        for (int a = 0; a < m->nattr; a++) put_float(w, m->attr[a][v]);
    }
}

static void put_faces(Rows *w, const TriMesh *m)
{
    for (int t = 0; t < m->ntri && w->ok; t++) {
        *rows_room(w, 1) = 3;
        for (int k = 0; k < 3; k++) put_int(w, m->tri[3 * (size_t)t + (size_t)k]);
        if (m->parent) put_int(w, m->parent[t]);
    }
}

bool ply_write(const char *path, const TriMesh *mesh, Err *err)
{
    OutFile file;
    if (!outfile_open(&file, path, err)) return false;
    Rows *w = NEW(Rows, 1);
    w->file = &file;
    w->err = err;
    w->ok = true;
    w->used = 0;

    put_header(w, mesh);
    put_vertices(w, mesh);
    put_faces(w, mesh);
    rows_flush(w);
    bool ok = w->ok;
    mem_free(w);
    if (ok) return outfile_commit(&file, err);
    outfile_abort(&file);
    return false;
}
