/* refine_priv.h: one pass of refinement, and its steps in their order. */
#pragma once
#include "refine/refine.h"

#define HYSTERESIS 0.7        /* a marked edge stays marked above this share of a limit */
#define ANGLE_SHORTEST_VOX 0.9 /* edges below this are not cut for their normals' sake: the samples hold no finer detail, */
#define DEVIATION_SHORTEST_VOX 0.4 /* nor below this for the distance's */

enum { GRAIN = 1024, BATCH = 64 };

/* One pass's view of the mesh: its edges. */
typedef struct Pass {
    RefinedMesh *m;
    const Field *field;
    const Refine *memory;
    const Homes *homes;
    double cos_limit, cos_kept, dev_limit, dev_kept; /* for fresh marks, and for those of last frame */
    int number;             /* of the pass, from 0 */
    int nedge;
    int32_t (*ends)[2];     /* [nedge] */
    int32_t (*side)[2];     /* [nedge] the two triangles */
    int32_t *edge_of;       /* [3*ntri] */
    uint8_t *marked;        /* [nedge] */
    Vec3 *mid_pos, *mid_normal; /* [nedge] where a marked edge's midpoint lands */
    int32_t *mid;           /* [nedge] new vertex or NONE */
    Vec3 *tri_normal;       /* [ntri] */
    uint8_t *state;         /* [ntri] TRI_... */
} Pass;

enum { TRI_CHECK = 1, TRI_BAD = 2, TRI_OTHER_DIAGONAL = 4 };

/* The same edge in every frame, by the identities of its ends. */
static inline uint64_t key_of_edge(const RefinedMesh *m, int a, int b)
{
    return key_pair(int_min(m->id[a], m->id[b]), int_max(m->id[a], m->id[b]));
}

/* --- refined.c ------------------------------------------------------------------------------------------------------ */

typedef struct Tris {
    int n, cap;
    int32_t *tri, *parent;
} Tris;

/* The midpoint of vertices a and b. Returns its number. */
int refined_add_vert(RefinedMesh *m, Vec3 p, Vec3 n, int32_t id, int a, int b);
void refined_add_tri(Tris *t, int a, int b, int c, int parent);
void refined_copy(RefinedMesh *m, const Mesh *mech);

/* --- edges.c -------------------------------------------------------------------------------------------------------- */

void pass_find_edges(Pass *p);
void pass_free(Pass *p);

/* --- mark.c --------------------------------------------------------------------------------------------------------- */

/* The normals of all vertices. */
void pass_find_normals(Pass *p);
/* Marks what the criteria ask for. Returns how many edges. */
int pass_mark(Pass *p);

/* --- land.c --------------------------------------------------------------------------------------------------------- */

/* Marks whose midpoint finds no surface, another component's, or another sheet are taken back. */
void pass_land(Pass *p);

/* --- pieces.c ------------------------------------------------------------------------------------------------------- */

/* The edges of triangle t that are marked, as bits 1, 2, 4. */
int pass_marks_of(const Pass *p, int t);
/* The triangles that take a triangle's place: corners 0 1 2, midpoints 3 (of 0-1), 4 (of 1-2), 5 (of 2-0). Marks are bits
 * 1, 2, 4 of these edges; two marks leave a choice of diagonal. Returns how many. */
int pieces_pattern(int marks, bool other_diagonal, uint8_t out[4][3]);
/* Marks that would turn a piece against the surface are taken back, until no piece is worse than its whole. */
void pass_withdraw(Pass *p);

/* --- cut.c ---------------------------------------------------------------------------------------------------------- */

/* Cuts what is marked; `now` remembers it. Returns how many midpoints were added. */
int pass_cut(Pass *p, Refine *now, int32_t *next_id);
