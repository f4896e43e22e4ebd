#include "cli/command.h"

#include "base/base.h"
#include "cli/options.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *name, *does;
    int (*run)(int argc, char **argv); /* NULL: not in this version */
} command[] = {
    {"mesh", "follow the surface through a sequence of volumes; write both meshes", mesh_command},
    {"skin", "animate a potential that follows particles or grids", skin_command},
    {"field", "sample a scene into a grid sequence", field_command},
    {"render", "picture a mesh sequence", NULL},
    {"check", "measure meshes against the field they came from", check_command},
    {"farm", "cut a sequence into chunks and stitch the results", farm_command},
    {"report", "a page of plots and events", NULL},
    {"diff", "compare two meshes or sequences", diff_command},
    {"info", "what a volume or mesh file holds", info_command},
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
        printf("  %-8s %s%s\n", command[i].name, command[i].does, command[i].run ? "" : " (not in this version)");
    puts("\nExit status: 0 done, 1 a check failed, 2 wrong usage, 3 bad input, 4 could not write,\n"
         "5 out of a resource.");
    return 0;
}

static int not_in_this_version(const char *name)
{
    fprintf(stderr, "twinmesh %s: not in this version\n", name);
    return ERR_USAGE;
}

static int unknown(const char *name)
{
    fprintf(stderr, "twinmesh: there is no command %s (see twinmesh --help)\n", name);
    return ERR_USAGE;
}

static int print_help(const char *name)
{
    int i = command_find(name);
    if (i == NONE) return unknown(name);
    if (!command[i].run) return not_in_this_version(name);
    char help[] = "--help", *arguments[] = {help, NULL};
    return command[i].run(1, arguments);
}

int command_run(int argc, char **argv)
{
    if (argc < 2) {
        fputs("twinmesh: no command is named (see twinmesh --help)\n", stderr);
        return ERR_USAGE;
    }
    const char *name = argv[1];
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) {
        puts("twinmesh " TWINMESH_VERSION);
        return 0;
    }
    bool help = strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0;
    if (help) return argc > 2 ? print_help(argv[2]) : print_overview();
    int i = command_find(name);
    if (i == NONE) return unknown(name);
    return command[i].run ? command[i].run(argc - 2, argv + 2) : not_in_this_version(name);
}
