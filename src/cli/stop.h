/* stop.h: a polite end on SIGINT and SIGTERM: the frame at hand is finished, the files are closed. */
#pragma once
#include <stdbool.h>

/* Installs the handlers; a second signal ends the program at once. SIGPIPE and SIGXFSZ (a file
 * past its limit) are ignored: the write fails and says so instead. */
void stop_watch(void);
/* The signal that came, or 0. */
int stop_signal(void);
