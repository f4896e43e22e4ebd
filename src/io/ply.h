/* ply.h: one frame's mesh as binary little-endian PLY (DESIGN section 5). */
#pragma once
#include "mesh/trimesh.h"

/* Written under a temporary name, synced, renamed. */
bool ply_write(const char *path, const TriMesh *mesh, Err *err);
/* Reads what ply_write writes, and any PLY with float or double x y z and triangle lists, ascii or binary little-endian. Missing columns: normal zero, id the index. */
bool ply_read(const char *path, TriMesh *mesh, Err *err);
