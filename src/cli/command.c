#include "cli/command.h"

#include "base/base.h"
#include "cli/options.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *name, *does;
    const Command *command;
} command[] = {
    {"mesh", "follow the surface through a sequence of volumes; write both meshes", &mesh_command},
    {"skin", "animate a potential that follows particles or grids", &skin_command},
    {"field", "sample a scene into a grid sequence", &field_command},
    {"render", "picture a mesh sequence", &render_command},
    {"check", "measure meshes against the field they came from", &check_command},
    {"farm", "cut a sequence into chunks and stitch the results", &farm_command},
    {"report", "one page of plots, events and a player", &report_command},
    {"diff", "compare two meshes or sequences", &diff_command},
    {"info", "what a volume or mesh file holds", &info_command},
};
enum { COMMAND_COUNT = sizeof command / sizeof *command };

static int command_find(const char *name)
{
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(command[i].name, name) == 0) return i;
    return NONE;
}

static int print_overview(void)
{
    puts("twinmesh follows the surface of a fluid cache and writes it as animated meshes.\n\n"
         "  twinmesh COMMAND ...\n  twinmesh help COMMAND\n  twinmesh --version\n");
    for (int i = 0; i < COMMAND_COUNT; i++)
        printf("  %-8s %s\n", command[i].name, command[i].does);
    puts("\nExit status: 0 done, 1 a check failed, 2 wrong usage, 3 bad input, 4 could not write,\n"
         "5 out of a resource.");
    return 0;
}

static int unknown(const char *name)
{
    fprintf(stderr, "twinmesh: there is no command %s (see twinmesh --help)\n", name);
    return ERR_USAGE;
}

static int print_version(void)
{
    puts("twinmesh " TWINMESH_VERSION);
    return 0;
}

static int print_usage(const Command *c)
{
    puts(c->usage);
    if (c->print_options) c->print_options(stdout);
    else options_print_table(stdout, c->options);
    return 0;
}

static int run_by_name(const char *name, int argc, char **argv)
{
    int i = command_find(name);
    if (i == NONE) return unknown(name);
    const Command *c = command[i].command;
    Options o;
    Err err;
    int status;
    if (!options_parse_by(&o, c->options, argc, argv, &err)) {
        fprintf(stderr, "twinmesh %s: %s\n", name, err.text);
        status = (int)err.code;
    } else if (option_given(&o, options_find(&o, "help"))) {
        status = print_usage(c);
    } else if (option_given(&o, options_find(&o, "version"))) {
        status = print_version();
    } else {
        status = c->run(&o);
    }
    options_free(&o);
    return status;
}

bool command_print_name(const char *path, Err *err)
{
    if (puts(path) >= 0 && fflush(stdout) == 0) return true;
    return fail(err, ERR_OUTPUT, "standard output cannot be written, where %.400s was to be named", path);
}

int command_run(int argc, char **argv)
{
    if (argc < 2) {
        fputs("twinmesh: no command is named (see twinmesh --help)\n", stderr);
        return ERR_USAGE;
    }
    const char *name = argv[1];
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) return print_version();
    bool help = strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0;
    if (!help) return run_by_name(name, argc - 2, argv + 2);
    char ask[] = "--help", *arguments[] = {ask, NULL};
    return argc > 2 ? run_by_name(argv[2], 1, arguments) : print_overview();
}
