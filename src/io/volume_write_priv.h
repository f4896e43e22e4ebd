/* volume_write_priv.h: the writers of volume_write.c's table. */
#pragma once
#include "field/grid.h"
#include "io/file.h"

/* The file is open and empty; its caller commits or gives it up. */
typedef bool WriteVolumeFn(OutFile *f, const Grid *g, Err *err);
WriteVolumeFn npy_write, exr_write;
#ifdef __cplusplus
extern "C"
#endif
bool vdb_write(OutFile *f, const Grid *g, Err *err);

/* Samples lo ... hi of row y, z along x. */
void volume_row(const Grid *g, int y, int z, float *out);
