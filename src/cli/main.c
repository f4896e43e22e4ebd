#include "base/base.h"
#include "base/thread.h"
#include "cli/command.h"
#include "cli/stop.h"
#include "io/isolate.h"

#include <stdio.h>

enum { KEPT_BYTES = 1 << 25 };

int main(int argc, char **argv)
{
    Err err;
    stop_watch();
    if (!isolate_start(ISOLATE_LIMITS, &err)) {
        fprintf(stderr, "twinmesh: %s\n", err.text);
        return (int)err.code;
    }
    mem_keep(KEPT_BYTES);
    int status = command_run(argc, argv);
    thread_shutdown();
    isolate_stop();
    if (fflush(stdout) != 0 && status == 0) {
        fputs("twinmesh: standard output cannot be written\n", stderr);
        status = ERR_OUTPUT;
    }
    return status;
}
