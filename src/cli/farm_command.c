#include "cli/command.h"

#include "base/thread.h"
#include "cli/farm.h"
#include "cli/run.h"

#include <errno.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

extern char **environ;

/* --- a chunk --------------------------------------------------------------------------------------- */

int farm_run_chunk(const Plan *p, int k, int threads)
{
    Options o;
    Err err = {0};
    Run run = {0};
    int status = 0;
    char *prefix = plan_chunk_prefix(p, k);
    if (options_parse(&o, p->narg, p->arg, &err) && job_make(&run.job, &o, &err) && job_load_scene(&run.job, &o, &err)) {
        const PlaceRange *r = &p->chunk[k].run;
        MeshJob *job = &run.job;
        job->prefix = prefix;
        job->is_chunk = job->resume = job->keep_state = true;
        job->place = r->first;
        job->nplace = r->last - r->first + 1;
        if (threads) job->threads = threads;
        if (k > 0 && p->has_surface) { /* what the sequence's first frames decide */
            run.surface = (Surface){true, p->spec};
            job->track.edge = p->edge;
            job->track.edge_in_voxels = false;
        }
        status = run_job(&run, &o);
    } else {
        fprintf(stderr, "twinmesh farm: %s\n", err.text);
        status = (int)err.code;
    }
    job_free(&run.job);
    options_free(&o);
    mem_free(prefix);
    return status;
}

/* --- other programs -------------------------------------------------------------------------------- */

static bool start(char *const *argv, pid_t *pid, Err *err)
{
    int code = posix_spawnp(pid, argv[0], NULL, NULL, argv, environ);
    return code == 0 || fail(err, ERR_RESOURCE, "%s: cannot be started: %s", argv[0], strerror(code));
}

/* Waits until one of the n has ended: which. This program has other children too (isolate.h). */
static int wait_for(int n, const pid_t *pid, int *status)
{
    for (;;) {
        int how;
        pid_t ended = waitpid(-1, &how, 0);
        *status = ended < 0 ? ERR_RESOURCE : WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
        if (ended < 0 && errno != EINTR) return 0;
        for (int i = 0; i < n; i++)
            if (pid[i] == ended) return i;
    }
}

static bool start_chunk(const Plan *p, int k, int threads, pid_t *pid, Err *err)
{
    char number[16], count[16], *program = program_path(), *plan = plan_path(p, "plan.json");
    char farm[] = "farm", chunk[] = "--chunk", with[] = "--threads", *argv[] = {program, farm, chunk, number, with, count, plan, NULL};
    snprintf(number, sizeof number, "%d", k + 1);
    snprintf(count, sizeof count, "%d", threads);
    bool good = start(argv, pid, err);
    mem_free(program);
    mem_free(plan);
    return good;
}

/* Returns the exit status: the first that is not 0; none is started after it. */
static int run_here(const Plan *p, int jobs, int threads, Err *err)
{
    int status = 0, running = 0;
    pid_t *pid = NEW(pid_t, jobs);
    for (int k = 0; running || (k < p->nchunk && status == 0);) {
        if (k < p->nchunk && running < jobs && status == 0) {
            if (start_chunk(p, k++, threads, &pid[running], err)) running++;
            else status = (int)err->code;
            continue;
        }
        int one, i = wait_for(running, pid, &one);
        pid[i] = pid[--running];
        if (status == 0) status = one;
    }
    mem_free(pid);
    return status ? status : farm_stitch(p);
}

static int submit(const Plan *p, Err *err)
{
    char *script = plan_path(p, "submit.sh"), sh[] = "sh", *argv[] = {sh, script, NULL};
    pid_t pid;
    int status = 0;
    if (start(argv, &pid, err)) wait_for(1, &pid, &status);
    if (status) fail(err, ERR_RESOURCE, "%.800s: Slurm did not take the jobs; it may be sent again by hand", script);
    mem_free(script);
    return (int)err->code;
}

/* --- the command ------------------------------------------------------------------------------------ */

