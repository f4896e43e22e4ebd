/* await.c: files that are still being written. */
#include "sequence/sequence_priv.h"

#include <sys/stat.h>
#include <time.h>

enum { POLL_MS = 100, SETTLED_POLLS = 20 };

static bool is_there(const char *path, struct stat *st) { return stat(path, st) == 0; }

/* Names on standard input are of files that are finished, or known to the one who writes them. */
static bool next_is_there(const Sequence *s)
{
    struct stat st;
    return s->names || (s->next < s->nentry && is_there(s->entry[s->next].path, &st));
}

bool sequence_await(const Sequence *s, const Frame *f)
{
    struct stat was = {0}, now;
    int still = 0;
    while (still < SETTLED_POLLS && !next_is_there(s)) {
        bool there = is_there(f->path, &now);
        bool same = there && now.st_size == was.st_size && now.st_mtim.tv_sec == was.st_mtim.tv_sec && now.st_mtim.tv_nsec == was.st_mtim.tv_nsec;
        still = same ? still + 1 : 0;
        if (there) was = now;
        if (nanosleep(&(struct timespec){.tv_nsec = POLL_MS * 1000000L}, NULL) != 0) return false;
    }
    return true;
}
