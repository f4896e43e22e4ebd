/* nvdb_priv.h: a NanoVDB file in two steps: nvdb.c finds and unpacks its grids, nvdb.cpp, which knows NanoVDB's structs,
 * walks through one.
 *
 * NanoVDB's own reader trusts every offset in a file, as its grids are meant to be used where they lie. Here each one is
 * held to the buffer, and the nodes that are met cannot be more than the buffer has room for: where two ways lead to
 * one node, a small file could be a huge grid. */
#pragma once
#include "io/io_priv.h"

enum { NVDB_ALIGNMENT = 32 };

typedef struct NvdbGrid {
    const char *path, *name; /* for messages */
    const uint8_t *data;     /* aligned to NVDB_ALIGNMENT */
    size_t size;
    uint32_t type;           /* what the file's list of grids says it is */
} NvdbGrid;

#ifdef __cplusplus
extern "C" {
#endif
/* A type's name, its components (0: not read here). */
const char *nvdb_type_name(uint32_t type, int *ncomp);
/* "level set", "fog volume", "staggered" or "". */
const char *nvdb_class_name(uint32_t grid_class);
/* Checks and copies into an empty grid. */
bool nvdb_decode(const NvdbGrid *g, Grid *out, Err *err);
/* The files' mark, and the version of the library's layout; files of another cannot be read. */
uint64_t nvdb_magic(void);
uint32_t nvdb_major(void);
#ifdef __cplusplus
}
#endif
