#define _GNU_SOURCE /* ppoll, pipe2 */
#include "io/isolate_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAS_SANITIZER 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HAS_SANITIZER 1
#endif

enum {
    NO_PROCESS = -1,      /* as a fate: none could be forked */
    FATE_WAIT_S = 30,     /* what the end of a large process takes */
    WIRE_ROOM = 1 << 22,
    KEPT_BYTES = 1 << 28, /* from one file's grids for the next one's */
};

static IsolateLimits limits;
static int orders = -1; /* to the server */
static pid_t server;
static pthread_mutex_t idle_lock = PTHREAD_MUTEX_INITIALIZER;
static ReaderProcess *idle; /* waits for a file; or NULL */
static int64_t granted = -1; /* bytes; only where a process reads */

/* --- wires ---------------------------------------------------------------------------------------- */

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* One wait counts as a second at most: a program that was stopped for an hour has not waited for an hour. */
static bool wire_wait(Wire *w, short events)
{
    struct pollfd p = {w->fd, events, 0};
    while (w->left_s > 0) {
        double start = now_s();
        int n = poll(&p, 1, 1000);
        if (n > 0) return true;
        if (n < 0 && errno != EINTR) return false;
        w->left_s -= real_min(now_s() - start, 1);
    }
    w->late = true;
    return false;
}

static bool wire_send(Wire *w, const void *data, size_t size)
{
    const char *p = data;
    while (size > 0 && !w->failed) {
        ssize_t n = send(w->fd, p, size, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n > 0) p += n, size -= (size_t)n;
        else if (errno != EINTR && !(errno == EAGAIN && wire_wait(w, POLLOUT))) w->failed = true;
    }
    return !w->failed;
}

bool wire_flush(Wire *w)
{
    size_t n = w->held;
    w->held = 0;
    return wire_send(w, w->out, n);
}

bool wire_put(Wire *w, const void *data, size_t size)
{
    if (size > sizeof w->out - w->held && !wire_flush(w)) return false;
    if (size > sizeof w->out) return wire_send(w, data, size);
    if (size) memcpy(w->out + w->held, data, size);
    w->held += size;
    return !w->failed;
}

/* At least one byte. */
static size_t wire_receive(Wire *w, void *to, size_t size)
{
    while (!w->failed) {
        ssize_t n = recv(w->fd, to, size, MSG_DONTWAIT);
        if (n > 0) return (size_t)n;
        if (n == 0 || (errno != EINTR && !(errno == EAGAIN && wire_wait(w, POLLIN)))) w->failed = true;
    }
    return 0;
}

bool wire_get(Wire *w, void *to, size_t size)
{
    char *p = to;
    if (w->held && !wire_flush(w)) return false;
    while (size > 0 && !w->failed) {
        if (w->at < w->end) {
            size_t n = w->end - w->at < size ? w->end - w->at : size;
            memcpy(p, w->in + w->at, n);
            w->at += n;
            p += n;
            size -= n;
        } else if (size >= sizeof w->in) {
            size_t n = wire_receive(w, p, size);
            p += n;
            size -= n;
        } else {
            w->at = 0;
            w->end = wire_receive(w, w->in, sizeof w->in);
        }
    }
    return !w->failed;
}

/* --- a process that reads -------------------------------------------------------------------------- */

static int64_t machine_memory(void)
{
    return (int64_t)sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGESIZE);
}

static int64_t memory_for(int64_t bytes)
{
    int64_t most = machine_memory(), more, all;
    if (__builtin_mul_overflow(bytes, limits.memory_per_byte, &more) || __builtin_add_overflow(limits.memory, more, &all)) return most;
    return all < most ? all : most;
}

static void limit_memory(void)
{
#ifndef HAS_SANITIZER
    rlim_t most = (rlim_t)memory_for(granted);
    setrlimit(RLIMIT_AS, &(struct rlimit){most, RLIM_INFINITY});
#endif
}

