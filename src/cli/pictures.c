#define _GNU_SOURCE /* pipe2 */
#include "cli/pictures.h"

#include "cli/farm.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

enum { OWN_ARGUMENTS_MOST = 10, NUMBER_SIZE = 48 };

struct Pictures {
    pid_t pid;
    int names;  /* its standard input */
    bool gone;  /* it reads no more */
};

static bool spawn(Pictures *p, char **argv, int from, Err *err)
{
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, from, STDIN_FILENO);
    int code = posix_spawnp(&p->pid, argv[0], &actions, NULL, argv, environ);
    posix_spawn_file_actions_destroy(&actions);
    return code == 0 || fail(err, ERR_RESOURCE, "--render: %s cannot be started: %s", argv[0], strerror(code));
}

/* What render is told of the run; then what stands behind `--`, which may say it otherwise. */
static bool start_render(Pictures *p, const MeshJob *job, int from, Err *err)
{
    char render[] = "render", names[] = "-", output[] = "-o", y_up[] = "--up=y", quiet[] = "--quiet", verbose[] = "--verbose";
    char fps[NUMBER_SIZE], threads[NUMBER_SIZE];
    char **argv = NEW(char *, OWN_ARGUMENTS_MOST + job->nrender_option), *program = program_path(), *pattern = mem_text(job->render);
    int n = 0;
    snprintf(fps, sizeof fps, "--fps=%.17g", job->track.fps);
    snprintf(threads, sizeof threads, "--threads=%d", job->threads);
    argv[n++] = program;
    argv[n++] = render;
    argv[n++] = names;
    argv[n++] = output;
    argv[n++] = pattern;
    argv[n++] = fps;
    argv[n++] = threads;
    argv[n++] = job->loudness == LOUD_VERBOSE ? verbose : quiet;
    if (job->turn.up == UP_Y) argv[n++] = y_up;
    for (int i = 0; i < job->nrender_option; i++) argv[n++] = job->render_option[i];
    argv[n] = NULL;
    bool ok = spawn(p, argv, from, err);
    mem_free(argv);
    mem_free(program);
    mem_free(pattern);
    return ok;
}

Pictures *pictures_start(const MeshJob *job, Err *err)
{
    int end[2];
    if (pipe2(end, O_CLOEXEC) != 0) {
        fail(err, ERR_RESOURCE, "--render: no pipe could be had: %s", strerror(errno));
        return NULL;
    }
    Pictures *p = NEW0(Pictures, 1);
    p->names = end[1];
    bool ok = start_render(p, job, end[0], err);
    close(end[0]);
    if (ok) return p;
    close(end[1]);
    mem_free(p);
    return NULL;
}

void pictures_name(Pictures *p, const char *path)
{
    size_t size = strlen(path) + 1, done = 0;
    char *line = mem_text(path);
    line[size - 1] = '\n';
    while (done < size && !p->gone) {
        ssize_t n = write(p->names, line + done, size - done);
        if (n > 0) done += (size_t)n;
        else p->gone = errno != EINTR;
    }
    mem_free(line);
}

bool pictures_finish(Pictures *p, Err *err)
{
    int how = 0;
    if (!p) return true;
    close(p->names);
    while (waitpid(p->pid, &how, 0) < 0 && errno == EINTR) continue;
    mem_free(p);
    if (WIFEXITED(how) && WEXITSTATUS(how) == 0) return true;
    return fail(err, WIFEXITED(how) && WEXITSTATUS(how) <= ERR_RESOURCE ? (ErrCode)WEXITSTATUS(how) : ERR_RESOURCE,
                "--render: not all pictures were made; the meshes are all there: twinmesh render makes pictures of them");
}
