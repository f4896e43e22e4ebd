#include "io/volume_write.h"

#include "io/volume_write_priv.h"

#include <string.h>
#include <strings.h>

static const struct {
    const char *ending;
    WriteVolumeFn *write;
} FORMATS[] = {{".vdb", vdb_write}, {".npy", npy_write}, {".exr", exr_write}};
enum { NFORMAT = sizeof FORMATS / sizeof *FORMATS };

static WriteVolumeFn *writer_of(const char *path)
{
    size_t n = strlen(path);
    for (int i = 0; i < NFORMAT; i++) {
        size_t e = strlen(FORMATS[i].ending);
        if (n > e && path[n - e - 1] != '/' && strcasecmp(path + n - e, FORMATS[i].ending) == 0) return FORMATS[i].write;
    }
    return NULL;
}

bool volume_can_write(const char *path) { return writer_of(path) != NULL; }

void volume_row(const Grid *g, int y, int z, float *out)
{
    for (int x = g->lo[0]; x <= g->hi[0]; x++) *out++ = grid_at(g, x, y, z, 0);
}

bool volume_write(const char *path, const Grid *g, Err *err)
{
    ASSERT(g->ncomp == 1 && !grid_is_empty(g));
    WriteVolumeFn *write = writer_of(path);
    if (!write) return fail(err, ERR_USAGE, "%.400s: volumes are written as .vdb, .npy or .exr; end the name so", path);
    OutFile f;
    if (!outfile_open(&f, path, err)) return false;
    if (write(&f, g, err)) return outfile_commit(&f, err);
    outfile_abort(&f);
    return false;
}
