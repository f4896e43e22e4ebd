/* Runs a command, and appends to a file a line of JSON: its seconds by the clock, those of all its processes by the processors,
 * and the peak of memory in bytes of the largest of them. Its exit status is the command's.
 *   timed FILE COMMAND [ARGUMENT...] */
#include <stdio.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static double clock_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double timeval_s(struct timeval t)
{
    return (double)t.tv_sec + 1e-6 * (double)t.tv_usec;
}

int main(int argc, char **argv)
{
    if (argc < 3) return 2;
    double start = clock_s();
    pid_t child = fork();
    if (child == 0) {
        execvp(argv[2], argv + 2);
        perror(argv[2]);
        _exit(127);
    }
    int status;
    if (child < 0 || waitpid(child, &status, 0) != child) return 5;
    double seconds = clock_s() - start;
    struct rusage used;
    getrusage(RUSAGE_CHILDREN, &used);
    FILE *f = fopen(argv[1], "a");
    if (!f) return 4;
    fprintf(f, "{\"seconds\":%.6f,\"cpu\":%.6f,\"peak\":%ld}\n", seconds, timeval_s(used.ru_utime) + timeval_s(used.ru_stime),
        1024 * used.ru_maxrss);
    return fclose(f) == 0 && WIFEXITED(status) ? WEXITSTATUS(status) : 4;
}
