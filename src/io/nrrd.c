#include "io/nrrd_priv.h"

#include <string.h>

typedef struct NrrdFile {
    VolumeFile base;
    InFile in;         /* the header's, and mostly the samples' too */
    InFile data;
    char *data_path;   /* NULL: samples behind the header */
    NrrdHeader header;
} NrrdFile;

/* `name` beside the header's own file, unless it says where from the root. */
static char *beside(const char *path, const char *name)
{
    const char *slash = strrchr(path, '/');
    size_t folder = slash && name[0] != '/' ? (size_t)(slash + 1 - path) : 0;
    char *out = NEW(char, folder + strlen(name) + 1);
    memcpy(out, path, folder);
    strcpy(out + folder, name);
    return out;
}

static bool nrrd_open(VolumeFile *f, Err *err)
{
    NrrdFile *nrrd = (NrrdFile *)f;
    NrrdHeader *h = &nrrd->header;
    if (!infile_open(&nrrd->in, f->path, err) || !nrrd_header_read(&nrrd->in, h, err)) return false;
    volume_add_entry(f, h->content, h->type_name, 1);
    if (!h->data_file[0]) return true;
    nrrd->data_path = beside(f->path, h->data_file);
    return infile_open(&nrrd->data, nrrd->data_path, err);
}

static bool skip_lines(InFile *in, int64_t lines, int64_t *at, Err *err)
{
    uint8_t chunk[4096];
    while (lines > 0) {
        size_t size = in->length - *at < (int64_t)sizeof chunk ? (size_t)(in->length - *at) : sizeof chunk;
        if (size == 0) return fail(err, ERR_INPUT, "%.600s: has fewer lines than its NRRD header's `line skip`", in->path);
        if (!infile_read(in, *at, size, chunk, err)) return false;
        const uint8_t *stop = memchr(chunk, '\n', size);
        *at += stop ? stop + 1 - chunk : (int64_t)size;
        lines -= stop != NULL;
    }
    return true;
}

/* Where the samples begin in the file, and what is to be skipped of them once they are unpacked. */
static bool find_samples(const NrrdFile *nrrd, InFile *in, int64_t *at, int64_t *unpacked, Err *err)
{
    const NrrdHeader *h = &nrrd->header;
    int64_t count;
    *at = nrrd->data_path ? 0 : h->end;
    *unpacked = h->byte_skip;
    if (!skip_lines(in, h->line_skip, at, err)) return false;
    if (h->byte_skip >= 0) return true;
    if (h->encoding != NRRD_RAW)
        return fail(err, ERR_INPUT, "%.600s: its NRRD header's `byte skip` of -1 is for raw samples only", nrrd->in.path);
    if (!dense_count(in->path, h->shape.n, 1, &count, err)) return false;
    *unpacked = 0;
    if (count <= in->length / h->type.size && count * h->type.size <= in->length - *at) *at = in->length - count * h->type.size;
    return true; /* where they do not fit, the reading says so */
}

static bool nrrd_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    static const StreamCodec codecs[] = {STREAM_PLAIN, STREAM_PLAIN, STREAM_DEFLATE, STREAM_BZIP2};
    NrrdFile *nrrd = (NrrdFile *)f;
    NrrdHeader *h = &nrrd->header;
    InFile *in = nrrd->data_path ? &nrrd->data : &nrrd->in;
    int64_t at, unpacked;
    (void)i;
    if (!find_samples(nrrd, in, &at, &unpacked, err)) return false;
    Stream *s = stream_open(in, at, codecs[h->encoding], err);
    bool ok = s && stream_skip(s, unpacked, err) && dense_place(f->path, f->request, &h->xform, out, err);
    if (ok && h->encoding == NRRD_TEXT)
        ok = dense_read_text(s, in->path, h->shape, out, err);
    else if (ok)
        ok = dense_read(s, in->path, h->type, h->shape, out, err);
    stream_close(s);
    return ok;
}

static void nrrd_close(VolumeFile *f)
{
    NrrdFile *nrrd = (NrrdFile *)f;
    infile_close(&nrrd->in);
    infile_close(&nrrd->data);
    mem_free(nrrd->data_path);
}

const Format NRRD_FORMAT = {"NRRD", ".nrrd", sizeof(NrrdFile), nrrd_open, nrrd_read, nrrd_close};
const Format NHDR_FORMAT = {"NRRD header", ".nhdr", sizeof(NrrdFile), nrrd_open, nrrd_read, nrrd_close};
