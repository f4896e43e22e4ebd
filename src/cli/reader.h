/* reader.h: reads one frame ahead: while a frame is solved, a thread of its own reads the next file and builds its
 * field. That thread never calls parallel_for, which belongs to the solve. */
#pragma once
#include "cli/job.h"
#include "field/field.h"
#include "sequence/pattern.h"

typedef struct ReadFrame {
    SequenceStep step;         /* ..._FRAME: there is one; ..._ERROR: err says why the sequence cannot go on */
    Frame frame;
    bool good;                 /* it could be read; else err says why not */
    Err err;
    Field field;
    SceneFrame *scene;         /* what the field is of, or NULL; goes with it */
    bool has_velocity;
    Grid velocity;             /* world units a second */
    VelocityUnits units;       /* it came in */
    int nattribute;
    Grid *attribute;           /* [nattribute] as the job names them */
    char surface[300];         /* how the surface was chosen; "" when that was said before */
    double seconds;
} ReadFrame;

typedef struct Reader Reader;

/* `job` and `sequence` stay the caller's, who leaves them alone until reader_close. NULL when no thread can be had. */
Reader *reader_open(const MeshJob *job, Sequence *sequence, Err *err);
/* Waits for the next frame. False when a signal came instead. The caller frees the frame. */
bool reader_take(Reader *r, ReadFrame *out);
void reader_close(Reader *r);
void readframe_free(ReadFrame *f);
