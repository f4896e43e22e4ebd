/* change.h: what the papers' rules did to the mesh in a frame, in the order they did it. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef enum ChangeKind {
    CHANGE_BLEND,      /* two components became one */
    CHANGE_SPLIT,      /* one became two */
    CHANGE_BIRTH,      /* a component came out of nothing */
    CHANGE_DEATH,      /* a component vanished */
    CHANGE_HOLE_OPEN,  /* a component gained a handle: a sheet was pierced, or met itself */
    CHANGE_HOLE_CLOSE, /* it lost one */
    CHANGE_MEND,       /* the audit found something wrong, and it was made anew */
} ChangeKind;

typedef struct Change {
    ChangeKind kind;
    Vec3 place;       /* world units */
    int vertices;     /* mechanical vertices that went or came */
} Change;

typedef struct ChangeList {
    int n, cap;
    Change *change;     /* [n] in the order in which they were handled */
} ChangeList;

void change_add(ChangeList *list, ChangeKind kind, Vec3 place, int vertices);
/* As in the report. */
const char *change_name(ChangeKind kind);
