#include "io/mesh_sequence.h"

#include "io/gltf_read.h"
#include "io/ply.h"
#include "sequence/pattern.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

struct MeshSequence {
    char *path;         /* of a glTF */
    GltfReader *gltf;   /* NULL: PLY files */
    int64_t first, step;
    int n, cap;
    int64_t *number;    /* [n] */
    char **file;        /* [n] */
};

static bool ends_in(const char *path, const char *ending)
{
    size_t n = strlen(path), e = strlen(ending);
    return n > e && strcasecmp(path + n - e, ending) == 0;
}

static bool is_ply(const char *path) { return ends_in(path, ".ply"); }
static bool is_gltf(const char *path) { return ends_in(path, ".glb") || ends_in(path, ".gltf"); }

static bool exists(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0;
}

bool mesh_sequence_is_prefix(const char *name) { return !is_ply(name) && !is_gltf(name) && !exists(name); }

/* --- PLY files ------------------------------------------------------------------------------------ */

static bool add_files(MeshSequence *s, int n, char *const *name, Err *err)
{
    Sequence files;
    if (!sequence_open(&files, n, name, NULL, is_ply, err)) return false;
    Frame *frame = NEW(Frame, 1);
    while (sequence_next(&files, frame, err) == SEQUENCE_FRAME) {
        if (s->n == s->cap) {
            s->cap = 2 * s->cap + 16;
            RESIZE(s->number, s->cap);
            RESIZE(s->file, s->cap);
        }
        s->number[s->n] = frame->number;
        s->file[s->n++] = mem_text(frame->path);
    }
    mem_free(frame);
    sequence_close(&files);
    return true;
}

/* PREFIX.KIND.NNNN.ply: what is left of the name behind `begin` is digits and the ending. */
static bool is_frame_of(const char *name, const char *begin)
{
    size_t n = strlen(begin);
    if (strncmp(name, begin, n) != 0) return false;
    size_t digits = strspn(name + n, "0123456789");
    return digits > 0 && strcmp(name + n + digits, ".ply") == 0;
}

static char *join(const char *a, const char *b, const char *c, const char *d)
{
    size_t size = strlen(a) + strlen(b) + strlen(c) + strlen(d) + 1;
    char *text = NEW(char, size);
    snprintf(text, size, "%s%s%s%s", a, b, c, d);
    return text;
}

/* The files PREFIX.KIND.NNNN.ply; the caller frees the list and its names. */
static char **list_prefix(const char *prefix, const char *kind, int *count)
{
    const char *slash = strrchr(prefix, '/');
    char *folder = join(slash ? prefix : ".", "", "", "");
    char *begin = join(slash ? slash + 1 : prefix, ".", kind, ".");
    if (slash) folder[slash == prefix ? 1 : slash - prefix] = 0;
    char **name = NULL;
    int n = 0, cap = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; d && (e = readdir(d)) != NULL;) {
        if (!is_frame_of(e->d_name, begin)) continue;
        RESERVE(name, cap, n + 1);
        name[n++] = join(folder, "/", e->d_name, "");
    }
    if (d) closedir(d);
    mem_free(folder);
    mem_free(begin);
    *count = n;
    return name;
}

static void list_free(char **name, int n)
{
    for (int i = 0; i < n; i++) mem_free(name[i]);
    mem_free(name);
}

/* --- any ------------------------------------------------------------------------------------------ */

static bool add_gltf(MeshSequence *s, const char *path, Err *err)
{
    s->gltf = gltf_reader_open(path, err);
    if (!s->gltf) return false;
    s->path = mem_text(path);
    s->n = gltf_reader_length(s->gltf);
    return true;
}

/* PREFIX.KIND.glb or .gltf; NULL: neither is there. The caller frees it. */
static char *find_gltf(const char *prefix, const char *kind)
{
    for (int i = 0; i < 2; i++) {
        char *path = join(prefix, ".", kind, i == 0 ? ".glb" : ".gltf");
        if (exists(path)) return path;
        mem_free(path);
    }
    return NULL;
}

bool mesh_sequence_is_there(const char *prefix, const char *kind)
{
    int n;
    char **name = list_prefix(prefix, kind, &n), *gltf = find_gltf(prefix, kind);
    bool there = n > 0 || gltf;
    list_free(name, n);
    mem_free(gltf);
    return there;
}

static bool add_prefix(MeshSequence *s, const char *prefix, const char *kind, Err *err)
{
    int n;
    char **name = list_prefix(prefix, kind, &n), *gltf = n ? NULL : find_gltf(prefix, kind);
    bool ok = n      ? add_files(s, n, name, err)
              : gltf ? add_gltf(s, gltf, err)
                     : fail(err, ERR_INPUT, "%.300s: there are neither files %.300s.%s.NNNN.ply nor a .glb or .gltf",
                            prefix, prefix, kind);
    list_free(name, n);
    mem_free(gltf);
    return ok;
}

static bool add_any(MeshSequence *s, char *name, const char *kind, Err *err)
{
    if (is_gltf(name)) return add_gltf(s, name, err);
    return mesh_sequence_is_prefix(name) ? add_prefix(s, name, kind, err) : add_files(s, 1, &name, err);
}

MeshSequence *mesh_sequence_open(const char *name, const char *kind, Err *err)
{
    MeshSequence *s = NEW0(MeshSequence, 1);
    char *own = mem_text(name);
    s->step = 1;
    bool ok = add_any(s, own, kind, err);
    mem_free(own);
    if (ok) return s;
    mesh_sequence_close(s);
    return NULL;
}

void mesh_sequence_close(MeshSequence *s)
{
    if (!s) return;
    for (int i = 0; !s->gltf && i < s->n; i++) mem_free(s->file[i]);
    if (s->gltf) gltf_reader_close(s->gltf);
    mem_free(s->file);
    mem_free(s->number);
    mem_free(s->path);
    mem_free(s);
}

bool mesh_sequence_is_gltf(const MeshSequence *s) { return s->gltf != NULL; }

void mesh_sequence_number_from(MeshSequence *s, int64_t first, int64_t step)
{
    ASSERT(step >= 1);
    s->first = first;
    s->step = step;
}

int mesh_sequence_length(const MeshSequence *s) { return s->n; }

int64_t mesh_sequence_number(const MeshSequence *s, int i)
{
    return s->gltf ? s->first + s->step * gltf_reader_frame(s->gltf, i) : s->number[i];
}

const char *mesh_sequence_path(const MeshSequence *s, int i) { return s->gltf ? s->path : s->file[i]; }

int mesh_sequence_find(const MeshSequence *s, int64_t number)
{
    int lo = 0, hi = s->n;
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (mesh_sequence_number(s, mid) < number) lo = mid + 1;
        else hi = mid;
    }
    return lo < s->n && mesh_sequence_number(s, lo) == number ? lo : NONE;
}

bool mesh_sequence_read(MeshSequence *s, int i, TriMesh *mesh, Err *err)
{
    ASSERT(i >= 0 && i < s->n);
    return s->gltf ? gltf_reader_mesh(s->gltf, i, mesh, err) : ply_read(s->file[i], mesh, err);
}
