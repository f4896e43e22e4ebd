/* lineage_priv.h: components before a frame and after it, and which come from which. */
#pragma once
#include "track/track_priv.h"

typedef struct Lineage {
    const Bodies *before, *after;
    int nlink, caplink;
    BodyLink *link;       /* [nlink] by before, then after */
    int32_t *nafter;      /* [before->n] links of each */
    int32_t *nbefore;     /* [after->n] */
} Lineage;

/* Links the components of last frame's mesh with those of this frame's. Both are borrowed. */
void lineage_find(Lineage *l, const Track *tr, const Bodies *before, const Bodies *after);
void lineage_free(Lineage *l);
/* Where a point of this frame was in the last one, by the velocity. */
Vec3 lineage_go_back(const Track *tr, Vec3 p);
/* The distance from p to the nearest vertex of a body, which is put in *place; or `most`, if it is not below. */
double body_nearest(const Bodies *b, int k, Vec3 p, double most, Vec3 *place);
double body_distance(const Bodies *b, int k, Vec3 p, double most);
static inline int body_size(const Bodies *b, int k) { return b->body[k].end - b->body[k].start; }
static inline int body_genus(const Bodies *b, int k) { return 1 - b->body[k].euler / 2; }
