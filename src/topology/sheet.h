/* sheet.h: a part of the frame's exact isosurface that patches for the mesh are cut from.
 *
 * The reference triangles of some cells, with rims where those end. Mesh vertices are *pinned*: put into the sheet where they
 * lie. *Seams* are traced between them along the sheet's edges and cut it into regions (match.c), some of which become
 * *patches*. Every step subdivides the sheet and nothing else, so a region has the topology of the piece of isosurface it
 * stands for, whatever happens. */
#pragma once
#include "topology/iso.h"

enum { SEAM_NONE = NONE, PIN_NONE = NONE, PIN_SEAM = -2 };
enum { REGION_NONE = NONE };

typedef struct Sheet {
    const IsoSurface *iso;
    int nvert, capvert, ntri, captri;
    int nbuilt;       /* vertices at first; the others were put into triangles and on edges */
    Vec3 *pos;        /* [nvert] world units */
    int32_t *home;    /* [nvert] component */
    int32_t *pin;     /* [nvert] mesh vertex, PIN_NONE, or PIN_SEAM: inside a seam */
    int32_t *out;     /* [nvert] a half-edge that leaves it: the first in the umbrella where that is open */
    int32_t *corner;  /* [3*ntri] */
    int32_t *opp;     /* [3*ntri]; NONE at the rim */
    int32_t *seam;    /* [3*ntri] SEAM_NONE, 2 s: the left of seam s, 2 s + 1: its right */
    int32_t *region;  /* [ntri] patch region or REGION_NONE */
    int32_t *cell;    /* [ntri] the crossed cell it lies in */
    int32_t *next;    /* [ntri] the next triangle in the same cell, or NONE */
    int32_t *first;   /* [iso->ncell] */
} Sheet;

/* The sheet of the components and cells wanted (iso_triangles). */
void sheet_build(Sheet *s, const IsoSurface *iso, const uint8_t *want_comp, const uint8_t *want_cell);
void sheet_free(Sheet *s);

/* The half-edge leaving v after h, clockwise from out[v]; NONE at the rim or once around. */
int sheet_around(const Sheet *s, int v, int h);

/* Puts mesh vertex `pin` into the sheet at p, where the nearest triangle of component `comp` whose side agrees with the normal n
 * is within `reach`: takes over a vertex there or subdivides. `patches_only`: only into a patch's triangles;
 * `apart`: not nearer than this to another pinned vertex. Returns the sheet's vertex, or NONE. */
int sheet_pin(Sheet *s, int pin, Vec3 p, Vec3 n, int comp, double reach, double apart, bool patches_only);

/* Traces seam number `seam` from vertex a to vertex b: straight on, cutting the edges in its way. path[cap] gets the vertices between
 * them. Returns how many, or NONE where another seam is in the way: what is bordered by such seams is made anew. */
int sheet_trace(Sheet *s, int seam, int a, int b, int cap, int32_t *path);

/* Splits the edges inside patches whose ends are both pinned or on seams: the mesh may have such an edge already. */
void sheet_split_chords(Sheet *s);
