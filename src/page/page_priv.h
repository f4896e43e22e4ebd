/* page_priv.h: the parts of a page. */
#pragma once
#include "io/file.h"
#include "page/page.h"

/* What the build put into the program, ending in a zero byte. */
extern const char asset_html[], asset_css[], asset_script[], asset_viewer[];

typedef enum LineKind { LINES_REPORT, LINES_EVENTS, LINES_TIMINGS } LineKind;

/* The lines of a file as one JSON array, without a `<`: a script of HTML can hold it. */
bool lines_embed(OutFile *f, const char *path, LineKind kind, Err *err);
/* A file, compressed, in scripts of type text/plain that bear data-mesh=KIND. */
bool mesh_embed(OutFile *f, const char *path, const char *kind, Err *err);
