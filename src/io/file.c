#include "io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
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

static bool open_part(OutFile *f, const char *path, const char *suffix, const char *mode)
{
    size_t size = strlen(path) + strlen(suffix) + 1;
    f->path = mem_text(path);
    f->part = NEW(char, size);
    snprintf(f->part, size, "%s%s", path, suffix);
    f->stream = fopen(f->part, mode);
    if (f->stream) setvbuf(f->stream, NULL, _IOFBF, STREAM_BUFFER);
    return f->stream != NULL;
}

bool outfile_open(OutFile *f, const char *path, Err *err)
{
    if (open_part(f, path, ".part", "w+b")) return true;
    trouble(path, errno, err);
    forget(f);
    return false;
}

static bool cut_off(FILE *stream, uint64_t bytes)
{
    return ftruncate(fileno(stream), (off_t)bytes) == 0 && fseeko(stream, 0, SEEK_END) == 0;
}

bool outfile_reopen(OutFile *f, const char *path, uint64_t bytes, Err *err)
{
    struct stat is;
    bool good = open_part(f, path, ".part", "r+b");
    if (!good)
        fail(err, ERR_INPUT, "%.800s: cannot be gone on with: %s", f->part, strerror(errno));
    else if (!(good = fstat(fileno(f->stream), &is) == 0 && S_ISREG(is.st_mode) && (uint64_t)is.st_size >= bytes))
        fail(err, ERR_INPUT, "%.800s: is shorter than the run left it", f->part);
    else if (!(good = cut_off(f->stream, bytes)))
        outfile_fail(f, err);
    if (good) return true;
    outfile_leave(f);
    return false;
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

/* A write that failed before and was not looked at counts as well. */
static bool flush(FILE *stream)
{
    if (!ferror(stream)) return fflush(stream) == 0;
    errno = EIO;
    return false;
}

/* Devices and some network file systems cannot sync: that is no failure. */
static bool flush_and_sync(FILE *stream)
{
    if (!flush(stream)) return false;
    return fsync(fileno(stream)) == 0 || errno == EINVAL || errno == ENOTSUP || errno == ENOSYS;
}

bool outfile_sync(OutFile *f, Err *err)
{
    return flush_and_sync(f->stream) || outfile_fail(f, err);
}

uint64_t outfile_length(const OutFile *f)
{
    off_t at = ftello(f->stream);
    return at < 0 ? 0 : (uint64_t)at;
}

bool outfile_append(OutFile *f, OutFile *from, Err *err)
{
    enum { BLOCK = 1 << 20 };
    if (!flush(from->stream)) return outfile_fail(from, err);
    uint8_t *block = NEW(uint8_t, BLOCK);
    bool good = true;
    ssize_t n = 0;
    for (off_t at = 0; good && (n = pread(fileno(from->stream), block, BLOCK, at)) > 0; at += n)
        good = outfile_write(f, block, (size_t)n, err);
    if (n < 0) good = outfile_fail(from, err);
    mem_free(block);
    return good;
}

bool outfile_publish(OutFile *f, Err *err)
{
    OutFile copy;
    if (!open_part(&copy, f->path, ".new", "wb")) {
        outfile_fail(&copy, err);
        forget(&copy);
        return false;
    }
    if (outfile_append(&copy, f, err)) return outfile_commit(&copy, err);
    outfile_abort(&copy);
    return false;
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

void outfile_leave(OutFile *f)
{
    if (f->stream) fclose(f->stream);
    forget(f);
}

void outfile_abort(OutFile *f)
{
    if (f->stream) remove(f->part);
    outfile_leave(f);
}

void outfile_sweep(const char *path)
{
    size_t size = strlen(path) + sizeof ".part";
    char *part = NEW(char, size);
    snprintf(part, size, "%s.part", path);
    remove(part);
    mem_free(part);
}
