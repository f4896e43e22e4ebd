/* speck.h: components under a voxel in extent. */
#pragma once
#include "topology/iso.h"

#define SPECK_VOX 1.0

/* A closed component of sphere topology that fits in a voxel's extent. */
bool speck_is(const IsoSurface *iso, int comp);
/* Appends a regular solid for each component wanted (all must be specks), with fresh identities. */
void speck_append(const IsoSurface *iso, const uint8_t *want, Mesh *mesh);
