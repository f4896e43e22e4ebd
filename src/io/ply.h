/* ply.h: one frame's mesh as PLY.
 *
 * Written: binary_little_endian; vertex: float x y z nx ny nz, float vx vy vz where the velocity is known,
 * int id, then each attribute as a float under its name (characters that no PLY reader takes become '_', and
 * a name that is taken gets '_' behind it); face: list uchar int vertex_indices, int mechanical where the
 * parent is known. */
#pragma once
#include "mesh/trimesh.h"

/* Written under a temporary name, synced, renamed. The same mesh gives the same bytes on any machine. */
bool ply_write(const char *path, const TriMesh *mesh, Err *err);
/* Reads what ply_write writes, and any PLY with float or double x y z and triangle lists (or no faces:
 * points), ascii or binary little-endian. Missing columns: normal zero, id the index, velocity and parent
 * NULL. Other float or double columns of the vertices become attributes; everything else is skipped. What a
 * file claims is checked against its length before anything is allocated; code ERR_INPUT. On failure *mesh is
 * empty. */
bool ply_read(const char *path, TriMesh *mesh, Err *err);
