#include "io/isolate_priv.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

bool infile_open(InFile *in, const char *path, Err *err)
{
    struct stat st;
    *in = (InFile){.path = path};
    if (stat(path, &st) != 0 && errno == ENOENT) return fail(err, ERR_INPUT, "%s: there is no such file", path);
    /* a pipe has no length to check sizes against, and opening one could wait for ever */
    if (stat(path, &st) == 0 && !S_ISREG(st.st_mode)) return fail(err, ERR_INPUT, "%s: is not a regular file", path);
    in->stream = fopen(path, "rb");
    if (!in->stream) return fail(err, ERR_INPUT, "%s: cannot be opened (%s)", path, strerror(errno));
    if (fstat(fileno(in->stream), &st) != 0) {
        infile_close(in);
        return fail(err, ERR_INPUT, "%s: its length cannot be found (%s)", path, strerror(errno));
    }
    in->length = st.st_size;
    isolate_grant(in->length);
    return true;
}

void infile_close(InFile *in)
{
    if (in->stream) fclose(in->stream);
    in->stream = NULL;
}

bool infile_read(InFile *in, int64_t at, size_t size, void *to, Err *err)
{
    if (at < 0 || at > in->length || size > (uint64_t)(in->length - at))
        return fail(err, ERR_INPUT, "%s: is cut short (%lld bytes); write or copy the file again", in->path, (long long)in->length);
    if (ftello(in->stream) != at && fseeko(in->stream, (off_t)at, SEEK_SET) != 0)
        return fail(err, ERR_INPUT, "%s: cannot be read (%s)", in->path, strerror(errno));
    if (fread(to, 1, size, in->stream) != size)
        return fail(err, ERR_INPUT, "%s: cannot be read (%s)", in->path,
                    ferror(in->stream) ? strerror(errno) : "it became shorter meanwhile");
    return true;
}
