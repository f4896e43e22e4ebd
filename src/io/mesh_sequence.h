/* mesh_sequence.h: a sequence of meshes by frame number, however it is stored.
 *
 * A name is one of
 *   PREFIX                    as twinmesh mesh was given it: PREFIX.KIND.NNNN.ply, else PREFIX.KIND.glb, else PREFIX.KIND.gltf
 *   a.glb, a.gltf             as twinmesh writes them
 *   a.ply, a.####.ply, a folder of PLY files
 * A glTF does not know its frames' numbers: they are 0, 1, 2 ..., with those where nothing is shown, until
 * mesh_sequence_number_from. Velocities and attributes of a glTF are not those of each frame, hence not read; nor does it
 * have parents. */
#pragma once
#include "mesh/trimesh.h"

typedef struct MeshSequence MeshSequence;

/* A PREFIX, of which there are two kinds: the name is none of a PLY or glTF, nor of a file or folder that exists. */
bool mesh_sequence_is_prefix(const char *name);
/* Whether there are meshes of the kind, sound or not. */
bool mesh_sequence_is_there(const char *prefix, const char *kind);

/* KIND goes with a PREFIX: "geometric" or "mechanical". NULL with a sentence, ERR_INPUT, where there is no such sequence. */
MeshSequence *mesh_sequence_open(const char *name, const char *kind, Err *err);
void mesh_sequence_close(MeshSequence *s);

bool mesh_sequence_is_gltf(const MeshSequence *s);
/* Numbers the frames of a glTF first, first + step, ...; leaves PLY files alone. step >= 1. */
void mesh_sequence_number_from(MeshSequence *s, int64_t first, int64_t step);

/* Frames that have a mesh, by rising number. */
int mesh_sequence_length(const MeshSequence *s);
int64_t mesh_sequence_number(const MeshSequence *s, int i);
/* Where the frame's mesh is stored, for messages. */
const char *mesh_sequence_path(const MeshSequence *s, int i);
/* Which one bears the number, or NONE: there is no file; of a glTF, nothing is shown. */
int mesh_sequence_find(const MeshSequence *s, int64_t number);

/* The i-th mesh. On failure *mesh is empty. */
bool mesh_sequence_read(MeshSequence *s, int i, TriMesh *mesh, Err *err);
