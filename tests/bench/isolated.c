/* What reading in a process of its own costs: each file read in turn direct and isolated, the medians and their ratio.
 *
 *     isolated ROUNDS [--velocity NAME] FILE...
 *
 * Isolated reads are asked for by a process of their own that started the server: this one stays without. */
#include "io/isolate.h"
#include "io/volume.h"

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

static double read_once(const char *path, const VolumeRequest *request)
{
    Volume v;
    Err err = {0};
    double start = clock_s();
    if (!volume_read(path, request, &v, &err)) {
        fprintf(stderr, "%s\n", err.text);
        _exit(3);
    }
    double seconds = clock_s() - start;
    volume_free(&v);
    return seconds;
}

/* Reads what it is asked to, isolated, and answers with the seconds. */
static void serve(int from, int to, char **path, const VolumeRequest *request)
{
    Err err;
    int i;
    if (!isolate_start(ISOLATE_LIMITS, &err)) _exit(5);
    while (read(from, &i, sizeof i) == (ssize_t)sizeof i) {
        double s = read_once(path[i], request);
        if (write(to, &s, sizeof s) < 0) break;
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
    double *direct = NEW(double, rounds * n), *isolated = NEW(double, rounds * n), ratio_sum = 0;
    int at = 0;
    for (int r = -1; r < rounds; r++) /* the first round only warms up */
        for (int i = 0; i < n; i++) {
            double d = read_once(argv[first + i], &request), s;
            if (write(ask[1], &i, sizeof i) < 0 || read(answer[0], &s, sizeof s) != (ssize_t)sizeof s) return 3;
            if (r < 0) continue;
            direct[at] = d;
            isolated[at++] = s;
        }
    for (int i = 0; i < at; i++) ratio_sum += isolated[i] / direct[i];
    double d = median(direct, at), s = median(isolated, at);
    printf("%d reads each: direct %.2f ms, isolated %.2f ms (medians), %+.1f %%; mean ratio %.3f\n", at, 1e3 * d, 1e3 * s, 100 * (s / d - 1), ratio_sum / at);
    close(ask[1]);
    wait(NULL);
    mem_free(direct);
    mem_free(isolated);
    return 0;
}
