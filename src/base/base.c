#include "base/base.h"

#include <malloc.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

void assert_failed(const char *what, const char *file, int line)
{
    fprintf(stderr, "twinmesh: a mistake in the program at %s:%d: %s\n", file, line, what);
    abort();
}

bool fail(Err *err, ErrCode code, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    err->code = code;
    vsnprintf(err->text, sizeof err->text, fmt, args);
    va_end(args);
    for (char *c = err->text; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?'; /* names from a file, or of one, keep to the line */
    return false;
}

static bool limited;

bool mem_limit(uint64_t bytes)
{
    struct rlimit limit = {.rlim_cur = (rlim_t)bytes, .rlim_max = RLIM_INFINITY};
    limited = true;
    return setrlimit(RLIMIT_DATA, &limit) == 0;
}

void mem_keep(int bytes)
{
    mallopt(M_MMAP_THRESHOLD, 1 << 25); /* the most that glibc takes */
    mallopt(M_TRIM_THRESHOLD, bytes);
    mallopt(M_ARENA_MAX, 1);
}

/* Other threads may be in the middle of anything: no handlers are run. What is on disk can be gone on with. */
static void *must(void *p, size_t count, size_t size)
{
    if (p) return p;
    fprintf(stderr, "twinmesh: out of memory (%zu items of %zu bytes were wanted%s)\n", count, size, limited ? "; --max-memory allows no more" : "");
    fflush(stdout);
    _exit(ERR_RESOURCE);
}

void *mem_alloc(size_t count, size_t size) { return mem_resize(NULL, count, size); }

void *mem_zero(size_t count, size_t size)
{
    if (count == 0) count = 1;
    return must(calloc(count, size), count, size);
}

void *mem_resize(void *old, size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes)) must(NULL, count, size);
    return must(realloc(old, bytes ? bytes : 1), count, size);
}

void mem_free(void *p) { free(p); }

char *mem_text(const char *s)
{
    size_t n = strlen(s) + 1;
    return memcpy(mem_alloc(n, 1), s, n);
}

double real_select(double *x, int n, int k)
{
    ASSERT(k >= 0 && k < n);
    for (int lo = 0, hi = n - 1; lo < hi;) { /* Hoare's: what is below the pivot to the left */
        double pivot = x[lo + (hi - lo) / 2];
        int i = lo, j = hi;
        while (i <= j) {
            while (x[i] < pivot) i++;
            while (pivot < x[j]) j--;
            if (i > j) break;
            double y = x[i];
            x[i++] = x[j];
            x[j--] = y;
        }
        if (k <= j) hi = j;
        else if (k >= i) lo = i;
        else break;
    }
    return x[k];
}
