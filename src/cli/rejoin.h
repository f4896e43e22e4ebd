/* rejoin.h: rest positions (--rest) over a seam: a chunk calls rest where its own first frame found the surface; the frames before
 * know where that was at rest. */
#pragma once
#include "cli/outputs.h"
#include "mesh/nearest.h"

typedef struct Rejoin {
    bool plain;            /* the first chunk's are the sequence's */
    int64_t frames;        /* from the sequence's first tracked frame to the chunk's */
    TriMesh mesh;          /* mechanical, of the chunk's first frame as the chunk before has it, its rest positions the sequence's */
    Vec3 *pos;             /* [mesh.nvert] */
    double edge;           /* mean, of it */
    NearestIndex index;
    float *rest[4];        /* its columns; NULL: it has none */
} Rejoin;

/* Takes the mesh over. */
void rejoin_begin(Rejoin *r, TriMesh *mesh, int64_t frames);
/* The columns rest_x, rest_y, rest_z and rest_frame of a chunk's mesh, where it has them, in the sequence's places and frames. */
void rejoin_apply(const Rejoin *r, TriMesh *m);
void rejoin_free(Rejoin *r);
