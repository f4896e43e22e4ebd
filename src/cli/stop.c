#include "cli/stop.h"

#include <signal.h>
#include <stdatomic.h>
#include <stddef.h>

static atomic_int came;

static void note_signal(int number)
{
    came = number;
}

void stop_watch(void)
{
    struct sigaction polite = {.sa_handler = note_signal, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&polite.sa_mask);
    sigaction(SIGINT, &polite, NULL);
    sigaction(SIGTERM, &polite, NULL);
    struct sigaction ignore = {.sa_handler = SIG_IGN};
    sigaction(SIGPIPE, &ignore, NULL);
    sigaction(SIGXFSZ, &ignore, NULL);
    came = 0;
}

int stop_signal(void)
{
    return came;
}
