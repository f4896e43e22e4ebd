#include "cli/command.h"

#include "cli/run.h"

#include <stdio.h>

static int mesh_run(Options *o)
{
    Run run = {0};
    Err err;
    int status, nbehind = o->noperand - o->behind;
    bool renders = option_given(o, OPT_RENDER); /* what is behind `--` is for it */
    if (renders) o->noperand = o->behind;
    if (job_make(&run.job, o, &err) && job_load_scene(&run.job, o, &err)) {
        if (renders) {
            run.job.nrender_option = nbehind;
            run.job.render_option = o->operand + o->behind;
        }
        status = run_job(&run, o);
    } else {
        fprintf(stderr, "twinmesh mesh: %s\n", err.text);
        status = (int)err.code;
    }
    job_free(&run.job);
    return status;
}

const Command mesh_command = {&mesh_options, "twinmesh mesh FRAME... -o PREFIX\n\n"
    "Follows the surface through a sequence of volumes and writes the mechanical and the geometric mesh of\n"
    "every frame. FRAME is a file, a pattern (phi.####.vdb, phi.%04d.vdb, phi.$F4.vdb), a folder, - for names\n"
    "on standard input, or a scene (scene.json), which is a sequence of its own.", options_print, mesh_run};
