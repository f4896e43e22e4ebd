#include "cli/state.h"

#include "base/digest.h"
#include "io/file.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

typedef struct Head {
    char magic[16];  /* with the version of the layout */
    char version[16];
    uint64_t bytes, digest; /* of what follows */
    uint64_t finished;
} Head;

static Head head_of(const Store *s)
{
    Head h = {.magic = "twinmesh state\n", .version = TWINMESH_VERSION, .bytes = s->n, .digest = digest_bytes(s->data, s->n)};
    return h;
}

char *state_path(const char *prefix)
{
    size_t size = strlen(prefix) + sizeof ".state";
    char *path = NEW(char, size);
    snprintf(path, size, "%s.state", prefix);
    return path;
}

bool state_write(const char *prefix, const Store *s, Err *err)
{
    Head head = head_of(s);
    char *path = state_path(prefix);
    OutFile f;
    bool good = outfile_open(&f, path, err);
    mem_free(path);
    if (!good) return false;
    if (outfile_write(&f, &head, sizeof head, err) && outfile_write(&f, s->data, s->n, err)) return outfile_commit(&f, err);
    outfile_abort(&f);
    return false;
}

bool state_finish(const char *prefix, Err *err)
{
    const uint64_t finished = 1;
    char *path = state_path(prefix);
    FILE *stream = fopen(path, "r+b");
    bool good = stream && fseek(stream, offsetof(Head, finished), SEEK_SET) == 0 && fwrite(&finished, sizeof finished, 1, stream) == 1 &&
                fflush(stream) == 0 && fsync(fileno(stream)) == 0;
    if (!good) fail(err, ERR_OUTPUT, "%.800s: cannot be marked as finished (%s); all else of the run is whole: remove it", path, strerror(errno));
    if (stream) fclose(stream);
    mem_free(path);
    return good;
}

bool state_remove(const char *prefix, Err *err)
{
    char *path = state_path(prefix);
    bool good = remove(path) == 0 || errno == ENOENT || errno == ENOTDIR ||
                fail(err, ERR_OUTPUT, "%.800s: cannot be removed: %s", path, strerror(errno));
    mem_free(path);
    return good;
}

static bool read_body(FILE *stream, const char *path, StateFile *out, Err *err)
{
    Head head, own = head_of(&(Store){0});
    long end = fseek(stream, 0, SEEK_END) == 0 ? ftell(stream) : -1;
    bool whole = end >= (long)sizeof head && fseek(stream, 0, SEEK_SET) == 0 && fread(&head, sizeof head, 1, stream) == 1;
    if (!whole || memcmp(head.magic, own.magic, sizeof head.magic) != 0)
        return fail(err, ERR_INPUT, "%.800s: is no state of a run", path);
    if (memcmp(head.version, own.version, sizeof head.version) != 0)
        return fail(err, ERR_INPUT, "%.800s: was left by another version of the program", path);
    size_t n = (size_t)end - sizeof head;
    whole = head.bytes == n;
    if (whole) out->data = NEW(uint8_t, n);
    if (!whole || fread(out->data, 1, n, stream) != n || digest_bytes(out->data, n) != head.digest)
        return fail(err, ERR_INPUT, "%.800s: is damaged", path);
    out->finished = head.finished == 1;
    out->store = store_reading(out->data, n);
    return true;
}

bool state_read(const char *path, StateFile *out, Err *err)
{
    *out = (StateFile){0};
    FILE *stream = fopen(path, "rb");
    if (!stream) {
        if (errno == ENOENT || errno == ENOTDIR) return true;
        return fail(err, ERR_INPUT, "%.800s: cannot be read: %s", path, strerror(errno));
    }
    out->exists = true;
    bool good = read_body(stream, path, out, err);
    fclose(stream);
    return good;
}

void state_free(StateFile *f)
{
    mem_free(f->data);
    *f = (StateFile){0};
}
