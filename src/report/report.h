/* report.h: the frames' numbers as lines of JSON, and their totals.
 *
 * PREFIX.report.jsonl: a first line with the settings, a line a frame, a last line of totals. PREFIX.events.jsonl: a line
 * a tracked frame with its components, a line an event behind it, a last line of totals. All of it is the same bytes for
 * the same input: no times, hosts, paths or thread counts. Seconds go to PREFIX.timings.jsonl.
 * The functions write to a stream and leave it to its owner to notice a full disk (ferror keeps it). */
#pragma once
#include "base/base.h"
#include "track/track.h"
#include <stdio.h>

/* As JSON has it; NULL: null. */
void report_put_text(FILE *out, const char *s);

typedef struct ReportSetting {
    const char *name;
    const char *text;      /* NULL: null, "this was decided by the program" */
    bool is_number;        /* text stands as it is, without quotes */
} ReportSetting;

typedef enum FrameFate { FRAME_TRACKED, FRAME_HELD, FRAME_SKIPPED } FrameFate;

/* Where a frame's seconds went. read: in the reading thread, beside the solve of the frame before; wait: for that
 * thread; carry: the ends of glTF runs taken to the next frame; write: in the writing thread, beside the solve of the frame
 * behind, but for the state; whole: from the end of one frame to the end of the next. */
#define REPORT_STAGES(X)                                                                                     \
    X(read) X(wait) X(predict) X(alter) X(relax) X(audit) X(mend) X(refine) X(carry) X(write) X(whole)
typedef struct StageSeconds {
#define STAGE_FIELD(name) double name;
    REPORT_STAGES(STAGE_FIELD)
#undef STAGE_FIELD
} StageSeconds;

/* Of one glTF file. */
typedef struct ReportRuns {
    const char *mesh;      /* "mechanical", "geometric" */
    int runs;
    double median_run;     /* frames */
} ReportRuns;

typedef struct ReportTotals {
    int frames, held, skipped;                      /* frames: tracked ones */
    int exact, empty;                               /* frames with the grid's own topology; without surface */
    int64_t triangles_mechanical, triangles_geometric;
    int64_t splits, collapses, flips, cg_iterations, projections_lost;
    int64_t inverted_left, inverted_left_geometric, remade_components, raw_components;
    int64_t events[EVENT_KINDS];
    double edge_ratio_sum, angle_p5_sum, angle_p50_sum, ids_kept_sum, distance_sum;
    double angle_p5_least, ids_kept_least, distance_max_vox;
    int nsurface, nids;                             /* frames that the sums are over */
    StageSeconds seconds;
} ReportTotals;

ReportTotals report_totals_zero(void);
/* stat may be NULL for frames that were not tracked. */
void report_totals_add(ReportTotals *t, FrameFate fate, const FrameStat *stat, const StageSeconds *seconds);

void report_write_settings(FILE *out, const char *version, int n, const ReportSetting *setting);
/* stat may be NULL for frames that were not tracked. `surface` says how the surface was chosen; NULL: as before. */
void report_write_frame(FILE *out, const char *label, FrameFate fate, const char *surface, const FrameStat *stat);
/* complete: no error or signal ended the run early. */
void report_write_totals(FILE *out, const ReportTotals *t, int nruns, const ReportRuns *runs, bool complete);

/* The frame's lines of PREFIX.events.jsonl. `since`: the label of the frame tracked before; NULL: there was none. */
void events_write_frame(FILE *out, const char *label, const char *since, const FrameEvents *events);
/* The last line: how many frames, and the events of each kind. */
void events_write_totals(FILE *out, const ReportTotals *t, bool complete);

/* The method's own stages; the rest is zero. */
StageSeconds report_stages(const FrameStat *stat);
void timings_write_frame(FILE *out, const char *label, const StageSeconds *seconds);
void timings_write_totals(FILE *out, const ReportTotals *t);

/* A few lines for people. */
void report_summarise(FILE *out, const ReportTotals *t);
