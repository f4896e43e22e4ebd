#include "io/io_priv.h"

#include <string.h>

enum { CHUNK_BYTES = 1 << 16 };

static float half_to_float(uint16_t h)
{
    uint32_t exponent = h >> 10 & 31, mantissa = h & 1023;
    double v = exponent == 0    ? ldexp(mantissa, -24)
               : exponent < 31  ? ldexp(mantissa + 1024, (int)exponent - 25)
               : mantissa == 0  ? (double)INFINITY
                                : (double)NAN;
    return (float)(h & 0x8000 ? -v : v);
}

/* One sample from its bytes, lowest first in `bits` whatever the order in the file or the machine. */
static float dense_sample(DenseType type, const uint8_t *p)
{
    uint64_t bits = 0;
    for (int i = 0; i < type.size; i++) bits |= (uint64_t)p[type.big_endian ? type.size - 1 - i : i] << 8 * i;
    if (type.kind == 'u') return (float)bits;
    if (type.kind == 'i') return type.size == 1 ? (float)(int8_t)bits : (float)(int16_t)bits;
    if (type.size == 2) return half_to_float((uint16_t)bits);
    if (type.size == 4) {
        float f;
        uint32_t low = (uint32_t)bits;
        memcpy(&f, &low, sizeof f);
        return f;
    }
    double d;
    memcpy(&d, &bits, sizeof d);
    return (float)d;
}

static bool is_sized(InFile *in, int64_t at, DenseType type, const int n[3], Err *err)
{
    for (int a = 0; a < 3; a++) {
        if (n[a] < 1)
            return fail(err, ERR_INPUT, "%s: %d x %d x %d samples are no volume; each must be 1 or more", in->path, n[0],
                        n[1], n[2]);
        if (n[a] > DENSE_SIDE_MAX)
            return fail(err, ERR_INPUT, "%s: %d x %d x %d samples: no side may be longer than %d", in->path, n[0], n[1],
                        n[2], DENSE_SIDE_MAX);
    }
    int64_t plane = (int64_t)n[0] * n[1], want; /* at most 2^40 */
    if (__builtin_mul_overflow(plane, (int64_t)n[2] * type.size, &want) || want != in->length - at)
        return fail(err, ERR_INPUT,
                    "%s: %d x %d x %d samples of %d bytes do not fit the file, which holds %lld bytes of samples; "
                    "it is cut short, or its dimensions or type are others",
                    in->path, n[0], n[1], n[2], type.size, (long long)(in->length - at));
    return true;
}

static bool place_grid(const VolumeRequest *r, const char *path, Grid *out, Err *err)
{
    for (int a = 0; a < 3; a++) {
        double h = r->spacing[a] == 0 ? 1 : r->spacing[a];
        if (!(isfinite(h) && h > 0)) return fail(err, ERR_USAGE, "%s: a voxel size must be above 0 (--spacing)", path);
        if (!isfinite(r->origin[a])) return fail(err, ERR_USAGE, "%s: an origin must be finite (--origin)", path);
        for (int b = 0; b < 3; b++) out->xform.m[a][b] = a == b ? h : 0;
        v_set(&out->xform.t, a, r->origin[a]);
    }
    if (!affine_invert(&out->xform)) return fail(err, ERR_USAGE, "%s: a voxel size is out of range (--spacing)", path);
    return true;
}

bool dense_read(InFile *in, int64_t at, DenseType type, const int n[3], bool x_fastest, const VolumeRequest *request,
                Grid *out, Err *err)
{
    if (!is_sized(in, at, type, n, err) || !place_grid(request, in->path, out, err)) return false;
    /* steps in the array, x fastest, for the fastest, middle and slowest index of the file */
    size_t nx = (size_t)n[0], ny = (size_t)n[1], nz = (size_t)n[2], total = nx * ny * nz;
    size_t side[3] = {x_fastest ? nx : nz, ny, x_fastest ? nz : nx};
    size_t step[3] = {x_fastest ? 1 : nx * ny, nx, x_fastest ? nx * ny : 1};
    size_t size = (size_t)type.size, i = 0, j = 0, k = 0;
    uint8_t *chunk = NEW(uint8_t, CHUNK_BYTES);
    float *value = NEW(float, total);
    bool ok = true;
    for (size_t done = 0; done < total && ok;) {
        size_t count = total - done < CHUNK_BYTES / size ? total - done : CHUNK_BYTES / size;
        ok = infile_read(in, at + (int64_t)(done * size), count * size, chunk, err);
        for (size_t s = 0; s < count && ok; s++) {
            value[i * step[0] + j * step[1] + k * step[2]] = dense_sample(type, chunk + s * size);
            if (++i == side[0]) {
                i = 0;
                if (++j == side[1]) {
                    j = 0;
                    k++;
                }
            }
        }
        done += count;
    }
    if (ok) grid_from_dense(out, value, n);
    mem_free(value);
    mem_free(chunk);
    return ok;
}
