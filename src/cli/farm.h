/* farm.h: a sequence as a farm runs it: cut into chunks that overlap, each tracked by a job of its own, and stitched.
 *
 * All is decided once, by the plan: PREFIX.farm/plan.json. Chunk k is tracked from some frames before its own on, until its
 * mesh has settled, to one frame behind its own, which tells where the last meshes go; its frames are kept in
 * PREFIX.farm/chunk.NNNN.chunk (chunk.h). The stitching joins the identities where two chunks meet (seam.h) and hands
 * all frames to the writer that mesh itself has. */
#pragma once
#include "cli/job.h"
#include "field/field.h"

/* Places in the sequence, from 0; both ends belong to it. */
typedef struct PlaceRange {
    int first, last;
} PlaceRange;

typedef struct ChunkPlan {
    PlaceRange own, run;
    char first[FRAME_DIGITS_MAX + 2], last[FRAME_DIGITS_MAX + 2]; /* labels of its own frames */
} ChunkPlan;

typedef struct Plan {
    char *folder;           /* PREFIX.farm */
    char *directory;        /* where all commands run */
    int narg;
    char **arg;             /* [narg] of twinmesh mesh; owned */
    int64_t step;           /* what the frames' numbers rise by */
    bool has_surface;       /* some frame has one: */
    FieldSpec spec;         /* as the first such frame chooses it */
    double edge;            /* world units */
    int nchunk;
    ChunkPlan *chunk;       /* [nchunk] */
} Plan;

/* Cuts the frames of the job, which reads the first of them. plan_free in any case. */
bool plan_make(Plan *p, const MeshJob *job, const Options *o, int nchunk, int overlap, Err *err);
/* PREFIX.farm/plan.json. `threads`: of a chunk's command. */
bool plan_write(const Plan *p, int threads, Err *err);
bool plan_read(Plan *p, const char *path, Err *err);
void plan_free(Plan *p);
/* Whether both ask the same of each chunk. */
bool plan_is_same(const Plan *a, const Plan *b);
/* Removes what an earlier plan's chunks left. */
void plan_sweep(const Plan *p);
/* FOLDER/name; the prefix of chunk k's files, k from 0. To be freed. */
char *plan_path(const Plan *p, const char *name);
char *plan_chunk_prefix(const Plan *p, int k);
/* This program. To be freed. */
char *program_path(void);

typedef struct SlurmSettings {
    int threads, tries;
    const char *more;       /* options for sbatch; NULL: none */
} SlurmSettings;
/* array.sh, stitch.sh and submit.sh, which sends both. */
bool slurm_write(const Plan *p, const SlurmSettings *set, Err *err);

/* The job of chunk k, and that of the stitching. Return the exit status. `threads`: 0: one a core. */
int farm_run_chunk(const Plan *p, int k, int threads);
int farm_stitch(const Plan *p);
