/* What reading in a process of its own costs: each file read in turn direct and isolated; the medians and their ratio, of reading alone
 * and with the field that is built from what was read, which the program's timings call "read".
 *
 *     isolated ROUNDS [--velocity NAME] FILE...
 *
 * Isolated reads are asked for by a process of their own that started the server: this one stays without. */
#include "io/isolate.h"
#include "io/volume.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static double clock_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

enum { READ, READ_AND_BUILT, STAGES };

static void read_once(const char *path, const VolumeRequest *request, double seconds[STAGES])
{
    Volume v;
    Field field = {0};
    Err err = {0};
    double start = clock_s();
    bool ok = volume_read(path, request, &v, &err);
    seconds[READ] = clock_s() - start;
    if (ok) {
        SurfaceChoice choice = volume_choose_surface(&v, NAN, 0);
        ok = field_build(&field, &v.surface, &choice.spec, &err);
        seconds[READ_AND_BUILT] = clock_s() - start;
    }
    if (!ok) {
        fprintf(stderr, "%s: %s\n", path, err.text);
        _exit(3);
    }
    field_free(&field);
    volume_free(&v);
}

/* Reads what it is asked to, isolated, and answers with the seconds. */
static void serve(int from, int to, char **path, const VolumeRequest *request)
{
    Err err;
    int i;
    if (!isolate_start(ISOLATE_LIMITS, &err)) _exit(5);
    while (read(from, &i, sizeof i) == (ssize_t)sizeof i) {
        double s[STAGES];
        read_once(path[i], request, s);
        if (write(to, s, sizeof s) < 0) break;
    }
    isolate_stop();
    _exit(0); /* a copy of this process: its libraries' threads, which exit would wait for, are not in it */
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, compare);
    return n % 2 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

int main(int argc, char **argv)
{
    VolumeRequest request = {0};
    int ask[2], answer[2], first = 2;
    if (argc > 4 && strcmp(argv[2], "--velocity") == 0) request.velocity = argv[3], first = 4;
    int rounds = argc > first ? atoi(argv[1]) : 0, n = argc - first;
    if (rounds < 1 || pipe(ask) != 0 || pipe(answer) != 0) return 2;
    if (fork() == 0) {
        close(ask[1]);
        serve(ask[0], answer[1], argv + first, &request);
    }
    double *direct[STAGES], *isolated[STAGES];
    for (int t = 0; t < STAGES; t++) {
        direct[t] = NEW(double, rounds * n);
        isolated[t] = NEW(double, rounds * n);
    }
    int at = 0;
    for (int r = -1; r < rounds; r++) /* the first round only warms up */
        for (int i = 0; i < n; i++) {
            double d[STAGES], s[STAGES];
            read_once(argv[first + i], &request, d);
            if (write(ask[1], &i, sizeof i) < 0 || read(answer[0], s, sizeof s) != (ssize_t)sizeof s) return 3;
            if (r < 0) continue;
            for (int t = 0; t < STAGES; t++) {
                direct[t][at] = d[t];
                isolated[t][at] = s[t];
            }
            at++;
        }
    printf("%d reads each, medians\n", at);
    for (int t = 0; t < STAGES; t++) {
        double d = median(direct[t], at), s = median(isolated[t], at);
        printf("%-15s direct %6.2f ms, isolated %6.2f ms, %+.1f %%\n", t == READ ? "read" : "read and built", 1e3 * d, 1e3 * s, 100 * (s / d - 1));
        mem_free(direct[t]);
        mem_free(isolated[t]);
    }
    close(ask[1]);
    wait(NULL);
    return 0;
}
