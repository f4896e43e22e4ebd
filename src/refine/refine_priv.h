/* refine_priv.h: one pass of refinement, and its steps in their order. */
#pragma once
#include "refine/refine.h"

#define HYSTERESIS 0.7        /* a marked edge stays marked above this share of a limit */
#define ANGLE_SHORTEST_VOX 0.9 /* edges below this are not cut for their normals' sake: the samples hold no finer detail, */
#define DEVIATION_SHORTEST_VOX 0.4 /* nor below this for the distance's */

enum { GRAIN = 1024, LIST_GRAIN = 256, BATCH = 64 };

/* What is known of an edge. */
typedef struct EdgeNote {
    uint8_t stirred[2];     /* the triangle on this side is another than when the edge was last looked at */
    uint8_t asked[2];       /* ASKS_...: the most that the other edges of the triangle on this side ask for */
    uint8_t kept;           /* the number of the pass from which on last frame's mark of it counts; KEPT_NEVER: it had none */
    uint8_t flags;          /* EDGE_... */
} EdgeNote;

enum {
    EDGE_FRESH = 1, /* not looked at yet */
    EDGE_SELF = 2,  /* by its own normals or midpoint it is to be cut */
    EDGE_LONG = 4,  /* long enough to be cut for its neighbours' normals */
};
enum { ASKS_NONE, ASKS_KEPT, ASKS_ALL }; /* the angle between two triangles' normals wants no edges, those marked before, any */
enum { KEPT_NEVER = 255 };
#define EDGE_UNKNOWN ((EdgeNote){{1, 1}, {0, 0}, KEPT_NEVER, EDGE_FRESH})

/* Where a midpoint lands, or lies flat. */
typedef struct Midpoint {
    Vec3 pos, normal;
} Midpoint;

/* The mesh on its way from pass to pass. Triangles and edges keep their numbers: of what is cut a piece takes the number over, and the
 * others come behind all. What a pass found out about a triangle or an edge holds until that is cut, so that the next one looks
 * only at what is new. */
typedef struct Pass {
    RefinedMesh *m;         /* gets vertices with every pass, triangles when all are done */
    const Field *field;
    const Refine *memory;
    const Homes *homes;
    const RefineSettings *set;
    double cos_limit, cos_kept, turn_limit, turn_kept, dev_limit, dev_kept; /* for fresh marks, and for those of last frame */
    int number;             /* of the pass, from 0 */
    int first_vert, first_id; /* vertices from both of these on are midpoints that the last frame did not have */

    int ntri, captri;
    int32_t *tri;           /* [3*ntri] */
    int32_t *edge_of;       /* [3*ntri] */
    int32_t *parent;        /* [ntri] */
    int32_t *after;         /* [ntri] the next piece of its mechanical triangle, whose number is that of its first; NONE: the last */
    uint32_t *way;          /* [ntri] WAY_BITS a pass from the highest down: which piece it became; goes up along `after` */
    uint8_t *green;         /* [ntri] 1, 2: the halves of a green triangle; else 0 */
    uint8_t *state;         /* [ntri] TRI_... */
    uint8_t *asks;          /* [3*ntri] ASKS_...: what the normals on both sides of this edge want of the other edges there */
    uint8_t *open;          /* [ntri] how many of its edges may be cut for their neighbours' normals, or more; NULL by the Hessian, */
    Vec3 *tri_normal;       /* [ntri] so too; at the centroid, where TRI_NORMAL */

    int nedge, capedge;
    int32_t (*half)[2];     /* [nedge] its half-edges, the one that leaves its lower vertex first */
    int32_t *was;           /* [nedge] its mark in the last frame, or NONE */
    EdgeNote *note;         /* [nedge] */
    uint8_t *marked;        /* [nedge] */
    uint8_t *mid_state;     /* [nedge] MID_... */
    int32_t *mid;           /* [nedge] the number of its midpoint, if it has a state; while it is cut the new vertex */
    double (*turn)[2];      /* [nedge] of the normal, radians, in either triangle; NULL by normals */

    int nmidpoint, capmidpoint;
    Midpoint *midpoint;     /* [nmidpoint] */
    int nlist, caplist;
    int32_t *list;          /* [nlist] the marked edges */
    int nwhole, capwhole;
    int32_t *whole;         /* [nwhole] the first triangles of the wholes beside them, */
    uint8_t *marks;         /* [nwhole] and their marks, as whole_marks tells them */
} Pass;

enum { PASSES_MAX = 8, WAY_BITS = 3 };
enum { MID_NONE, MID_LANDED, MID_LOST, MID_FLAT };
enum {
    TRI_NEW = 1,
    TRI_CHECK = 2, TRI_BAD = 4, TRI_OTHER_DIAGONAL = 8, /* of a whole's first */
    TRI_ASKS = 16, TRI_NORMAL = 32, TRI_LASTING = TRI_ASKS | TRI_NORMAL,
};

/* The vertex at the lower (0) or the higher (1) end of an edge. */
static inline int edge_end(const Pass *p, int e, int end) { return p->tri[p->half[e][end]]; }
static inline int edge_side(const Pass *p, int e, int s) { return p->half[e][s] / 3; }

