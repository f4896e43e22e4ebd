/* renumber.h: a chunk's frames in the identities of the whole sequence. */
#pragma once
#include "base/hash.h"
#include "cli/outputs.h"

typedef struct Renumber {
    bool plain;       /* the first chunk's are the sequence's */
    Map identity;     /* a chunk's identity: the sequence's */
    Map number;       /* the number of a component of the frame tracked last: in the sequence */
    int32_t next;     /* the first that no frame has had yet */
} Renumber;

/* Meshes and events of a tracked frame; `mesh` is the frame's, [KIND_COUNT]. Identities that are new to the chunk, or that found no
 * partner at the seam, get fresh ones. False where these have come to their end. */
bool renumber_frame(Renumber *r, OutFrame *f, TriMesh *mesh, Err *err);
void renumber_free(Renumber *r);
