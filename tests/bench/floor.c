/* The floor under a run of `twinmesh mesh`: the same frames read and decoded, as many bytes written in as many files in the same way
 * (synced, renamed), and nothing between.
 *   floor PREFIX BYTES FILES GRID ISO VELOCITY|- FRAME...     writes FILES of BYTES in all, and those of each frame after it
 *   floor --fields GRID ISO VELOCITY|- FRAME...               instead builds the fields and keeps as many as a run does, to
 *                                                             tell the memory that they take */
#include "io/file.h"
#include "io/isolate.h"
#include "io/volume.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIELDS_KEPT = 4 }; /* of the frame solved, of the one completed beside it and the one before that, and of the one read ahead */

typedef struct Input {
    VolumeRequest request;
    double iso;
    int nframe;
    char **frame;
} Input;

static Input input_make(int argc, char **argv)
{
    Input in = {.iso = atof(argv[1]), .nframe = argc - 3, .frame = argv + 3};
    in.request.grid = argv[0];
    if (strcmp(argv[2], "-") != 0) in.request.velocity = argv[2];
    return in;
}

/* The files of frame i, of all n, with its share of the bytes. */
static bool write_share(const char *prefix, int64_t bytes, int files, int i, int n, Err *err)
{
    int first = (int)((int64_t)files * i / n), end = (int)((int64_t)files * (i + 1) / n);
    bool ok = true;
    for (int f = first; f < end && ok; f++) {
        size_t size = (size_t)(bytes * (f + 1) / files - bytes * f / files);
        char *data = NEW(char, size), path[4096];
        memset(data, f, size);
        snprintf(path, sizeof path, "%s.%d", prefix, f);
        OutFile out;
        ok = outfile_open(&out, path, err);
        if (ok) {
            ok = outfile_write(&out, data, size, err) && outfile_commit(&out, err);
            if (!ok) outfile_abort(&out);
        }
        mem_free(data);
    }
    return ok;
}

static bool read_and_write(const Input *in, const char *prefix, int64_t bytes, int files, Err *err)
{
    for (int i = 0; i < in->nframe; i++) {
        Volume v;
        if (!volume_read(in->frame[i], &in->request, &v, err)) return false;
        volume_free(&v);
        if (!write_share(prefix, bytes, files, i, in->nframe, err)) return false;
    }
    return true;
}

static bool build_fields(const Input *in, Err *err)
{
    Field field[FIELDS_KEPT] = {0};
    Grid velocity[FIELDS_KEPT] = {0};
    bool ok = true;
    for (int i = 0; i < in->nframe && ok; i++) {
        Volume v;
        int k = i % FIELDS_KEPT;
        field_free(&field[k]);
        grid_free(&velocity[k]);
        field[k] = (Field){0};
        velocity[k] = (Grid){0};
        ok = volume_read(in->frame[i], &in->request, &v, err);
        if (!ok) break;
        FieldSpec spec = volume_choose_surface(&v, in->iso, 0).spec;
        ok = field_take(&field[k], &v.surface, &spec, err);
        velocity[k] = v.velocity;
        v.velocity = (Grid){0};
        volume_free(&v);
    }
    for (int k = 0; k < FIELDS_KEPT; k++) {
        field_free(&field[k]);
        grid_free(&velocity[k]);
    }
    return ok;
}

int main(int argc, char **argv)
{
    bool fields = argc > 1 && strcmp(argv[1], "--fields") == 0;
    int first = fields ? 2 : 4;
    if (argc < first + 4) {
        fputs("floor PREFIX BYTES FILES GRID ISO VELOCITY|- FRAME...\nfloor --fields GRID ISO VELOCITY|- FRAME...\n", stderr);
        return 2;
    }
    Err err = {0};
    Input in = input_make(argc - first, argv + first);
    bool ok = isolate_start(ISOLATE_LIMITS, &err) &&
        (fields ? build_fields(&in, &err) : read_and_write(&in, argv[1], atoll(argv[2]), atoi(argv[3]), &err));
    isolate_stop();
    if (!ok) fprintf(stderr, "floor: %s\n", err.text);
    return ok ? 0 : 3;
}
