/* Makes one call fail: FAULT=NAME:N, the N-th call of a function in a process, with the error that it would have
 * on a bad day; NAME:N:abort ends the process there, NAME:N:kill without a chance to say anything. For LD_PRELOAD. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>

enum { ERROR_SEEN = 0x20 }; /* glibc's flag of a stream: what ferror asks for */

/* True at the call that is to fail. */
static bool is_due(const char *name, atomic_int *calls)
{
    const char *fault = getenv("FAULT");
    size_t n = strlen(name);
    if (!fault || strncmp(fault, name, n) != 0 || fault[n] != ':') return false;
    char *rest;
    long at = strtol(fault + n + 1, &rest, 10);
    if (++*calls != at) return false;
    if (strcmp(rest, ":abort") == 0) abort();
    if (strcmp(rest, ":kill") == 0) raise(SIGKILL);
    return true;
}

#define REAL(type, name, ...)                                    \
    static type (*real)(__VA_ARGS__);                            \
    static atomic_int calls;                                     \
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, #name);        \
    bool due = is_due(#name, &calls)

int fsync(int fd)
{
    REAL(int, fsync, int);
    if (!due) return real(fd);
    errno = ENOSPC;
    return -1;
}

int rename(const char *from, const char *to)
{
    REAL(int, rename, const char *, const char *);
    if (!due) return real(from, to);
    errno = EACCES;
    return -1;
}

int remove(const char *path)
{
    REAL(int, remove, const char *);
    if (!due) return real(path);
    errno = EACCES;
    return -1;
}

int fflush(FILE *f)
{
    REAL(int, fflush, FILE *);
    if (!due) return real(f);
    errno = ENOSPC;
    return EOF;
}

size_t fwrite(const void *p, size_t size, size_t count, FILE *f)
{
    REAL(size_t, fwrite, const void *, size_t, size_t, FILE *);
    if (!due) return real(p, size, count, f);
    f->_flags |= ERROR_SEEN;
    errno = ENOSPC;
    return 0;
}

size_t fread(void *p, size_t size, size_t count, FILE *f)
{
    REAL(size_t, fread, void *, size_t, size_t, FILE *);
    if (size * count == 0) calls--; /* nothing to fail at */
    if (!due || size * count == 0) return real(p, size, count, f);
    f->_flags |= ERROR_SEEN;
    errno = EIO;
    return 0;
}

void *realloc(void *p, size_t size)
{
    REAL(void *, realloc, void *, size_t);
    if (!due) return real(p, size);
    errno = ENOMEM;
    return NULL;
}

/* As where a process may not be looked into. */
ssize_t process_vm_readv(pid_t pid, const struct iovec *here, unsigned long nhere, const struct iovec *there, unsigned long nthere, unsigned long flags)
{
    REAL(ssize_t, process_vm_readv, pid_t, const struct iovec *, unsigned long, const struct iovec *, unsigned long, unsigned long);
    if (!due) return real(pid, here, nhere, there, nthere, flags);
    errno = EPERM;
    return -1;
}
