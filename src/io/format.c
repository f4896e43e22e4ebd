#include "io/io_priv.h"

#include <string.h>
#include <strings.h>

/* To add a format: its reader in a file of its own, and a line here. */
typedef struct Format {
    const char *name;
    const char *ending;
    ReadVolumeFn *read;
} Format;

static const Format FORMATS[] = {
    {"OpenVDB", ".vdb", vdb_read},
    {"NumPy array", ".npy", npy_read},
    {"raw samples", ".raw", raw_read},
};
enum { NFORMAT = sizeof FORMATS / sizeof *FORMATS };

static const Format *format_find(const char *path)
{
    size_t n = strlen(path);
    for (int i = 0; i < NFORMAT; i++) {
        size_t e = strlen(FORMATS[i].ending);
        if (n > e && path[n - e - 1] != '/' && strcasecmp(path + n - e, FORMATS[i].ending) == 0) return &FORMATS[i];
    }
    return NULL;
}

static bool format_unknown(const char *path, Err *err)
{
    char known[200] = "";
    for (int i = 0; i < NFORMAT; i++) {
        size_t n = strlen(known);
        snprintf(known + n, sizeof known - n, "%s%s (%s)", i ? ", " : "", FORMATS[i].ending, FORMATS[i].name);
    }
    return fail(err, ERR_INPUT, "%s: its ending names no known volume format; known are %s", path, known);
}

bool volume_is_known(const char *path) { return format_find(path) != NULL; }

bool volume_read(const char *path, const VolumeRequest *request, Volume *out, Err *err)
{
    *out = (Volume){0};
    grid_init(&out->surface, 1);
    grid_init(&out->velocity, 3);
    const Format *format = format_find(path);
    bool ok = format ? format->read(path, request, out, err) : format_unknown(path, err);
    if (!ok)
        volume_free(out);
    else if (out->kind == VOLUME_UNKNOWN)
        out->kind = volume_classify(out->name, &out->surface);
    return ok;
}

void volume_free(Volume *v)
{
    grid_free(&v->surface);
    grid_free(&v->velocity);
    *v = (Volume){0};
}
