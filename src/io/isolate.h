/* isolate.h: volumes read in processes of their own, so that the worst file costs one frame and one sentence.
 *
 * Once isolate_start was called, each volume_open has a process that opens, checks and decodes that one file, under limits
 * of memory and time, and hands its grids over as plain numbers, which are checked as a file's would be. What the decoder
 * does wrong (a crash, a corrupted heap, memory or time without bounds) ends with that process. volume.h is used as
 * before, by any thread.
 *
 * The processes are forked from a server, itself forked here before the program has threads of its own, which could hold locks
 * at that moment. (Those that OpenVDB's logging library starts before main sleep; but exit() would wait for them, so what
 * was forked leaves by _exit.) All of them end when this one does, and none minds the terminal's signals: a frame at hand
 * is finished. */
#pragma once
#include "base/base.h"

/* What reading a file may take: so much in any case, and so much more for each byte of it. Never more than the machine's
 * memory, and no bound on memory under the sanitizers, which need all addresses. */
typedef struct IsolateLimits {
    int64_t memory, memory_per_byte;
    double seconds, seconds_per_byte;
} IsolateLimits;

/* 4 GiB hold 1024^3 samples as floats. A byte of deflate unpacks to 1032 at most, two to a half float, which becomes a float
 * and is copied once. A minute is beyond any wait that is none of the disk's; a disk that gives less than 1 MB a second counts
 * as broken. */
static const IsolateLimits ISOLATE_LIMITS = {(int64_t)4 << 30, 4096, 60, 1e-6};

/* To be called before any thread is made. */
bool isolate_start(IsolateLimits limits, Err *err);
/* Files that are still open can no more be read. */
void isolate_stop(void);
