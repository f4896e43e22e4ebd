#include "io/io_priv.h"

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

bool raw_read(const char *path, const VolumeRequest *request, Volume *out, Err *err)
{
    const int *n = request->raw_dims;
    const char *order = request->raw_order ? request->raw_order : "xyz";
    const char *name = request->raw_type ? request->raw_type : "f32";
    DenseType type;
    if (!n[0] && !n[1] && !n[2])
        return fail(err, ERR_USAGE, "%s: a .raw file does not tell its size; give --dims NX,NY,NZ", path);
    if (!type_find(name, &type))
        return fail(err, ERR_USAGE, "%s: there is no sample type '%s' (--type u8, i8, u16, i16, f16, f32 or f64)", path, name);
    if (strcmp(order, "xyz") != 0 && strcmp(order, "zyx") != 0)
        return fail(err, ERR_USAGE, "%s: there is no sample order '%s' (--order xyz: x fastest, or zyx: z fastest)", path, order);
    if (request->grid || request->velocity)
        return fail(err, ERR_USAGE, "%s: a .raw file has no named grids; leave out --grid and --velocity", path);
    InFile in;
    if (!infile_open(&in, path, err)) return false;
    bool ok = dense_read(&in, 0, type, n, order[0] == 'x', request, &out->surface, err);
    infile_close(&in);
    return ok;
}
