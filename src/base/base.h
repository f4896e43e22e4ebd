/* base.h: what every module leans on: integer names, assertions, errors, memory.
 *
 * Three kinds of trouble, three mechanisms. Our own mistake: ASSERT. The world's mistake (a file, an
 * option, a full disk): a function returns false after writing one sentence into its trailing Err.
 * Memory that cannot be had ends the program with exit code 5 and a sentence: this is a batch program. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define NONE (-1)

#ifdef NDEBUG
#define ASSERT(x) ((void)sizeof((x) ? 1 : 0))
#else
#define ASSERT(x) ((x) ? (void)0 : assert_failed(#x, __FILE__, __LINE__))
#endif
void assert_failed(const char *what, const char *file, int line) __attribute__((noreturn));

/* Exit codes of the program. */
typedef enum ErrCode {
    ERR_NONE = 0,
    ERR_CHECK = 1,    /* a check or a comparison failed */
    ERR_USAGE = 2,    /* wrong options */
    ERR_INPUT = 3,    /* bad or missing input */
    ERR_OUTPUT = 4,   /* could not write */
    ERR_RESOURCE = 5, /* out of memory or another resource */
} ErrCode;

typedef struct Err {
    ErrCode code;
    char text[1000]; /* one sentence that names the file, the frame and the remedy; nothing unprintable */
} Err;

/* Writes the sentence (cut off at the buffer's end). Always false, so `return fail(...)` reads well. */
bool fail(Err *err, ErrCode code, const char *fmt, ...) __attribute__((format(printf, 3, 4)));

/* --- memory: never NULL, never negative sizes, overflow checked ------------------------------ */

void *mem_alloc(size_t count, size_t size);              /* uninitialised */
void *mem_zero(size_t count, size_t size);               /* zeroed */
void *mem_resize(void *old, size_t count, size_t size);  /* like realloc */
void mem_free(void *p);                                  /* NULL is allowed */
/* From now on the program, its libraries included, takes no more than this. False where the system cannot hold it to that. */
bool mem_limit(uint64_t bytes);
/* What is freed is kept for what is asked for next, but for `bytes` at most at the end of it: pages that are there already cost
 * nothing. Threads that begin from now on share it. */
void mem_keep(int bytes);
char *mem_text(const char *s);                           /* a copy */

#define NEW(type, n) ((type *)mem_alloc((size_t)(n), sizeof(type)))
#define NEW0(type, n) ((type *)mem_zero((size_t)(n), sizeof(type)))
#define RESIZE(p, n) ((p) = mem_resize((p), (size_t)(n), sizeof *(p)))

/* The capacity to take for `need` items where that is more than there is: by a quarter more at least, so that growing one by one
 * costs little, and what grows a little with each frame does not take twice what it holds. */
static inline int mem_capacity(int cap, int need) { return need > cap + cap / 4 + 16 ? need : cap + cap / 4 + 16; }

/* Makes room for `need` items in a growing array, in the same way. */
#define RESERVE(p, cap, need)                                                                      \
    do {                                                                                           \
        if ((need) > (cap)) {                                                                      \
            (cap) += (cap) / 4 + 16;                                                               \
            if ((need) > (cap)) (cap) = (need);                                                    \
            RESIZE(p, cap);                                                                        \
        }                                                                                          \
    } while (0)

/* --- small things ------------------------------------------------------------------------------ */

static inline int int_min(int a, int b) { return a < b ? a : b; }
static inline int int_max(int a, int b) { return a > b ? a : b; }
static inline int int_clamp(int x, int lo, int hi) { return x < lo ? lo : x > hi ? hi : x; }
static inline double real_min(double a, double b) { return a < b ? a : b; }
static inline double real_max(double a, double b) { return a > b ? a : b; }
static inline double real_clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }
/* The value that would be x[k] if x[n] were sorted; x gets another order. */
double real_select(double *x, int n, int k);
