#include "io/isolate_priv.h"

#include <string.h>
#include <strings.h>

/* To add a format: its reader in a file of its own, and a line here. */
static const Format *const FORMATS[] = {
    &VDB_FORMAT, &NVDB_FORMAT, &NPY_FORMAT, &RAW_FORMAT, &NRRD_FORMAT, &NHDR_FORMAT, &UNI_FORMAT, &EXR_FORMAT,
};
enum { NFORMAT = sizeof FORMATS / sizeof *FORMATS };

static const Format *format_find(const char *path)
{
    size_t n = strlen(path);
    for (int i = 0; i < NFORMAT; i++) {
        size_t e = strlen(FORMATS[i]->ending);
        if (n > e && path[n - e - 1] != '/' && strcasecmp(path + n - e, FORMATS[i]->ending) == 0) return FORMATS[i];
    }
    return NULL;
}

static bool format_unknown(const char *path, Err *err)
{
    char known[300] = "";
    for (int i = 0; i < NFORMAT; i++) {
        size_t n = strlen(known);
        snprintf(known + n, sizeof known - n, "%s%s (%s)", i ? ", " : "", FORMATS[i]->ending, FORMATS[i]->name);
    }
    return fail(err, ERR_INPUT, "%s: its ending names no known volume format; known are %s", path, known);
}

bool volume_is_known(const char *path) { return format_find(path) != NULL; }

/* --- a file's grids ----------------------------------------------------------------------------- */

static VolumeFile *open_by(const Format *reader, const char *path, const VolumeRequest *request, Err *err)
{
    const Format *format = format_find(path);
    if (!format) {
        format_unknown(path, err);
        return NULL;
    }
    if (!reader) reader = format;
    VolumeFile *f = mem_zero(1, reader->file_size);
    f->format = format;
    f->reader = reader;
    f->path = path;
    f->request = request;
    if (reader->open(f, err)) return f;
    volume_close(f);
    return NULL;
}

VolumeFile *volume_open_here(const char *path, const VolumeRequest *request, Err *err) { return open_by(NULL, path, request, err); }

VolumeFile *volume_open(const char *path, const VolumeRequest *request, Err *err)
{
    return open_by(isolate_is_on() ? &REMOTE_FORMAT : NULL, path, request, err);
}

void volume_close(VolumeFile *f)
{
    if (!f) return;
    f->reader->close(f);
    mem_free(f->entry);
    mem_free(f);
}

const char *volume_format_name(const VolumeFile *f) { return f->format->name; }
int volume_count(const VolumeFile *f) { return f->nentry; }
const VolumeEntry *volume_entry(const VolumeFile *f, int i) { return &f->entry[i]; }

VolumeEntry *volume_add_entry(VolumeFile *f, const char *name, const char *type, int ncomp)
{
    RESERVE(f->entry, f->capentry, f->nentry + 1);
    VolumeEntry *e = &f->entry[f->nentry++];
    *e = (VolumeEntry){.ncomp = ncomp};
    snprintf(e->name, sizeof e->name, "%s", name);
    snprintf(e->type, sizeof e->type, "%s", type);
    for (char *c = e->name; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?';
    return e;
}

int volume_find(const VolumeFile *f, const char *name)
{
    size_t n = strlen(name);
    for (int i = 0; i < f->nentry; i++)
        if (strcmp(f->entry[i].name, name) == 0) return i;
    for (int i = 0; i < f->nentry; i++)
        if (strncmp(f->entry[i].name, name, n) == 0 && strncmp(f->entry[i].name + n, "[0]", 4) == 0) return i;
    return NONE;
}

bool volume_load(VolumeFile *f, int i, Grid *out, Err *err)
{
    ASSERT(f->entry[i].ncomp == out->ncomp && grid_is_empty(out));
    return f->reader->read(f, i, out, err);
}

/* --- a frame ------------------------------------------------------------------------------------ */

static bool read_attributes(VolumeFile *f, Volume *out, Err *err)
{
    const VolumeRequest *r = f->request;
    out->attribute = NEW(Grid, r->nattribute);
    for (; out->nattribute < r->nattribute; out->nattribute++)
        if (!volume_read_attribute(f, r->attribute[out->nattribute], &out->attribute[out->nattribute], err)) return false;
    return true;
}

static bool read_frame(VolumeFile *f, Volume *out, Err *err)
{
    int i = volume_choose(f, err);
    if (i == NONE || !volume_load(f, i, &out->surface, err)) return false;
    memcpy(out->name, f->entry[i].name, sizeof out->name);
    out->kind = volume_class_of(&f->entry[i], &out->surface);
    out->has_velocity = f->request->velocity != NULL;
    if (out->has_velocity && !volume_read_velocity(f, f->request->velocity, &out->velocity, err)) return false;
    return f->request->nattribute == 0 || read_attributes(f, out, err);
}

bool volume_read(const char *path, const VolumeRequest *request, Volume *out, Err *err)
{
    *out = (Volume){0};
    grid_init(&out->surface, 1);
    grid_init(&out->velocity, 3);
    VolumeFile *f = volume_open(path, request, err);
    bool ok = f && read_frame(f, out, err);
    volume_close(f);
    if (!ok) volume_free(out);
    return ok;
}

void volume_free(Volume *v)
{
    grid_free(&v->surface);
    grid_free(&v->velocity);
    for (int i = 0; i < v->nattribute; i++) grid_free(&v->attribute[i]);
    mem_free(v->attribute);
    *v = (Volume){0};
}
