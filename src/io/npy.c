/* The .npy format: magic, version, length of the header, the header (a Python dictionary of three entries as text),
 * the samples. https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html */
#include "io/points_priv.h"
#include "io/stream.h"

#include <string.h>

enum { HEADER_MAX = 1 << 16 };

typedef struct Header {
    DenseType type;
    bool fortran;
    int ndim;
    int64_t shape[3]; /* the first three */
    int64_t data_at;
} Header;

/* The header's text while it is read; `p` never passes the terminating zero. */
typedef struct Text {
    const char *p;
} Text;

static void skip_blanks(Text *t)
{
    while (*t->p == ' ' || *t->p == '\t' || *t->p == '\n' || *t->p == '\r') t->p++;
}

/* Takes a literal piece of text, with the blanks before it. */
static bool take(Text *t, const char *what)
{
    skip_blanks(t);
    size_t n = strlen(what);
    if (strncmp(t->p, what, n) != 0) return false;
    t->p += n;
    return true;
}

static bool take_string(Text *t, char *to, size_t size)
{
    skip_blanks(t);
    char quote = *t->p;
    if (quote != '\'' && quote != '"') return false;
    size_t n = 0;
    for (t->p++; *t->p && *t->p != quote; t->p++) {
        if (*t->p == '\\' || n + 1 >= size) return false;
        to[n++] = *t->p;
    }
    to[n] = 0;
    if (*t->p != quote) return false;
    t->p++;
    return true;
}

/* A count, with the L that Python 2 wrote behind long integers. */
static bool take_count(Text *t, int64_t *out)
{
    skip_blanks(t);
    if (*t->p < '0' || *t->p > '9') return false;
    int64_t v = 0;
    for (; *t->p >= '0' && *t->p <= '9'; t->p++) {
        if (v > INT64_MAX / 10 - 10) return false;
        v = 10 * v + (*t->p - '0');
    }
    if (*t->p == 'L') t->p++;
    *out = v;
    return true;
}

static bool take_shape(Text *t, Header *h)
{
    if (!take(t, "(")) return false;
    h->ndim = 0;
    while (!take(t, ")")) {
        int64_t n;
        if (!take_count(t, &n) || h->ndim == 32) return false;
        if (h->ndim < 3) h->shape[h->ndim] = n;
        h->ndim++;
        if (take(t, ",")) continue;
        return take(t, ")");
    }
    return true;
}

static bool type_parse(const char *descr, DenseType *type)
{
    static const char *const known[] = {"f2", "f4", "f8"};
    if (!*descr || !strchr("<>=", *descr)) return false;
    for (int i = 0; i < 3; i++)
        if (strcmp(descr + 1, known[i]) == 0) {
            const uint16_t one = 1;
            bool machine_big = *(const uint8_t *)&one == 0; /* '=': the order of this machine */
            *type = (DenseType){'f', 2 << i, *descr == '>' || (*descr == '=' && machine_big)};
            return true;
        }
    return false;
}

/* The three entries in any order, each exactly once. */
static bool header_parse(const char *path, const char *text, Header *h, Err *err)
{
    Text t = {text};
    char key[32] = "", descr[64] = "";
    unsigned seen = 0;
    bool ok = take(&t, "{");
    while (ok && !take(&t, "}")) {
        ok = take_string(&t, key, sizeof key) && take(&t, ":");
        unsigned bit = strcmp(key, "descr") == 0 ? 1 : strcmp(key, "fortran_order") == 0 ? 2 : strcmp(key, "shape") == 0 ? 4 : 0;
        ok = ok && bit && !(seen & bit);
        if (!ok) break;
        seen |= bit;
        if (bit == 1) {
            skip_blanks(&t);
            if (*t.p == '[')
                return fail(err, ERR_INPUT, "%s: holds records; save one plain array of float32", path);
            ok = take_string(&t, descr, sizeof descr);
        } else if (bit == 2) {
            h->fortran = take(&t, "True");
            ok = h->fortran || take(&t, "False");
        } else {
            ok = take_shape(&t, h);
        }
        if (ok && take(&t, ",")) continue;
        ok = ok && take(&t, "}");
        break;
    }
    skip_blanks(&t);
    if (!ok || seen != 7 || *t.p)
        return fail(err, ERR_INPUT, "%s: its .npy header is damaged; write the file again (numpy.save)", path);
    if (!type_parse(descr, &h->type))
        return fail(err, ERR_INPUT, "%s: samples of type '%s' are not read; save it as float32 (array.astype('<f4'))", path, descr);
    return true;
}

