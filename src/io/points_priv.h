/* points_priv.h: the readers behind points_read. On failure *out is the caller's to free. */
#pragma once
#include "io/points.h"

bool npy_read_points(const char *path, PointSet *out, Err *err);
bool npy_holds_points(const char *path);
bool vdb_read_points(const char *path, const char *grid, PointSet *out, Err *err);
