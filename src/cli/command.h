/* command.h: the program's commands: what each is called, takes and says of itself, and the function behind it. */
#pragma once
#include "cli/options.h"

/* argv[0] is the program's name. Says what went wrong on standard error. Returns the exit status. */
int command_run(int argc, char **argv);

typedef struct Command {
    const OptionTable *options;
    const char *usage;                 /* what --help says before the options */
    void (*print_options)(FILE *out);  /* NULL: the table as it is */
    int (*run)(Options *o);            /* the arguments are parsed, and are neither --help nor --version; the exit status */
} Command;

extern const Command mesh_command, skin_command, field_command, render_command, check_command, farm_command, report_command, diff_command, info_command;

/* A finished file's name on standard output, at once: data for the next program. A reader that went away is a failure to write. */
bool command_print_name(const char *path, Err *err);
