/* run.h: one run of `twinmesh mesh`: frames are read one ahead, solved, completed while the next one is solved (track.h), and
 * written one behind that. */
#pragma once
#include "base/thread.h"
#include "cli/inputs.h"
#include "cli/reader.h"
#include "cli/writer.h"

enum { SLOTS = 3 };

/* A frame solved, on its way to the writer. While `busy`, it and what the run keeps from frame to frame belong to its task. */
typedef struct Completion {
    bool busy;
    Task task;
    const Options *options;
    ReadFrame *frame;
    OutFrame out;
    FrameStat stat;          /* what out held, for the words about it */
    bool good;
    Err err;
} Completion;

typedef struct Run {
    MeshJob job;
    Console console;
    Sequence sequence;
    int64_t step;            /* what the frames' numbers rise by */
    Reader *reader;
    Track *solver;           /* of the frame being solved */
    Track *track;            /* of the frame being completed, and of the state kept; to the papers' rules it is the solver too */
    int64_t solved;          /* number of the last frame that the solver saw, or NONE */
    Completion completion;
    Outputs out;
    Writer *writer;
    ReadFrame slot[SLOTS];   /* in turn: a frame stays where it was lent from until the next one is completed */
    int next;                /* the slot for the one to be read */
    TriMesh mesh[2][KIND_COUNT]; /* the frame last shown, which the writer may be at, and the one to come */
    int shown_at;            /* which of the two was shown last */
    int done;                /* frames, with those of the run gone on with */
    double frame_start_s;
    /* what goes on from frame to frame, and is kept in PREFIX.state */
    Surface surface;
    Inputs inputs;
    char *tracked_label;     /* of the last frame that the tracker saw, NULL: none */
    int64_t tracked, shown;  /* numbers of the last frames that the tracker saw, and that were written; NONE */
} Run;

/* Returns the exit status. */
int run_job(Run *run, const Options *o);

/* --- resume.c ----------------------------------------------------------------------------------------------------------- */

/* What another run needs to go on after the frame just done, but for the outputs' own. */
Store run_save(Run *run, const Options *o);

typedef enum ResumeKind {
    RESUME_FAILED,  /* err says why */
    RESUME_NEW,     /* the outputs are to be begun */
    RESUME_ON,      /* all is as it was after the last frame done, the outputs too */
    RESUME_OVER     /* the run is complete */
} ResumeKind;
/* Puts the run where --resume or --start-from wants it; its sequence and tracker were just opened. */
ResumeKind run_resume(Run *run, const Options *o, Err *err);
