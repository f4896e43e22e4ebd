#include "cli/command.h"

#include "cli/run.h"

#include <stdio.h>

int mesh_command(int argc, char **argv)
{
    Options options;
    Run run = {0};
    Err err;
    int status = 0;
    if (!options_parse(&options, argc, argv, &err)) goto wrong;
    if (option_given(&options, OPT_HELP)) {
        puts("twinmesh mesh FRAME... -o PREFIX\n\n"
             "Follows the surface through a sequence of volumes and writes the mechanical and the geometric mesh of\n"
             "every frame. FRAME is a file, a pattern (phi.####.vdb, phi.%04d.vdb, phi.$F4.vdb), a folder, - for names\n"
             "on standard input, or a scene (scene.json), which is a sequence of its own.");
        options_print(stdout);
    } else if (option_given(&options, OPT_VERSION)) {
        puts("twinmesh " TWINMESH_VERSION);
    } else {
        if (!job_make(&run.job, &options, &err) || !job_load_scene(&run.job, &options, &err)) goto wrong;
        status = run_job(&run, &options);
    }
    job_free(&run.job);
    options_free(&options);
    return status;

wrong:
    job_free(&run.job);
    fprintf(stderr, "twinmesh mesh: %s\n", err.text);
    options_free(&options);
    return (int)err.code;
}
