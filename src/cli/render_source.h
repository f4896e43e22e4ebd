/* render_source.h: the meshes that render pictures, frame by frame, each with those before and after it. */
#pragma once
#include "cli/run_report.h"
#include "io/mesh_sequence.h"
#include "sequence/pattern.h"

enum { NEARBY = 3 };

typedef struct RenderSource {
    RunReport report;          /* of the run that wrote a PREFIX */
    MeshSequence *meshes;      /* NULL: names on standard input */
    MeshSequence *mechanical;  /* of the same frames; NULL: not wanted, or names on standard input */
    bool with_mechanical;
    Sequence arrivals;
    bool ended;                /* no more arrive */
    int n, cap;
    int64_t *number;           /* [n] of all frames, or of those that arrived */
    char **path;               /* [n] of those that arrived */
    FrameRange range;          /* of those that are pictured */
    int at;                    /* the frame at hand */
    int held[NEARBY];          /* which frames the meshes are of, NONE: none; by frame modulo NEARBY */
    TriMesh mesh[NEARBY];
    TriMesh twin;              /* mechanical mesh of the frame at hand */
} RenderSource;

typedef struct RenderShot {
    int64_t number;
    const TriMesh *mesh, *before, *after;  /* before, after: NULL where there is none, or motion is not wanted */
    const TriMesh *mechanical;             /* NULL: not wanted */
    int64_t to_before, to_after;           /* by how much the number falls and rises; where there is none, as on the other side */
} RenderShot;

/* By the table of render; --fps becomes the run's where it is not given. On failure nothing is left to close. The options
 * must not outlive the source. */
bool render_source_open(RenderSource *s, Options *o, Err *err);
void render_source_close(RenderSource *s);
/* Frames to be pictured, or NONE. */
int render_source_length(const RenderSource *s);
int64_t render_source_first(const RenderSource *s);
int64_t render_source_last(const RenderSource *s);
/* The next frame; its meshes stay until the next call. Where motion is wanted and names arrive, waits for the one after. */
SequenceStep render_source_next(RenderSource *s, bool motion, RenderShot *out, Err *err);
/* Begins anew; not with names that arrive. */
void render_source_rewind(RenderSource *s);
bool render_source_is_piped(const RenderSource *s);
