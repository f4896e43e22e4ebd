/* page.h: what a run left behind, as one page of HTML that needs nothing but a browser.
 *
 * The page is page.html with its slots filled: the lines of PREFIX.report.jsonl and its neighbours as JSON, the animated
 * glTFs as gzip in base64 (or their names, or why they are not there), our scripts, and the viewer, which holds three.js. The
 * same input gives the same bytes. Lines are checked; none can end the script that it stands in. */
#pragma once
#include "base/base.h"

typedef struct PageMesh {
    const char *kind;      /* "mechanical", "geometric" */
    const char *path;      /* NULL: not in the page */
    const char *link;      /* a name in the page's own folder, instead of path; NULL: none */
    const char *missing;   /* why it has neither, for the reader of the page */
} PageMesh;

enum { PAGE_MESHES = 2 };
typedef struct Page {
    const char *title;
    const char *report;             /* path */
    const char *events, *timings;   /* paths; NULL: there is none */
    PageMesh mesh[PAGE_MESHES];
} Page;

/* Whether this build holds the viewer. */
bool page_has_viewer(void);
/* Bytes that a file takes in the page, at most. */
uint64_t page_embedded_size(uint64_t bytes);
/* The sentence for what is wrong names the file and the line. */
bool page_write(const char *path, const Page *page, Err *err);
