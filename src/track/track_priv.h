/* track_priv.h: the tracker's state, shared inside the module. */
#pragma once
#include "events/events.h"
#include "refine/refine.h"
#include "remesh/remesh.h"
#include "topology/mend.h"
#include "track/track.h"

/* A component of the mechanical mesh. */
typedef struct Body {
    int32_t number;         /* the least identity in it */
    int start, end;         /* its vertices in Bodies */
    int euler;
    double volume;          /* world units; negative: a cavity */
    Vec3 lo, hi, centre;    /* the mean of its vertices */
} Body;

/* The components of a mesh and their vertices, apart from the mesh. */
typedef struct Bodies {
    int n;
    Body *body;             /* [n] by number */
    int32_t *id;            /* of each vertex, body by body */
    Vec3 *pos;
} Bodies;

typedef struct BodyLink {
    int a, b;               /* before, after */
    int shared;             /* identities; 0: linked by place */
} BodyLink;

/* Where a point of the surface was at rest, and in which frame that was so (as counted by track_frame's `frames`). */
typedef struct RestPlace {
    Vec3 pos;
    int64_t frame;
} RestPlace;

typedef struct Rest {
    int64_t now;            /* this frame */
    int nvert, capat;
    RestPlace *at;          /* [nvert] of the mechanical mesh's vertices, between frames */
    int ncarried, ntri, capcarried, capid, capwas, capcorner;
    Vec3 *carried;          /* [ncarried] the mesh carried to this frame, before it was edited */
    int32_t *id;            /* [ncarried] */
    RestPlace *was;         /* [ncarried] */
    int32_t *corner;        /* [3*ntri] */
} Rest;

struct Track {
    TrackSettings set;
    double edge;            /* world units; 0 until the first frame with a surface */
    double rest_ratio;      /* e-hat / edge, adapted so that the mean edge is the one asked */
    Mesh mesh;              /* mechanical */
    float *unrest;          /* [mesh.nvert] how far the last step's forces wanted the vertex to go, in edges, and what its edges changed in
                             * length since; 1: not known */
    uint8_t *moved;         /* [mesh.nvert] by the field, or new, or an end of an edge that was changed, in this frame */
    uint8_t *frozen;        /* [mesh.nvert] 1: at rest under a field at rest: costs nothing in this frame */
    int capcolumn;
    int ncomp, capcomp;     /* its components, as last asked for */
    int32_t *comp;          /* [mesh.ntri] of each triangle */
    Mechanics mech;
    Refine refine;
    RefinedMesh fine;       /* geometric */
    int32_t next_midpoint;  /* identity */
    bool refined;           /* fine is of this frame already: the papers' rules need it */
    IsoSurface iso;         /* of this frame; zero once it is completed */
    Crossings crossings;    /* of the mechanical mesh when last asked: remembered work alone */
    MendStat mended;        /* in this frame */
    bool still;             /* the frame's surface is last frame's */
    FrameStat last;         /* figures of the last frame completed */
    bool begun;             /* a frame was tracked */
    Bodies bodies;          /* of the mesh after the last frame completed, */
    bool compared;          /* if there was one */
    FrameEvents events;     /* in this frame */
    const Field *field, *last_field;       /* borrowed */
    const Grid *velocity, *last_velocity;  /* borrowed; may be NULL */
    double span_s;          /* seconds between the two */
    Rest rest;
    Map before_at;          /* own_motion: identity in last frame's geometric mesh: place in before */
    Vec3 *before;
    int capbefore;
    ChangeList changes;     /* by the papers' rules in this frame */
};

/* Of the mechanical mesh, which must be compact, as it is now. */
void track_find_components(Track *tr);

/* --- predict.c ------------------------------------------------------------------------------------------------------ */

/* Where the velocity takes a point from last frame's time to this one's. */
Vec3 track_advect(const Track *tr, Vec3 p);
/* Carries n points from last frame's surface to this one's. Lost ones keep the place they were carried to, off the surface;
 * status as field_project's. Returns how many are lost; *substeps: fields blended in time, 0 when the velocity carried them. */
int track_predict(const Track *tr, int n, Vec3 *p, uint8_t *status, int *substeps);

/* --- relax.c -------------------------------------------------------------------------------------------------------- */

/* Step 0, 1... of a frame: a quasi-static step of the mechanical mesh, guarded and landed (GI'07 2.2 to 2.6). Not every step is for
 * all vertices: those that are calm sit most of them out. Returns which of them did, [mesh.nvert]; the caller frees it. */
uint8_t *track_relax(Track *tr, Remesh *r, int step, FrameStat *stat);

/* --- rest.c: where the settings want it ------------------------------------------------------------------------------- */

/* When the mesh was carried to this frame and not edited yet. */
void rest_carry(Track *tr);
/* When it will change no more. */
void rest_settle(Track *tr);
/* The mesh's vertices were renumbered between frames. */
void rest_sort(Rest *r, const int32_t *to);
/* What it holds between frames. */
void rest_copy(Rest *to, const Rest *from);
/* Of the geometric mesh's vertices. */
void rest_refined(const Track *tr, RestPlace *out);
void rest_free(Rest *r);

/* --- papers.c: leave dead vertices and triangles behind ----------------------------------------------------------------- */

/* Rounds of events in a frame at most. */
int track_papers_rounds(void);
/* One round of blends, or where there are none of splits, on the refined mesh. Returns how many. */
int track_papers_events(Track *tr);
/* What the mechanical mesh alone shows once it is carried to the frame: lost sheets that face each other. */
int track_papers_rejoin(Track *tr);
/* Components that have lost their surface go, components of the surface that have no mesh come. Return how many. */
int track_papers_deaths(Track *tr);
int track_papers_births(Track *tr, const IsoSurface *iso);
/* Components of a few vertices that lie on a surface which another component has: what is left of specks. On a compact mesh. */
int track_papers_leftovers(Track *tr, const IsoSurface *iso);

/* --- census.c: which identities survive ---------------------------------------------------------------------------- */

typedef struct Census {
    int n;
    int32_t *id;   /* [n] of each vertex before the frame */
} Census;

void census_take(Census *c, const Mesh *m);
/* The share of identities still there; NaN when there was none. */
double census_share_kept(const Census *c, const Mesh *m);
void census_free(Census *c);

/* --- lineage.c, event.c: what became of the components ------------------------------------------------------------- */

/* `m` must be compact; comp[m->ntri]: its triangles' components, ncomp of them. */
void bodies_take(Bodies *b, const Mesh *m, int ncomp, const int32_t *comp);
void bodies_free(Bodies *b);
/* Fills tr->events and the frame's counts; the mesh is as it will be written. */
void track_find_events(Track *tr, FrameStat *stat);
/* Of a frame in which nothing changed. */
void track_find_no_events(Track *tr);

/* --- motion.c ------------------------------------------------------------------------------------------------------- */

/* Before it is refined anew, where the settings want it: where the geometric mesh's vertices are. */
void track_remember_places(Track *tr);
/* World units a second of a vertex at p on the frame's surface. */
Vec3 track_motion(const Track *tr, int32_t id, Vec3 p, Vec3 normal);

/* --- measure.c ------------------------------------------------------------------------------------------------------- */

void track_measure(const Track *tr, FrameStat *stat);
double track_clock(void); /* seconds */
