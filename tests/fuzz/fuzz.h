/* fuzz.h: what the libFuzzer targets share. The readers take paths: each input becomes a file first. */
#pragma once
#include "field/field.h"
#include "io/volume.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Called by libFuzzer for each input; it must come back, whatever the bytes are. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A file of this process's own under that ending, written anew. */
static inline const char *fuzz_file(const char *ending, const uint8_t *data, size_t size)
{
    static char path[600];
    const char *folder = getenv("TMPDIR");
    snprintf(path, sizeof path, "%.400s/fuzz-%d_0001%s", folder && *folder ? folder : "/tmp", (int)getpid(), ending);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f) != 0) abort();
    return path;
}

/* A failure must be a sentence, one line long. */
static inline void fuzz_check_failure(const Err *err)
{
    if (err->code < ERR_CHECK || err->code > ERR_RESOURCE || !err->text[0] || strchr(err->text, '\n')) abort();
}

/* A surface may run along the walls of the active box, and fill a field's five gigabytes there: too slow to be done often. */
static inline bool fuzz_is_small(const Grid *g)
{
    for (int a = 0; a < 3; a++)
        if (g->hi[a] - g->lo[a] > 512) return false;
    return true;
}

/* Reads all of a volume, and makes of the frame what `twinmesh mesh` makes of it before it tracks. */
static inline void fuzz_volume(const char *path, const VolumeRequest *request)
{
    Err err = {0};
    VolumeFile *f = volume_open(path, request, &err);
    for (int i = 0; f && i < volume_count(f); i++) {
        if (volume_entry(f, i)->ncomp == 0) continue;
        Grid g;
        grid_init(&g, volume_entry(f, i)->ncomp);
        if (!volume_load(f, i, &g, &err)) fuzz_check_failure(&err);
        grid_free(&g);
    }
    volume_close(f);
    Volume v;
    Field field;
    if (!volume_read(path, request, &v, &err)) {
        fuzz_check_failure(&err);
    } else {
        SurfaceChoice choice = volume_choose_surface(&v, NAN, 0);
        if (!fuzz_is_small(&v.surface)) err.code = ERR_NONE;
        else if (field_build(&field, &v.surface, &choice.spec, &err)) field_free(&field);
        else fuzz_check_failure(&err);
        if (v.has_velocity) (void)grid_vector(&v.velocity, vec3(1, 2, 3));
        volume_free(&v);
    }
    remove(path);
}
