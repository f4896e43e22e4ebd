/* graft_priv.h: a graft under way: graft.c cuts the mesh into pieces, match.c and twist.c tell which of them the isosurface has, sew.c
 * puts patches in place of the others. */
#pragma once
#include "topology/graft.h"
#include "topology/sheet.h"

/* What a triangle of the mesh belongs to, if it is no piece (0, 1, ...): dropped; not looked at; to be part of a piece. */
enum { LABEL_HOLE = -1, LABEL_FAR = -2, LABEL_NEAR = -3 };

enum { SEAM_MAX = 24 }; /* sheet vertices on a seam */

typedef struct Seam {
    int half_edge, a, b;   /* of the mesh; its ends */
    int path, npath;       /* sheet vertices between the ends, in Graft.path; npath NONE: there was no way */
    bool live;             /* between what is kept and what is not, once matched */
} Seam;

/* Triangles that hang together, of the mesh or of the sheet. */
typedef struct Parts {
    int n;
    int32_t *of;           /* [ntri] */
    int32_t *euler2;       /* [n] twice the Euler characteristic */
} Parts;

/* Whose the regions of the sheet are. The holes count as one owner, and so does all that is not looked at. */
enum { NOBODY = -1, SEVERAL = -2 };
typedef struct Claims {
    int hole, far;         /* those owners; the others are pieces */
    int32_t *owner;        /* [regions] of all of its seams, NOBODY where it has none, or SEVERAL */
    uint8_t *open;         /* [regions] it runs into what is not looked at, or ends with the sheet */
    int32_t *region;       /* [owners] the one it owns, or NOBODY, SEVERAL */
} Claims;

typedef struct Graft {
    const IsoSurface *iso;
    const GraftPlan *plan;
    Mesh *mesh;
    uint8_t *drop;         /* [ntri] */
    uint8_t *near;         /* [ntri] looked at, in a component that does not match, though not all of that may be */
    uint8_t *whole;        /* [ncomp] no triangle of theirs is kept */
    uint8_t *checked;      /* [ncomp] every piece of their mesh is looked at: the others' are trusted outside the holes and what is near */
    int32_t *label;        /* [ntri] */
    int nlabel;
    int32_t *pinned;       /* [nvert] sheet vertex or NONE */
    Sheet sheet;
    Seam *seam;
    int nseam, capseam;
    int32_t *seam_of;      /* [3*ntri] of both half-edges, or NONE */
    int32_t *path;
    int npath, cappath;
    int32_t *edge;         /* [nedge] the sheet's half-edges on seams and at its rim, as last looked at */
    int nedge, capedge;
    Parts piece, region;   /* as last looked at: of the mesh and of the sheet */
    Claims claims;
    uint8_t *sound;        /* [pieces] as last looked at, and */
    uint8_t *patch;        /* [regions] to take the place of what is not kept */
    int nregion;           /* patches, once matched */
    int32_t *euler;        /* [nregion] as MendPatch says; given to the first of those that share holes */
} Graft;

/* --- match.c ----------------------------------------------------------------------------------------------------------- */

/* The seams cut the sheet into regions: finds them and whose they are. The others below go by what it found. */
void graft_look(Graft *g);
void graft_forget(Graft *g);
/* A piece is sound that is bordered as one region is and has its Euler characteristic. Sets label to LABEL_NEAR for the triangles of the
 * others that can be cut smaller. Are there any? */
bool graft_find_unsound(Graft *g);
/* Patches that run into what was not looked at, end with the sheet, or are not like the holes they close: beside[ntri] is set for the
 * triangles on both sides of the seams between these holes and what was not looked at. Are there any? */
bool graft_find_leaks(Graft *g, uint8_t *beside);
/* Is only a part of the component, which does not match, looked at? */
bool graft_looks_in_part(const Graft *g, int comp);
/* Of components looked at in part: farther[iso->ncell] is set where the sheet ends and what was looked at does not. Does it anywhere? */
bool graft_find_ends(const Graft *g, uint8_t *farther);
/* Sets checked for the components looked at in part that would not have their Euler characteristic with the patches. Are there any? */
bool graft_find_unbalanced(Graft *g);
/* Where what is kept of the mesh and the patches would not meet along a seam: of components looked at in part farther[iso->ncell] is set
 * there, others are looked at as a whole, or dropped if they were already. Is there any such? */
bool graft_find_torn(Graft *g, uint8_t *farther);
/* Is triangle t of the mesh kept, being trusted or part of a sound piece? */
bool graft_keeps(const Graft *g, int t);
/* Without leaks: sound pieces stay, and what the others, and the holes, stand for become the patches: drop is set for their
 * triangles, the sheet's regions are numbered, and the seams that are live lead along kept triangles, these to their left. */
void graft_take(Graft *g);

/* --- twist.c ----------------------------------------------------------------------------------------------------------- */

/* Where what is kept and the patches would meet along all seams but not around a vertex, around[ntri] is set for the triangles around
 * that. Is there any such? */
bool graft_find_twisted(const Graft *g, uint8_t *around);

/* --- sew.c ------------------------------------------------------------------------------------------------------------ */

/* Puts dropped vertices that lie soundly on the surface into the patches. Returns how many dropped ones are there now. */
int graft_pin_survivors(Graft *g);
/* Replaces the dropped triangles by the patches, and the kept ones at seams by fans over the seams' vertices. */
void graft_sew(Graft *g);
