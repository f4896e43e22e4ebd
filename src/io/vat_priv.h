/* vat_priv.h: vat.c gathers a run's blocks; vat_file.c makes its files of them, and the .json of all runs. */
#pragma once
#include "io/file.h"
#include "io/vat.h"

typedef struct VatRun {
    int first, frames;          /* counted from 0 at the sequence's first frame, with skipped ones */
    int carried;                /* 1: one more block than frames */
    int nvert, ntri;
    int width, rows;            /* of the textures; rows of a block */
    float lo[3], hi[3];         /* of all blocks' positions */
    char label[32];             /* of the first frame */
} VatRun;

/* A block is [3 * nvert] offsets and [3 * nvert] normals, as this machine has floats. */
enum { VAT_POSITION, VAT_NORMAL, VAT_TEXTURES };

struct Vat {
    char *prefix, *name;
    double fps;
    int side;
    OutFile stream[2];
    int slot;                   /* of the open run's stream */
    bool open;                  /* the last run takes frames */
    int frame;                  /* the last one given; -1 before the first */
    TriMesh base;               /* of the last run; a copy */
    float *block;               /* being made */
    VatRun *run;                /* [nrun] */
    int nrun, cap;
    Err broken;                 /* code ERR_NONE while nothing failed */
};

static inline int vat_blocks(const VatRun *r) { return r->frames + r->carried; }

/* Textures and base mesh of the last run, from its stream, which stays. */
bool vat_write_run(Vat *v, Err *err);
bool vat_write_json(Vat *v, Err *err);
