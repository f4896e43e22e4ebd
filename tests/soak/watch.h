/* watch.h: drives the tracker through a sequence and holds every frame to what DESIGN promises.
 *
 * After each frame: the tracker reports no wrong component; both meshes are closed, manifold and outward-facing; their
 * components are those of the grid's isosurface, one to one, with the same Euler characteristic; identities are unique
 * and none comes back once it has vanished. The counts are made here anew from the meshes as files take them. */
#pragma once
#include "track/track.h"

/* When each identity was last there. */
typedef struct Seen {
    int32_t *frame; /* [cap] 0: never */
    int cap;
} Seen;

typedef struct Watch {
    Track *tr;
    Field field[2];    /* the last one lives until the next frame is done, */
    Grid velocity[2];  /* as does its velocity */
    int frames;
    Seen seen[2];      /* of the mechanical and the geometric mesh */
    TriMesh mesh[2];
    FrameStat stat;    /* of the last frame */
    char wrong[500];   /* what is wrong with the last frame: one sentence */
    /* over all frames */
    uint64_t hash;     /* of both meshes */
    int events;        /* frames whose components or Euler characteristic are not the last one's */
    int last[2];
    int64_t triangles[2], remade_components, raw_components, replaced_vertices, components, inverted_left[2], degenerate[2];
    double ids_kept;   /* sum over the frames but the first */
} Watch;

void watch_open(Watch *w, const TrackSettings *set);
void watch_close(Watch *w);
/* Tracks a frame of a level set, negative inside; the grids are given up. `velocity` may be NULL. False when anything is wrong. */
bool watch_frame(Watch *w, Grid *g, Grid *velocity);
