/* refine_priv.h: one pass of refinement, and its steps in their order. */
#pragma once
#include "refine/refine.h"

#define HYSTERESIS 0.7        /* a marked edge stays marked above this share of a limit */
#define ANGLE_SHORTEST_VOX 0.9 /* edges below this are not cut for their normals' sake: the samples hold no finer detail, */
#define DEVIATION_SHORTEST_VOX 0.4 /* nor below this for the distance's */

enum { GRAIN = 1024, BATCH = 64 };

/* One pass's view of the mesh: its edges. What a pass found out about a triangle or an edge that it did not cut, the next one takes over. */
typedef struct Pass {
    RefinedMesh *m;
    const Field *field;
    const Refine *memory;
    const Homes *homes;
    const RefineSettings *set;
    double cos_limit, cos_kept, turn_limit, turn_kept, dev_limit, dev_kept; /* for fresh marks, and for those of last frame */
    int number;             /* of the pass, from 0 */
    const struct Pass *before; /* NULL: none */
    int nedge;
    int32_t (*ends)[2];     /* [nedge] */
    int32_t (*side)[2];     /* [nedge] the two triangles */
    int32_t *edge_of;       /* [3*ntri] */
    int32_t *from;          /* [nedge] the edge that it was in the pass before, or NONE */
    int32_t *was;           /* [nedge] its mark in the last frame, or NONE */
    uint8_t *self;          /* [nedge] by its own normals or midpoint it is to be cut */
    double *far_vox;        /* [nedge] its midpoint's distance from the surface; < 0: not measured */
    uint8_t *marked;        /* [nedge] */
    uint8_t *mid_state;     /* [nedge] MID_... */
    Vec3 *mid_pos, *mid_normal; /* [nedge] where a marked edge's midpoint lands, or lies flat */
    int32_t *mid;           /* [nedge] new vertex or NONE */
    Vec3 *tri_normal;       /* [ntri]; NULL by the Hessian */
    double (*turn)[2];      /* [nedge] of the normal, radians, in either triangle; NULL by normals */
    uint8_t *state;         /* [ntri] TRI_... */
    int32_t *kept_tri;      /* [ntri after the cut] the triangle it was before the cut, or NONE */
    int32_t *kept_side;     /* [3*ntri after the cut] the edge it was before, or NONE */
} Pass;

enum { MID_NONE, MID_LANDED, MID_LOST, MID_FLAT };
enum { TRI_CHECK = 1, TRI_BAD = 2, TRI_OTHER_DIAGONAL = 4 };

static inline Vec3 refined_centroid(const RefinedMesh *m, int t)
{
    const int32_t *c = m->tri + 3 * t;
    return v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
}

/* F and its gradient at the centroids of n triangles, BATCH at most, from number `first` on. */
static inline void sample_centroids(const RefinedMesh *m, const Field *f, int first, int n, double *F, Vec3 *grad)
{
    Vec3 at[BATCH];
    for (int i = 0; i < n; i++) at[i] = refined_centroid(m, first + i);
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

typedef struct Tris {
    int n, cap;
    int32_t *tri, *parent;
    uint8_t *green;
} Tris;

/* Returns its number. */
int refined_add_vert(RefinedMesh *m, Vec3 p, Vec3 n, int32_t id, const int32_t ends[2], bool flat);
void refined_add_tri(Tris *t, const int32_t corner[3], int parent, uint8_t green);
void refined_copy(RefinedMesh *m, const Mesh *mech);

/* --- edges.c -------------------------------------------------------------------------------------------------------- */

/* Takes over what the pass before knew. */
void pass_find_edges(Pass *p);
void pass_free(Pass *p);

/* --- mark.c --------------------------------------------------------------------------------------------------------- */

/* The normals of all vertices. */
void pass_find_normals(Pass *p);
/* Marks what the criteria ask for. Returns how many edges. */
int pass_mark(Pass *p);

/* --- hessian.c ------------------------------------------------------------------------------------------------------ */

/* Fills p->turn. */
void pass_find_turns(Pass *p);

/* --- land.c --------------------------------------------------------------------------------------------------------- */

/* Lands the midpoints of marked edges that have not landed yet. */
void pass_land(Pass *p);
/* Marks whose midpoint found no surface, or only another component's, or another sheet, are taken back. Returns how many stay. */
int pass_drop_lost(Pass *p);
/* Puts an edge's midpoint in its middle, where it changes nothing. */
void pass_flatten(Pass *p, int e);

/* --- whole.c -------------------------------------------------------------------------------------------------------- */

/* What is cut as one: a triangle, or the two halves of a green one. */
enum { WHOLE_POINTS = 8, PIECES_MAX = 6 };
typedef struct Whole {
    int first, ntri;            /* triangles */
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
/* The marked ones of its edges, as bits: 1 << point - 3. */
int whole_marks(const Pass *p, const Whole *w);
/* What takes its place; two marks leave a choice of diagonal. */
Pieces whole_pieces(const Pass *p, const Whole *w, int marks, bool other_diagonal);
/* Red-green: may it be cut by these marks? */
bool whole_is_closed(const Whole *w, int marks);

/* --- close.c -------------------------------------------------------------------------------------------------------- */

/* Red-green: adds the marks that red triangles need, with their midpoints. */
void pass_close(Pass *p);

/* --- withdraw.c ----------------------------------------------------------------------------------------------------- */

/* Marks that would turn a piece against the surface, or make it a needle, are taken back, until no piece is worse than its
 * whole. Red-green, where others hang on a mark, it stays, and its midpoint goes flat. */
void pass_withdraw(Pass *p);

/* --- cut.c ---------------------------------------------------------------------------------------------------------- */

/* Cuts what is marked; `now` remembers it. Returns how many midpoints were added. */
int pass_cut(Pass *p, Refine *now, int32_t *next_id);