static bool header_read(InFile *in, Header *h, Err *err)
{
    uint8_t b[12];
    if (!infile_read(in, 0, 8, b, err)) return false;
    if (memcmp(b, "\x93NUMPY", 6) != 0) return fail(err, ERR_INPUT, "%s: is no .npy file", in->path);
    int major = b[6], nlen = major == 1 ? 2 : 4;
    if (major < 1 || major > 3) return fail(err, ERR_INPUT, "%s: .npy version %d is not known (1 to 3 are)", in->path, major);
    if (!infile_read(in, 8, (size_t)nlen, b + 8, err)) return false;
    uint32_t length = 0;
    for (int i = 0; i < nlen; i++) length |= (uint32_t)b[8 + i] << 8 * i;
    if (length > HEADER_MAX) return fail(err, ERR_INPUT, "%s: its .npy header is damaged; write the file again (numpy.save)", in->path);
    char *text = NEW0(char, length + 1);
    bool ok = infile_read(in, 8 + nlen, length, text, err);
    if (ok && strlen(text) != length)
        ok = fail(err, ERR_INPUT, "%s: its .npy header is damaged; write the file again (numpy.save)", in->path);
    ok = ok && header_parse(in->path, text, h, err);
    h->data_at = 8 + nlen + (int64_t)length;
    mem_free(text);
    return ok;
}

typedef struct NpyFile {
    VolumeFile base;
    InFile in;
    Header header;
} NpyFile;

static bool npy_open(VolumeFile *f, Err *err)
{
    NpyFile *npy = (NpyFile *)f;
    if (!infile_open(&npy->in, f->path, err) || !header_read(&npy->in, &npy->header, err)) return false;
    if (npy->header.ndim != 3)
        return fail(err, ERR_INPUT, "%s: the array has %d dimensions; a volume has three, [x][y][z]", f->path, npy->header.ndim);
    static const char *const names[] = {"half", "float", "double"};
    volume_add_entry(f, "", names[npy->header.type.size / 4], 1);
    return true;
}

static bool npy_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    NpyFile *npy = (NpyFile *)f;
    const Header *h = &npy->header;
    (void)i;
    /* array[i][j][k] is the sample (i, j, k): Fortran's order has i fastest */
    DenseShape shape = {.x_fastest = h->fortran};
    for (int a = 0; a < 3; a++) shape.n[a] = h->shape[a] > INT32_MAX ? INT32_MAX : (int)h->shape[a];
    Stream *s = stream_open(&npy->in, h->data_at, STREAM_PLAIN, err);
    bool ok = s && dense_place(f->path, f->request, NULL, out, err) && dense_read(s, f->path, h->type, shape, out, err);
    stream_close(s);
    return ok;
}

static void npy_close(VolumeFile *f) { infile_close(&((NpyFile *)f)->in); }

const Format NPY_FORMAT = {"NumPy array", ".npy", sizeof(NpyFile), npy_open, npy_read, npy_close};

/* --- points ---------------------------------------------------------------------------------------- */

static bool header_is_points(const Header *h) { return h->ndim == 2 && h->shape[1] == 3; }

bool npy_holds_points(const char *path)
{
    InFile in = {0};
    Header h;
    Err err;
    bool ok = infile_open(&in, path, &err) && header_read(&in, &h, &err) && header_is_points(&h);
    infile_close(&in);
    return ok;
}

static bool read_points(InFile *in, PointSet *out, Err *err)
{
    Header h;
    if (!header_read(in, &h, err)) return false;
    if (!header_is_points(&h)) return fail(err, ERR_INPUT, "%.800s: points are an array of n x 3 numbers", in->path);
    int64_t n = h.shape[0], bytes = in->length - h.data_at, row = 3 * h.type.size;
    if (n > INT32_MAX / 2 || n * row != bytes)
        return fail(err, ERR_INPUT, "%.800s: %lld x 3 numbers of %d bytes do not fit the file, which holds %lld bytes of them; it is cut short or damaged", in->path,
                    (long long)n, h.type.size, (long long)bytes);
    uint8_t *all = NEW(uint8_t, bytes);
    bool ok = infile_read(in, h.data_at, (size_t)bytes, all, err);
    out->n = ok ? (int)n : 0;
    out->place = NEW(Vec3, out->n);
    for (int i = 0; i < out->n; i++)
        for (int k = 0; k < 3; k++) {
            int64_t at = h.fortran ? k * n + i : 3 * (int64_t)i + k;
            v_set(&out->place[i], k, (double)dense_sample(h.type, all + at * h.type.size));
        }
    mem_free(all);
    return ok;
}

bool npy_read_points(const char *path, PointSet *out, Err *err)
{
    InFile in = {0};
    bool ok = infile_open(&in, path, err) && read_points(&in, out, err);
    infile_close(&in);
    return ok;
}