void isolate_grant(int64_t bytes)
{
    if (granted < 0) return;
    if (__builtin_add_overflow(granted, bytes, &granted)) granted = INT64_MAX;
    limit_memory();
}

int64_t isolate_granted(void) { return granted; }

void isolate_ungrant(void)
{
    granted = 0;
    limit_memory();
}

/* Where memory runs out, the system shall end this process and not the program. */
static void offer_to_be_killed(void)
{
    int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (fd < 0) return;
    if (write(fd, "1000", 4) < 0) { /* then it is not this one's turn first */
    }
    close(fd);
}

/* Whatever handlers the program has: a fault ends the process. */
static void die_of_faults(void)
{
    static const int fault[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
    for (size_t i = 0; i < sizeof fault / sizeof *fault; i++) signal(fault[i], SIG_DFL);
}

static _Noreturn void read_for(int fd, pid_t parent)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(0); /* it was gone before */
    setrlimit(RLIMIT_CORE, &(struct rlimit){0, 0});
    die_of_faults();
    offer_to_be_killed();
    mem_keep(KEPT_BYTES); /* a process that grew large is not kept itself */
    isolate_ungrant();
    remote_serve(&(Wire){.fd = fd, .left_s = INFINITY});
    _exit(0);
}

/* --- the server ------------------------------------------------------------------------------------ */

typedef struct Child {
    pid_t pid;
    int fate; /* -1: nobody wants to know any more */
} Child;

typedef struct Server {
    int orders;
    int nchild, capchild, capwatch;
    Child *child;
    struct pollfd *watch; /* orders, and the fate of each child */
    sigset_t open;        /* signals while it waits */
} Server;

