#include "io/volume_write.h"

#include "io/volume_write_priv.h"

#include <string.h>
#include <strings.h>

static const struct {
    const char *ending;
    WriteVolumeFn *write;
    bool dense;
} FORMATS[] = {{".vdb", vdb_write, false}, {".npy", npy_write, true}, {".exr", exr_write, true}};
enum { NFORMAT = sizeof FORMATS / sizeof *FORMATS };
#define DENSE_MAX 4294967296.0 /* samples: 16 GiB */

static int format_of(const char *path)
{
    size_t n = strlen(path);
    for (int i = 0; i < NFORMAT; i++) {
        size_t e = strlen(FORMATS[i].ending);
        if (n > e && path[n - e - 1] != '/' && strcasecmp(path + n - e, FORMATS[i].ending) == 0) return i;
    }
    return NONE;
}

bool volume_can_write(const char *path) { return format_of(path) != NONE; }

void volume_row(const Grid *g, int y, int z, float *out)
{
    for (int x = g->lo[0]; x <= g->hi[0]; x++) *out++ = grid_at(g, x, y, z, 0);
}

bool volume_write(const char *path, const Grid *g, Err *err)
{
    ASSERT(g->ncomp == 1 && !grid_is_empty(g));
    int k = format_of(path);
    if (k == NONE) return fail(err, ERR_USAGE, "%.400s: volumes are written as .vdb, .npy or .exr; end the name so", path);
    double samples = 1;
    for (int a = 0; a < 3; a++) samples *= (double)g->hi[a] - g->lo[a] + 1;
    if (FORMATS[k].dense && samples > DENSE_MAX)
        return fail(err, ERR_OUTPUT, "%.400s: has %.0f samples, and a file that holds them all at most %.0f; write .vdb", path, samples, DENSE_MAX);
    OutFile f;
    if (!outfile_open(&f, path, err)) return false;
    if (FORMATS[k].write(&f, g, err)) return outfile_commit(&f, err);
    outfile_abort(&f);
    return false;
}
