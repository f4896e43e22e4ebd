/* slurm.c: the plan as jobs of Slurm: an array of chunks, and the stitching, which waits for all of them. */
#include "cli/farm.h"

#include "io/file.h"

#include <string.h>

/* As one word, for the shell and for sbatch. */
static void put_word(FILE *out, const char *text)
{
    fputc('\'', out);
    for (; *text; text++)
        if (*text == '\'') fputs("'\\''", out);
        else fputc(*text, out);
    fputc('\'', out);
}

/* A folder, and behind it a file or "": in the names of files % stands for numbers of the job, so that the folder's own is doubled. */
static void put_option(FILE *out, const char *name, const char *folder, const char *file)
{
    fprintf(out, "#SBATCH --%s='", name);
    for (; *folder; folder++)
        if (*folder == '\'') fputs("'\\''", out);
        else if (*folder == '%' && file[0]) fputs("%%", out);
        else fputc(*folder, out);
    fprintf(out, "%s'\n", file);
}

static void put_head(FILE *out, const Plan *p, const SlurmSettings *set, const char *name, const char *log)
{
    const char *slash = strrchr(p->folder, '/');
    char title[300];
    snprintf(title, sizeof title, "%.200s.%s", slash ? slash + 1 : p->folder, name);
    fputs("#!/bin/sh\n", out);
    put_option(out, "job-name", title, "");
    put_option(out, "chdir", p->directory, "");
    put_option(out, "output", p->folder, log);
    fputs("#SBATCH --open-mode=append\n#SBATCH --requeue\n", out);
    if (set->more) fprintf(out, "#SBATCH %s\n", set->more);
}

static void put_command(FILE *out, const char *arguments, const Plan *p)
{
    char *program = program_path(), *plan = plan_path(p, "plan.json");
    put_word(out, program);
    fprintf(out, " farm %s ", arguments);
    put_word(out, plan);
    fputc('\n', out);
    mem_free(program);
    mem_free(plan);
}

/* A chunk goes on where it was killed, if it was not its input's fault. */
static void put_array(FILE *out, const Plan *p, const SlurmSettings *set)
{
    char arguments[100];
    snprintf(arguments, sizeof arguments, "--chunk \"$SLURM_ARRAY_TASK_ID\" --threads %d", set->threads);
    put_head(out, p, set, "chunks", "/chunk.%4a.log");
    fprintf(out, "#SBATCH --array=1-%d\n#SBATCH --cpus-per-task=%d\n\n", p->nchunk, set->threads);
    fprintf(out, "tries=$((${SLURM_RESTART_COUNT:-0} + 1))\n[ $tries -le %d ] || exit 5\n", set->tries);
    put_command(out, arguments, p);
    fputs("status=$?\ncase $status in\n    0 | 2 | 3) exit $status ;; # done, or the same again: wrong options, bad input\nesac\n", out);
    fprintf(out, "[ $tries -lt %d ] && scontrol requeue \"$SLURM_JOB_ID\"\nexit $status\n", set->tries);
}

static void put_stitch(FILE *out, const Plan *p, const SlurmSettings *set)
{
    put_head(out, p, set, "stitch", "/stitch.log");
    fputs("#SBATCH --kill-on-invalid-dep=yes\n\n", out);
    put_command(out, "--stitch", p);
}

/* A chunk that fails for good ends the stitching; no job waits for what will not come. */
static void put_submit(FILE *out, const Plan *p, const SlurmSettings *set)
{
    char *array = plan_path(p, "array.sh"), *stitch = plan_path(p, "stitch.sh");
    (void)set;
    fputs("#!/bin/sh -e\ncd ", out);
    put_word(out, p->directory);
    fputs("\nchunks=$(sbatch --parsable ", out);
    put_word(out, array);
    fputs(")\nchunks=${chunks%%;*}\nstitch=$(sbatch --parsable --dependency=\"afterok:$chunks\" ", out);
    put_word(out, stitch);
    fputs(") || { scancel \"$chunks\"; exit 5; }\necho \"$chunks\"\necho \"${stitch%%;*}\"\n", out);
    mem_free(array);
    mem_free(stitch);
}

bool slurm_write(const Plan *p, const SlurmSettings *set, Err *err)
{
    static const struct {
        const char *name;
        void (*put)(FILE *out, const Plan *p, const SlurmSettings *set);
    } script[] = {{"array.sh", put_array}, {"stitch.sh", put_stitch}, {"submit.sh", put_submit}};
    bool good = true;
    for (size_t i = 0; i < sizeof script / sizeof *script && good; i++) {
        OutFile f;
        char *path = plan_path(p, script[i].name);
        good = outfile_open(&f, path, err);
        if (good) script[i].put(f.stream, p, set);
        good = good && outfile_commit(&f, err);
        mem_free(path);
    }
    return good;
}