/* Takes the two descriptors of an order; false where there are no more orders. */
static bool take_order(int from, int *wire, int *fate)
{
    char byte;
    union {
        struct cmsghdr head;
        char room[CMSG_SPACE(2 * sizeof(int))];
    } control;
    struct iovec data = {&byte, 1};
    struct msghdr m = {.msg_iov = &data, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    ssize_t n;
    do n = recvmsg(from, &m, MSG_CMSG_CLOEXEC);
    while (n < 0 && errno == EINTR);
    struct cmsghdr *c = CMSG_FIRSTHDR(&m);
    if (n <= 0 || !c || c->cmsg_len != CMSG_LEN(2 * sizeof(int))) return false;
    int fd[2];
    memcpy(fd, CMSG_DATA(c), sizeof fd);
    *wire = fd[0];
    *fate = fd[1];
    return true;
}

static void tell(int fate, int what)
{
    if (write(fate, &what, sizeof what) < 0) { /* who would read it is gone */
    }
}

static void tell_fate(int fate, int status)
{
    tell(fate, status);
    close(fate);
}

static void start_child(Server *s, int wire, int fate)
{
    pid_t self = getpid(), pid = fork();
    if (pid == 0) {
        close(s->orders);
        close(fate);
        for (int i = 0; i < s->nchild; i++)
            if (s->child[i].fate >= 0) close(s->child[i].fate);
        sigprocmask(SIG_SETMASK, &s->open, NULL);
        read_for(wire, self);
    }
    close(wire);
    if (pid < 0) {
        tell_fate(fate, NO_PROCESS);
        return;
    }
    tell(fate, pid);
    RESERVE(s->child, s->capchild, s->nchild + 1);
    s->child[s->nchild++] = (Child){pid, fate};
}

static void bury_children(Server *s)
{
    int status;
    for (pid_t pid; (pid = waitpid(-1, &status, WNOHANG)) > 0;)
        for (int i = 0; i < s->nchild; i++) {
            if (s->child[i].pid != pid) continue;
            if (s->child[i].fate >= 0) tell_fate(s->child[i].fate, status);
            s->child[i] = s->child[--s->nchild];
            break;
        }
}

/* A fate nobody reads: the file was closed, or given up. */
static void kill_forsaken(Server *s)
{
    for (int i = 0; i < s->nchild; i++) {
        if (!s->watch[i + 1].revents) continue;
        kill(s->child[i].pid, SIGKILL);
        close(s->child[i].fate);
        s->child[i].fate = -1;
    }
}

static void wake(int number) { (void)number; }

/* Data is the program's, and so are words; in builds that check themselves they are worth a look. */
static void leave_terminal(void)
{
    int fd = open("/dev/null", O_RDWR);
    if (fd < 0) return;
    dup2(fd, 0);
    dup2(fd, 1);
#ifdef NDEBUG
    dup2(fd, 2);
#endif
    if (fd > 2) close(fd);
}

static _Noreturn void run_server(int from)
{
    Server s = {.orders = from};
    sigset_t child;
    struct sigaction ignore = {.sa_handler = SIG_IGN}, interrupt = {.sa_handler = wake};
    sigaction(SIGINT, &ignore, NULL);
    sigaction(SIGTERM, &ignore, NULL);
    sigaction(SIGPIPE, &ignore, NULL); /* of a fate nobody reads */
    sigemptyset(&child);
    sigaddset(&child, SIGCHLD);
    sigprocmask(SIG_BLOCK, &child, &s.open);
    sigaction(SIGCHLD, &interrupt, NULL);
    leave_terminal();
    for (;;) {
        RESERVE(s.watch, s.capwatch, s.nchild + 1);
        s.watch[0] = (struct pollfd){s.orders, POLLIN, 0};
        for (int i = 0; i < s.nchild; i++) s.watch[i + 1] = (struct pollfd){s.child[i].fate, 0, 0};
        if (ppoll(s.watch, (nfds_t)s.nchild + 1, NULL, &s.open) > 0) {
            int wire, fate;
            kill_forsaken(&s);
            if (s.watch[0].revents && !take_order(s.orders, &wire, &fate)) _exit(0);
            if (s.watch[0].revents) start_child(&s, wire, fate);
        }
        bury_children(&s);
    }
}

/* --- the program ------------------------------------------------------------------------------------ */

bool isolate_is_on(void) { return orders >= 0; }

bool isolate_start(IsolateLimits wanted, Err *err)
{
    int ends[2];
    ASSERT(!isolate_is_on());
    limits = wanted;
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
        return fail(err, ERR_RESOURCE, "no process could be had to read files (%s)", strerror(errno));
    server = fork();
    if (server < 0) {
        close(ends[0]);
        close(ends[1]);
        return fail(err, ERR_RESOURCE, "no process could be had to read files (%s)", strerror(errno));
    }
    if (server == 0) {
        close(ends[0]);
        run_server(ends[1]);
    }
    close(ends[1]);
    orders = ends[0];
    return true;
}

void isolate_stop(void)
{
    if (!isolate_is_on()) return;
    process_end(idle);
    idle = NULL;
    close(orders);
    orders = -1;
    while (waitpid(server, NULL, 0) < 0 && errno == EINTR) continue;
}

static bool send_order(int wire, int fate)
{
    const int fd[2] = {wire, fate};
    union {
        struct cmsghdr head;
        char room[CMSG_SPACE(sizeof fd)];
    } control = {{.cmsg_len = CMSG_LEN(sizeof fd), .cmsg_level = SOL_SOCKET, .cmsg_type = SCM_RIGHTS}};
    char byte = 0;
    struct iovec data = {&byte, 1};
    struct msghdr m = {.msg_iov = &data, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    memcpy(CMSG_DATA(&control.head), fd, sizeof fd);
    ssize_t n;
    do n = sendmsg(orders, &m, MSG_NOSIGNAL);
    while (n < 0 && errno == EINTR);
    return n > 0;
}

static bool process_fork(ReaderProcess *p)
{
    int wire[2], fate[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, wire) != 0) return false;
    p->wire.fd = wire[0];
    setsockopt(wire[1], SOL_SOCKET, SO_SNDBUF, &(int){WIRE_ROOM}, sizeof(int)); /* fewer turns; the system grants what it likes */
    bool ok = pipe2(fate, O_CLOEXEC) == 0;
    if (ok) {
        p->fate = fate[0];
        ok = send_order(wire[1], fate[1]);
        close(fate[1]);
    }
    close(wire[1]);
    return ok;
}

static ReaderProcess *idle_swap(ReaderProcess *p)
{
    pthread_mutex_lock(&idle_lock);
    ReaderProcess *old = idle;
    idle = p;
    pthread_mutex_unlock(&idle_lock);
    return old;
}

ReaderProcess *process_start(Err *err)
{
    ReaderProcess *p = idle_swap(NULL);
    if (p && poll(&(struct pollfd){p->wire.fd, POLLIN, 0}, 1, 0) == 0) return p;
    process_end(p); /* it died as it waited */
    p = NEW(ReaderProcess, 1);
    *p = (ReaderProcess){.wire = {.fd = -1}, .fate = -1};
    if (process_fork(p)) return p;
    fail(err, ERR_RESOURCE, "no process could be had to read files (%s); start the program again", strerror(errno));
    process_end(p);
    return NULL;
}

void process_end(ReaderProcess *p)
{
    if (!p) return;
    if (p->wire.fd >= 0) close(p->wire.fd);
    if (p->fate >= 0) close(p->fate);
    mem_free(p);
}

void process_keep(ReaderProcess *p) { process_end(idle_swap(p)); }

void process_allow(ReaderProcess *p, int64_t bytes) { p->wire.left_s = limits.seconds + limits.seconds_per_byte * (double)bytes; }

bool process_can_hold(int64_t bytes, int64_t count, size_t size) { return count >= 0 && count <= memory_for(bytes) / (int64_t)size; }

/* What the server tells of it next. */
static bool hear(ReaderProcess *p, int *what)
{
    Wire fate = {.fd = p->fate, .left_s = FATE_WAIT_S};
    return wire_wait(&fate, POLLIN) && read(p->fate, what, sizeof *what) == (ssize_t)sizeof *what;
}

static bool hear_pid(ReaderProcess *p)
{
    if (p->pid == 0 && !hear(p, &p->pid)) p->pid = NO_PROCESS;
    return p->pid != NO_PROCESS;
}

bool process_copy(ReaderProcess *p, uint64_t address, void *to, size_t size)
{
    size_t done = 0;
    if (!hear_pid(p)) return false;
    while (done < size) {
        struct iovec here = {(char *)to + done, size - done}, there = {(void *)(uintptr_t)(address + done), size - done};
        ssize_t n = process_vm_readv(p->pid, &here, 1, &there, 1, 0);
        if (n <= 0) return false;
        done += (size_t)n;
    }
    return true;
}

bool process_fail(ReaderProcess *p, const char *path, Err *err)
{
    int status = 0;
    if (p->wire.late)
        return fail(err, ERR_INPUT, "%.600s: reading it took too long and was given up; write or copy the file again, or look after the disk it is on", path);
    bool forked = hear_pid(p), told = forked && hear(p, &status);
    if (!forked)
        return fail(err, ERR_RESOURCE, "%.600s: no process could be had to read it; end others, or raise their limit (ulimit -u)", path);
    if (told && WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
        return fail(err, ERR_RESOURCE, "%.600s: the process that read it was killed (signal %d), perhaps as the system was out of memory; read it where there is more",
                    path, SIGKILL);
    if (told && WIFSIGNALED(status))
        return fail(err, ERR_INPUT, "%.600s: the process that read it died of signal %d (%s); the file is damaged: write or copy it again", path,
                    WTERMSIG(status), strsignal(WTERMSIG(status)));
    if (told && WIFEXITED(status) && WEXITSTATUS(status) == ERR_RESOURCE)
        return fail(err, ERR_RESOURCE, "%.600s: reading it takes more memory than a file of its length is given; if it is sound, read it where there is more memory", path);
    return fail(err, ERR_INPUT, "%.600s: the process that read it gave no answer; the file is damaged: write or copy it again", path);
}
