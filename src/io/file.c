#include "io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

enum { STREAM_BUFFER = 1 << 18 };

static const char *remedy(int code)
{
    switch (code) {
    case ENOSPC:
        return "the disk is full; free some space or write to another disk";
    case EDQUOT:
        return "the disk quota is used up; free some space or write to another disk";
    case EFBIG:
        return "the file passed a size limit; raise it (ulimit -f) or write to another file system";
    case EACCES:
    case EPERM:
        return "writing there is not permitted; write to another folder or change its permissions";
    case EROFS:
        return "the file system is read-only; write to another folder";
    case ENOENT:
        return "its folder does not exist; create the folder first";
    case ENOTDIR:
        return "what should be its folder is a file; write to another folder";
    case EISDIR:
    case EEXIST:
    case ENOTEMPTY:
        return "a folder of that name is in the way; remove it or write under another name";
    case ENAMETOOLONG:
        return "the name is too long; choose a shorter one";
    default:
        return strerror(code);
    }
}

static bool trouble(const char *path, int code, Err *err)
{
    /* the cut leaves room for the remedy behind the longest path */
    return fail(err, ERR_OUTPUT, "%.800s: cannot be written: %s", path, remedy(code));
}

static void forget(OutFile *f)
{
    mem_free(f->path);
    mem_free(f->part);
    *f = (OutFile){0};
}

bool outfile_open(OutFile *f, const char *path, Err *err)
{
    size_t n = strlen(path);
    f->path = mem_text(path);
    f->part = NEW(char, n + sizeof ".part");
    memcpy(f->part, path, n);
    memcpy(f->part + n, ".part", sizeof ".part");

    f->stream = fopen(f->part, "w+b");
    if (!f->stream) {
        trouble(path, errno, err);
        forget(f);
        return false;
    }
    setvbuf(f->stream, NULL, _IOFBF, STREAM_BUFFER);
    return true;
}

bool outfile_write(OutFile *f, const void *data, size_t bytes, Err *err)
{
    ASSERT(f->stream);
    if (bytes == 0 || fwrite(data, 1, bytes, f->stream) == bytes) return true;
    return outfile_fail(f, err);
}

bool outfile_fail(const OutFile *f, Err *err) { return trouble(f->path, errno, err); }

/* A renamed file survives a power cut only when its folder was synced too; where that cannot be done, no
 * harm. */
static void sync_folder(const char *path)
{
    char *folder = mem_text(path), *slash = strrchr(folder, '/');
    if (slash) slash[slash == folder] = 0;
    int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    mem_free(folder);
}

/* Devices and some network file systems cannot sync: that is no failure. */
static bool flush_and_sync(FILE *stream)
{
    if (ferror(stream)) {
        errno = EIO;
        return false;
    }
    if (fflush(stream) != 0) return false;
    return fsync(fileno(stream)) == 0 || errno == EINVAL || errno == ENOTSUP || errno == ENOSYS;
}

bool outfile_commit(OutFile *f, Err *err)
{
    ASSERT(f->stream);
    int code = flush_and_sync(f->stream) ? 0 : errno;
    if (fclose(f->stream) != 0 && !code) code = errno;
    if (!code && rename(f->part, f->path) != 0) code = errno;

    if (code) {
        remove(f->part);
        trouble(f->path, code, err);
    } else {
        sync_folder(f->path);
    }
    forget(f);
    return code == 0;
}

void outfile_abort(OutFile *f)
{
    if (!f->stream) return;
    fclose(f->stream);
    remove(f->part);
    forget(f);
}
