/* chunk.h: PREFIX.chunk: the frames of a part of a sequence, as the tracker gave them, to be stitched to the others' (farm).
 *
 * A head with the program's version, then a record a frame: its length, a digest, and the OutFrame with its meshes as a store's
 * bytes, so that only the same build reads it again. Nothing in it is trusted all the same. */
#pragma once
#include "cli/outputs.h"

char *chunk_path(const char *prefix); /* to be freed */

bool chunk_begin(OutFile *f, Err *err);
/* The meshes of held frames are not kept: they are those before. */
bool chunk_add_frame(OutFile *f, OutFrame *frame, Err *err);

typedef struct ChunkFile {
    FILE *stream;              /* NULL: not open */
    char *path;
    TriMesh mesh[KIND_COUNT];  /* of the tracked frame read last */
} ChunkFile;

/* A failure leaves nothing to close. */
bool chunk_open(ChunkFile *c, const char *prefix, Err *err);
/* The next frame; out->mesh is c->mesh, or NULL where it was not tracked. outframe_free in any case. At the end *more is false. */
bool chunk_next(ChunkFile *c, OutFrame *out, bool *more, Err *err);
void chunk_rewind(ChunkFile *c);
void chunk_close(ChunkFile *c);
