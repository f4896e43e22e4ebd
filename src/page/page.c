#include "page/page_priv.h"

#include <string.h>

bool page_has_viewer(void) { return asset_viewer[0] != 0; }

/* Base64 makes 4 bytes of 3; gzip at worst adds a few in a thousand. */
uint64_t page_embedded_size(uint64_t bytes) { return bytes / 3 * 4 + bytes / 500 + 1000; }

static bool put(OutFile *f, const char *text, Err *err) { return outfile_write(f, text, strlen(text), err); }

/* Text of whatever bytes, as it may stand between tags and in quotes. */
static bool put_text(OutFile *f, const char *text, Err *err)
{
    for (; *text; text++) {
        const char *as = *text == '&' ? "&amp;" : *text == '<' ? "&lt;" : *text == '>' ? "&gt;" : *text == '"' ? "&quot;" : NULL;
        if (as ? !put(f, as, err) : !outfile_write(f, text, 1, err)) return false;
    }
    return true;
}

static bool put_lines(OutFile *f, const char *path, LineKind kind, Err *err)
{
    return path ? lines_embed(f, path, kind, err) : put(f, "[]", err);
}

/* An empty script that says in an attribute where the mesh is, or why it is not there. */
static bool put_absent(OutFile *f, const PageMesh *m, Err *err)
{
    return put(f, "<script type=\"text/plain\" data-mesh=\"", err) && put(f, m->kind, err) &&
           put(f, m->link ? "\" data-link=\"" : "\" data-missing=\"", err) && put_text(f, m->link ? m->link : m->missing, err) &&
           put(f, "\"></script>\n", err);
}

static bool put_meshes(OutFile *f, const Page *page, Err *err)
{
    for (int i = 0; i < PAGE_MESHES; i++) {
        const PageMesh *m = &page->mesh[i];
        if (m->path && !m->link ? !mesh_embed(f, m->path, m->kind, err) : !put_absent(f, m, err)) return false;
    }
    return true;
}

typedef enum Slot { SLOT_TITLE, SLOT_STYLE, SLOT_REPORT, SLOT_EVENTS, SLOT_TIMINGS, SLOT_MESHES, SLOT_VIEWER, SLOT_SCRIPT, SLOT_COUNT } Slot;
static const char *const slot_name[SLOT_COUNT] = {"title", "style", "report", "events", "timings", "meshes", "viewer", "script"};

static Slot slot_of(const char *name, size_t n)
{
    int slot = 0;
    while (slot < SLOT_COUNT && (strlen(slot_name[slot]) != n || memcmp(slot_name[slot], name, n) != 0)) slot++;
    ASSERT(slot < SLOT_COUNT);
    return (Slot)slot;
}

static bool put_slot(OutFile *f, Slot slot, const Page *page, Err *err)
{
    switch (slot) {
    case SLOT_TITLE: return put_text(f, page->title, err);
    case SLOT_STYLE: return put(f, asset_css, err);
    case SLOT_REPORT: return put_lines(f, page->report, LINES_REPORT, err);
    case SLOT_EVENTS: return put_lines(f, page->events, LINES_EVENTS, err);
    case SLOT_TIMINGS: return put_lines(f, page->timings, LINES_TIMINGS, err);
    case SLOT_MESHES: return put_meshes(f, page, err);
    case SLOT_VIEWER: return put(f, asset_viewer, err);
    case SLOT_SCRIPT: return put(f, asset_script, err);
    case SLOT_COUNT: break;
    }
    return false;
}

static bool fill(OutFile *f, const Page *page, Err *err)
{
    const char *at = asset_html;
    for (const char *open; (open = strstr(at, "{{")) != NULL;) {
        const char *close = strstr(open, "}}");
        ASSERT(close);
        if (!outfile_write(f, at, (size_t)(open - at), err) || !put_slot(f, slot_of(open + 2, (size_t)(close - open - 2)), page, err)) return false;
        at = close + 2;
    }
    return put(f, at, err);
}

bool page_write(const char *path, const Page *page, Err *err)
{
    OutFile f;
    if (!outfile_open(&f, path, err)) return false;
    if (fill(&f, page, err)) return outfile_commit(&f, err);
    outfile_abort(&f);
    return false;
}
