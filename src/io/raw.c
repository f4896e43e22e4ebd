#include "io/stream.h"

#include <string.h>

static const struct {
    const char *name;
    DenseType type;
} RAW_TYPES[] = {
    {"u8", {'u', 1, false}},  {"i8", {'i', 1, false}},  {"u16", {'u', 2, false}}, {"i16", {'i', 2, false}},
    {"f16", {'f', 2, false}}, {"f32", {'f', 4, false}}, {"f64", {'f', 8, false}},
};

static bool type_find(const char *name, DenseType *type)
{
    for (size_t i = 0; i < sizeof RAW_TYPES / sizeof *RAW_TYPES; i++)
        if (strcmp(RAW_TYPES[i].name, name) == 0) {
            *type = RAW_TYPES[i].type;
            return true;
        }
    return false;
}

typedef struct RawFile {
    VolumeFile base;
    InFile in;
    DenseType type;
    DenseShape shape;
} RawFile;

static bool raw_open(VolumeFile *f, Err *err)
{
    RawFile *raw = (RawFile *)f;
    const int *n = f->request->raw_dims;
    const char *order = f->request->raw_order ? f->request->raw_order : "xyz";
    const char *name = f->request->raw_type ? f->request->raw_type : "f32";
    if (!n[0] && !n[1] && !n[2])
        return fail(err, ERR_USAGE, "%s: a .raw file does not tell its size; give --dims NX,NY,NZ", f->path);
    if (!type_find(name, &raw->type))
        return fail(err, ERR_USAGE, "%s: there is no sample type '%s' (--type u8, i8, u16, i16, f16, f32 or f64)", f->path, name);
    if (strcmp(order, "xyz") != 0 && strcmp(order, "zyx") != 0)
        return fail(err, ERR_USAGE, "%s: there is no sample order '%s' (--order xyz: x fastest, or zyx: z fastest)", f->path, order);
    raw->shape = (DenseShape){{n[0], n[1], n[2]}, order[0] == 'x'};
    volume_add_entry(f, "", name, 1);
    return infile_open(&raw->in, f->path, err);
}

static bool raw_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    RawFile *raw = (RawFile *)f;
    (void)i;
    Stream *s = stream_open(&raw->in, 0, STREAM_PLAIN, err);
    bool ok = s && dense_place(f->path, f->request, NULL, out, err) && dense_read(s, f->path, raw->type, raw->shape, out, err);
    stream_close(s);
    return ok;
}

static void raw_close(VolumeFile *f) { infile_close(&((RawFile *)f)->in); }

const Format RAW_FORMAT = {"raw samples", ".raw", sizeof(RawFile), raw_open, raw_read, raw_close};