/* Of the triangle with these corners. */
static inline Vec3 refined_centroid(const RefinedMesh *m, const int32_t *c)
{
    return v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
}

/* F and its gradient at the centroids of n triangles, BATCH at most, from number `first` on. */
static inline void sample_centroids(const RefinedMesh *m, const Field *f, int first, int n, double *F, Vec3 *grad)
{
    Vec3 at[BATCH];
    for (int i = 0; i < n; i++) at[i] = refined_centroid(m, m->tri + 3 * (first + i));
    field_sample(f, n, at, F, grad);
}

/* The distance from the surface to first order, in voxels. */
static inline double far_vox(const Field *f, double F, Vec3 grad)
{
    double l = v_len(grad);
    return l > 0 ? fabs(F) / l / f->voxel : 0;
}

/* --- refine.c ------------------------------------------------------------------------------------------------------- */

void refine_note(Refine *memory, RefineMark mark);
/* The number of an edge's mark by the identities of its ends, or NONE. */
static inline int refine_find(const Refine *memory, int a, int b) { return map_get(&memory->mark_at, key_pair(int_min(a, b), int_max(a, b))); }

/* --- refined.c ------------------------------------------------------------------------------------------------------ */

void refined_copy(RefinedMesh *m, const Mesh *mech);
void refined_reserve_verts(RefinedMesh *m, int nvert);
void refined_reserve_tris(RefinedMesh *m, int ntri);

/* --- edges.c -------------------------------------------------------------------------------------------------------- */

/* The mechanical mesh, which m is a copy of so far: all of it new. */
void pass_begin(Pass *p, const Mesh *mech);
/* Room for so many more; what comes new is not filled. */
void pass_reserve(Pass *p, int tris, int edges);
void pass_free(Pass *p);

/* --- mark.c --------------------------------------------------------------------------------------------------------- */

/* The normals of all vertices. */
void pass_find_normals(Pass *p);
/* Marks what the criteria ask for and lists it. Returns how many edges. */
int pass_mark(Pass *p);
void pass_list_marked(Pass *p);

/* --- hessian.c ------------------------------------------------------------------------------------------------------ */

/* p->turn of new triangles' edges. */
void pass_find_turns(Pass *p);

/* --- land.c --------------------------------------------------------------------------------------------------------- */

/* Lands the midpoints of listed edges that have not landed yet. */
void pass_land(Pass *p);
/* Listed marks whose midpoint found no surface, or only another component's, or another sheet, are taken back. Returns how many stay. */
int pass_drop_lost(Pass *p);
/* Puts an edge's midpoint in its middle, where it changes nothing. */
void pass_flatten(Pass *p, int e);

/* --- whole.c -------------------------------------------------------------------------------------------------------- */

/* What is cut as one: a triangle, or the two halves of a green one. */
enum { WHOLE_POINTS = 8, PIECES_MAX = 6 };
typedef struct Whole {
    int ntri;
    int32_t tri[2];             /* [ntri] */
    int32_t vert[WHOLE_POINTS];  /* corners 0 1 2, midpoints 3 (of 0-1), 4 (of 1-2), 5 (of 2-0); green: 3 is there already, 6 (of */
    int32_t edge[WHOLE_POINTS];  /* 0-3) and 7 (of 3-1) may come. One of the two is NONE: the vertex, or the edge that may get one */
} Whole;

typedef struct Pieces {
    int n;
    uint8_t corner[PIECES_MAX][3]; /* points of the whole */
    uint8_t green[PIECES_MAX];     /* as in RefinedMesh */
} Pieces;

/* The whole that triangle t belongs to. */
Whole whole_of(const Pass *p, int t);
/* Its first triangle. */
int whole_first(const Pass *p, int t);
/* The marked ones of its edges, as bits: 1 << point - 3. */
int whole_marks(const Pass *p, const Whole *w);
/* What takes its place; two marks leave a choice of diagonal. */
const Pieces *whole_pieces(const Pass *p, const Whole *w, int marks, bool other_diagonal);
/* Red-green: may it be cut by these marks? */
bool whole_is_closed(const Whole *w, int marks);

/* --- close.c -------------------------------------------------------------------------------------------------------- */

/* Red-green: adds the marks that red triangles need, with their midpoints, and lists them too. */
void pass_close(Pass *p);

/* --- withdraw.c ----------------------------------------------------------------------------------------------------- */

/* Finds the wholes. Marks that would turn a piece against the surface, or make it a needle, are taken back, until no piece is worse than its
 * whole. Red-green, where others hang on a mark, it stays, and its midpoint goes flat. */
void pass_withdraw(Pass *p);

/* --- cut.c ---------------------------------------------------------------------------------------------------------- */

/* Cuts the wholes; `now` remembers the marks. Returns how many midpoints were added. */
int pass_cut(Pass *p, Refine *now, int32_t *next_id);
/* The triangles in their order: pieces take their whole's place. */
void pass_finish(Pass *p);
