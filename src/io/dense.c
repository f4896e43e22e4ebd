#include "io/stream.h"

#include <stdlib.h>
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

/* Lowest first in `bits` whatever the order in the file or the machine. */
static inline float sample(DenseType type, const uint8_t *p)
{
    uint64_t bits = 0;
    for (int i = 0; i < type.size; i++) bits |= (uint64_t)p[type.big_endian ? type.size - 1 - i : i] << 8 * i;
    if (type.kind == 'u') return (float)bits;
    if (type.kind == 'i') {
        int unused = 64 - 8 * type.size; /* the sign moves up to the top and back */
        return (float)((int64_t)(bits << unused) >> unused);
    }
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

float dense_sample(DenseType type, const uint8_t *p) { return sample(type, p); }

/* --- sizes and places --------------------------------------------------------------------------- */

bool dense_count(const char *path, const int n[3], int ncomp, int64_t *count, Err *err)
{
    for (int a = 0; a < 3; a++) {
        if (n[a] < 1)
            return fail(err, ERR_INPUT, "%.600s: %d x %d x %d samples are no volume; each must be 1 or more", path, n[0], n[1], n[2]);
        if (n[a] > DENSE_SIDE_MAX)
            return fail(err, ERR_INPUT, "%.600s: %d x %d x %d samples: no side may be longer than %d", path, n[0], n[1], n[2],
                        DENSE_SIDE_MAX);
    }
    *count = (int64_t)n[0] * n[1] * n[2] * ncomp; /* below 2^62 */
    return true;
}

static bool misfit(const char *path, const int n[3], int64_t size, const char *holds, int64_t bytes, Err *err)
{
    return fail(err, ERR_INPUT,
                "%.600s: %d x %d x %d samples of %lld bytes do not fit the file, which holds %s%lld bytes of samples; "
                "it is cut short, or its dimensions or type are others",
                path, n[0], n[1], n[2], (long long)size, holds, (long long)bytes);
}

bool dense_place(const char *path, const VolumeRequest *r, const Affine *own, Grid *out, Err *err)
{
    if (own) out->xform = *own;
    for (int a = 0; a < 3; a++) {
        if (r->spacing[a] != 0)
            for (int b = 0; b < 3; b++) out->xform.m[b][a] = a == b ? r->spacing[a] : 0;
        if (r->has_origin) v_set(&out->xform.t, a, r->origin[a]);
        if (!(isfinite(r->spacing[a]) && r->spacing[a] >= 0))
            return fail(err, ERR_USAGE, "%.600s: a voxel size must be above 0 (--spacing)", path);
        if (!(fabs(v_get(out->xform.t, a)) <= 1e12))
            return fail(err, ERR_USAGE, "%.600s: an origin must be finite, and 1e12 at most (--origin)", path);
    }
    if (!affine_invert(&out->xform)) return fail(err, ERR_USAGE, "%.600s: a voxel size is out of range (--spacing)", path);
    return true;
}

/* --- samples ------------------------------------------------------------------------------------ */

/* A sample each from n of them. */
static void decode(DenseType type, const uint8_t *p, size_t n, float *value)
{
    const DenseType common = {'f', 4, false}; /* known here, a sample is one load */
    if (type.kind == common.kind && type.size == common.size && !type.big_endian)
        for (size_t i = 0; i < n; i++) value[i] = sample(common, p + 4 * i);
    else
        for (size_t i = 0; i < n; i++) value[i] = sample(type, p + i * (size_t)type.size);
}

/* Into a grid from values in the file's order. */
static void fill(Grid *out, DenseShape shape, const float *value)
{
    size_t ncomp = (size_t)out->ncomp, ny = (size_t)shape.n[1], nz = (size_t)shape.n[2];
    if (shape.x_fastest) grid_from_dense(out, value, shape.n);
    else grid_from_array(out, value, shape.n, (size_t[3]){ncomp * nz * ny, ncomp * nz, ncomp});
}

bool dense_read(Stream *s, const char *path, DenseType type, DenseShape shape, Grid *out, Err *err)
{
    int64_t total, want, most = stream_most(s);
    if (!dense_count(path, shape.n, out->ncomp, &total, err)) return false;
    if (__builtin_mul_overflow(total, (int64_t)type.size, &want) || want > most)
        return misfit(path, shape.n, type.size * out->ncomp, "at most ", most, err);
    size_t size = (size_t)type.size, got = 0;
    uint8_t *chunk = NEW(uint8_t, CHUNK_BYTES);
    float *value = NEW(float, total);
    bool ok = true;
    for (int64_t done = 0; done < total && ok;) {
        size_t count = total - done < (int64_t)(CHUNK_BYTES / size) ? (size_t)(total - done) : CHUNK_BYTES / size;
        ok = stream_read(s, count * size, chunk, err);
        if (ok) decode(type, chunk, count, value + done);
        done += (int64_t)count;
    }
    ok = ok && stream_take(s, 1, chunk, &got, err);
    if (ok && got) ok = misfit(path, shape.n, type.size * out->ncomp, "more than ", want, err);
    if (ok) fill(out, shape, value);
    mem_free(value);
    mem_free(chunk);
    return ok;
}

/* --- numbers as text ---------------------------------------------------------------------------- */

/* The stream's words, cut at blanks and commas. */
typedef struct Words {
    Stream *s;
    size_t at, end;
    bool closed; /* something stands behind the last word: it is whole */
    char text[4096];
} Words;

static bool words_char(Words *w, char *c, Err *err)
{
    *c = 0;
    if (w->at == w->end) {
        w->at = 0;
        if (!stream_take(w->s, sizeof w->text, w->text, &w->end, err)) return false;
        if (w->end == 0) return true;
    }
    *c = w->text[w->at++];
    return true;
}

static bool is_between(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ',' || c == '\v' || c == '\f'; }

/* The next word, "" at the end. A word too long for a number is cut. */
static bool words_next(Words *w, char *word, size_t size, Err *err)
{
    size_t n = 0;
    char c;
    do {
        if (!words_char(w, &c, err)) return false;
    } while (is_between(c));
    while (c && !is_between(c)) {
        if (n + 1 < size) word[n++] = c;
        if (!words_char(w, &c, err)) return false;
    }
    word[n] = 0;
    w->closed = c != 0;
    return true;
}

static bool read_words(Words *w, const char *path, float *value, int64_t total, Err *err)
{
    char word[64], *end;
    for (int64_t i = 0; i < total; i++) {
        if (!words_next(w, word, sizeof word, err)) return false;
        double v = strtod(word, &end);
        if (end == word || *end)
            return fail(err, ERR_INPUT, "%.600s: %s where sample %lld of %lld should be; write the file again", path,
                        word[0] ? "something else than a number stands" : "it ends", (long long)i, (long long)total);
        if (!w->closed)
            return fail(err, ERR_INPUT, "%.600s: ends within its last line, which may be cut short; write it again, or end it with a newline", path);
        value[i] = (float)v;
    }
    if (!words_next(w, word, sizeof word, err)) return false;
    if (word[0]) return fail(err, ERR_INPUT, "%.600s: holds more numbers than the %lld samples of its dimensions", path, (long long)total);
    return true;
}

bool dense_read_text(Stream *s, const char *path, DenseShape shape, Grid *out, Err *err)
{
    int64_t total, most = stream_most(s);
    if (!dense_count(path, shape.n, out->ncomp, &total, err)) return false;
    /* a digit each, and something between */
    if (total > most / 2 + 1) return misfit(path, shape.n, 2, "at most ", most, err);
    float *value = NEW(float, total);
    Words w = {.s = s};
    bool ok = read_words(&w, path, value, total, err);
    if (ok) fill(out, shape, value);
    mem_free(value);
    return ok;
}
