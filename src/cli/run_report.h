/* run_report.h: what PREFIX.report.jsonl tells commands that look at the meshes of a run: its settings, as their defaults, and
 * which frames its glTFs hold. */
#pragma once
#include "cli/options.h"

#include <jansson.h>

typedef struct RunReport {
    json_t *settings;    /* NULL: there is no report */
    int64_t first, step; /* numbers of the frames of its glTFs: the first one shown, and what they rise by; NONE: not known */
} RunReport;

/* Where there is none, or it is none of ours, nothing is known and nothing is said. */
RunReport run_report_read(const char *prefix);
void run_report_free(RunReport *r);
/* Suggests to the command's options what the run was given or told, by name. The report must outlive the options. */
bool run_report_suggest(const RunReport *r, Options *o, Err *err);