static bool check(const Options *o, Err *err)
{
    static const int of_one_run[] = {OPT_FOLLOW, OPT_START_FROM, OPT_KEEP_STATE, OPT_RENDER};
    for (size_t i = 0; i < sizeof of_one_run / sizeof *of_one_run; i++)
        if (option_given(o, of_one_run[i])) return fail(err, ERR_USAGE, "--%s: goes with one run, not with a farm; leave it out", option_table[of_one_run[i]].name);
    if (option_given(o, FARM_SUBMIT) && option_given(o, FARM_RUN)) return fail(err, ERR_USAGE, "--submit and --run: the chunks run there or here; give one of them");
    const char *more = option_text(o, FARM_SBATCH);
    if (more && strpbrk(more, "\r\n")) return fail(err, ERR_USAGE, "--sbatch: its options must stand in one line");
    return true;
}

/* Chunks that are done are kept for a plan that would do them again just so. */
static bool check_old(const Plan *p, Err *err)
{
    Plan old;
    Err unsaid; /* where there is none, nothing is kept */
    char *path = plan_path(p, "plan.json");
    bool good = !plan_read(&old, path, &unsaid) || plan_is_same(&old, p) ||
                fail(err, ERR_USAGE, "%.800s: was made for other frames or options; leave --resume out to begin anew", path);
    plan_free(&old);
    mem_free(path);
    return good;
}

/* The plan of the command line, on disk. */
static bool make_plan(Plan *p, Options *o, Err *err)
{
    MeshJob *job = NEW0(MeshJob, 1);
    int threads = option_given(o, OPT_THREADS) ? option_int(o, OPT_THREADS) : 1;
    bool good = check(o, err) && job_make(job, o, err) && job_load_scene(job, o, err) &&
                plan_make(p, job, o, option_int(o, FARM_CHUNKS), option_int(o, FARM_OVERLAP), err);
    if (good && (strpbrk(p->directory, "\r\n") || strpbrk(p->folder, "\r\n"))) good = fail(err, ERR_USAGE, "a folder's name has more than one line; farm from another");
    good = good && (!job->resume || check_old(p, err)) && plan_write(p, threads, err) &&
           slurm_write(p, &(SlurmSettings){threads, option_int(o, FARM_TRIES), option_text(o, FARM_SBATCH)}, err);
    if (good && !job->resume) plan_sweep(p);
    job_free(job);
    mem_free(job);
    return good;
}

/* --chunk, --stitch: the operand is a plan. */
static int do_part(Plan *p, const Options *o, Err *err)
{
    bool is_stitch = option_given(o, FARM_STITCH);
    int k = is_stitch ? 1 : option_int(o, FARM_CHUNK);
    bool good = o->noperand == 1 ? plan_read(p, o->operand[0], err) : fail(err, ERR_USAGE, "one plan is to be named, such as PREFIX.farm/plan.json");
    if (good && k > p->nchunk) good = fail(err, ERR_USAGE, "--chunk %d: the plan has %d", k, p->nchunk);
    if (!good) return (int)err->code;
    return is_stitch ? farm_stitch(p) : farm_run_chunk(p, k - 1, option_given(o, OPT_THREADS) ? option_int(o, OPT_THREADS) : 0);
}

static int do_all(Plan *p, Options *o, Err *err)
{
    if (!make_plan(p, o, err)) return (int)err->code;
    if (option_given(o, FARM_SUBMIT)) return submit(p, err);
    if (!option_given(o, FARM_RUN)) return 0;
    int jobs = int_min(option_int(o, FARM_RUN), p->nchunk);
    return run_here(p, jobs, option_given(o, OPT_THREADS) ? option_int(o, OPT_THREADS) : int_max(1, thread_hardware_count() / jobs), err);
}

static int farm_run(Options *o)
{
    Plan plan = {0};
    Err err = {0};
    bool is_part = option_given(o, FARM_CHUNK) || option_given(o, FARM_STITCH);
    int status = is_part ? do_part(&plan, o, &err) : do_all(&plan, o, &err);
    if (err.code != ERR_NONE) fprintf(stderr, "twinmesh farm: %s\n", err.text);
    plan_free(&plan);
    return status;
}

const Command farm_command = {&farm_options, "twinmesh farm FRAME... -o PREFIX [options of mesh]\n"
    "twinmesh farm --chunk K PREFIX.farm/plan.json\n"
    "twinmesh farm --stitch PREFIX.farm/plan.json\n\n"
    "Cuts a sequence into chunks that a farm tracks at the same time, and stitches their meshes: a plan and batch\n"
    "scripts for Slurm in PREFIX.farm, which are sent with --submit. The outputs are those of mesh, whose options\n"
    "it takes.", farm_print_options, farm_run};
