#include "base/base.h"
#include "base/thread.h"
#include "cli/command.h"
#include "cli/stop.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    stop_watch();
    int status = command_run(argc, argv);
    thread_shutdown();
    if (fflush(stdout) != 0 && status == 0) {
        fputs("twinmesh: standard output cannot be written\n", stderr);
        status = ERR_OUTPUT;
    }
    return status;
}
