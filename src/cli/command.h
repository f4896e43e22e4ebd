/* command.h: the program's commands. Each takes the arguments behind its name and returns the exit status. */
#pragma once

/* argv[0] is the program's name. Says what went wrong on standard error. */
int command_run(int argc, char **argv);

int mesh_command(int argc, char **argv);
int field_command(int argc, char **argv);
int skin_command(int argc, char **argv);
int info_command(int argc, char **argv);
int check_command(int argc, char **argv);
int diff_command(int argc, char **argv);
int farm_command(int argc, char **argv);
