/* exr_priv.h: OpenEXR's C core as the writers use it. */
#pragma once
#include "io/file.h"

#include <OpenEXR/openexr.h>

/* Each piece of the file is handed back to us: what cannot be written is told as everywhere, by outfile_fail. */
bool exr_begin(exr_context_t *c, OutFile *f, Err *err);
