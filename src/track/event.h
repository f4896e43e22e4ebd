/* event.h: what became of the surface's components from one frame to the next.
 *
 * Components are those of the mechanical mesh. A component's number is the least vertex identity in it: the numbers after
 * one frame are those before the next, and mostly stay what they are. Two components are linked when vertices of the one
 * are in the other; small ones that were drawn anew are linked by their place, or by what they enclose (lineage.c). */
#pragma once
#include "base/store.h"
#include "base/vec.h"

typedef enum EventKind {
    EVENT_BLEND,      /* several components before, one after; count: joints, one less than there were components */
    EVENT_SPLIT,      /* one before, several after; count: likewise */
    EVENT_BIRTH,      /* none before */
    EVENT_DEATH,      /* none after */
    EVENT_HOLE_OPEN,  /* the total genus of components linked with each other went up; count: by how many */
    EVENT_HOLE_CLOSE, /* or down */
    EVENT_MEND,       /* patches were sewn into a component whose topology stayed; count: patches */
    EVENT_KINDS
} EventKind;

/* Indices are into the lists of FrameEvents. */
typedef struct FrameEvent {
    EventKind kind;
    int count;
    int replaced;         /* new vertices of the patches at its places, before coarsening; birth, death: all of the component's */
    int before, nbefore;  /* in number[]: the components concerned, rising */
    int after, nafter;
    int place, nplace;    /* in place[], world units; at least one. Blend, split: one a joint; holes: at most one each */
} FrameEvent;

typedef struct FrameEvents {
    bool first;           /* nothing was tracked before: there is nothing to compare with, and no event */
    int nbefore, nafter;
    int32_t *before;      /* [nbefore] numbers of last frame's components, rising */
    int32_t *after;       /* [nafter] and of this frame's */
    int nlink;
    int32_t (*link)[2];   /* [nlink] numbers before and after, rising */
    int nevent, capevent;
    FrameEvent *event;    /* [nevent] by kind, then by number */
    int nnumber, capnumber;
    int32_t *number;
    int nplace, capplace;
    Vec3 *place;
} FrameEvents;

void events_free(FrameEvents *e);
/* Into a store, or out of it into one that is zero: its indices are sound, or the store is bad. */
void events_store(FrameEvents *e, Store *s);

/* As files have it: "blend", "hole-open"... */
const char *event_kind_name(EventKind kind);
