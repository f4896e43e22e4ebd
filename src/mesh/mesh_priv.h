/* mesh_priv.h: shared inside the module. */
#pragma once
#include "mesh/mesh.h"

int mesh_add_vert(Mesh *m, Vec3 p, int32_t id);
/* Opposites are NONE, lengths unknown, no flags: the caller links. */
int mesh_add_tri(Mesh *m, int a, int b, int c);
