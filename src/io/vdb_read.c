#include "io/vdb_priv.h"

#include <string.h>

typedef struct VdbFile {
    VolumeFile base;
    VdbToc toc;
} VdbFile;

static bool vdb_open(VolumeFile *f, Err *err)
{
    VdbToc *toc = &((VdbFile *)f)->toc;
    if (!vdb_toc_open(toc, f->path, err)) return false;
    for (int i = 0; i < toc->nentry; i++) {
        VdbType kind = toc->entry[i].kind;
        bool scalar = kind == VDB_FLOAT || kind == VDB_DOUBLE, vector = kind == VDB_VEC3S || kind == VDB_VEC3D;
        volume_add_entry(f, toc->entry[i].name, toc->entry[i].type, scalar ? 1 : vector ? 3 : 0);
    }
    return true;
}

/* An instance takes its parent's tree. */
static bool vdb_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    VdbToc *toc = &((VdbFile *)f)->toc;
    VdbEntry *e = &toc->entry[i];
    VdbTree t, parent = {0};
    if (!vdb_tree_load(toc, i, &t, err)) return false;
    out->xform = t.xform;
    snprintf(f->entry[i].grid_class, sizeof f->entry[i].grid_class, "%s", t.grid_class);
    bool ok = true;
    if (e->parent[0]) {
        int from = volume_find(f, e->parent);
        if (from == NONE || toc->entry[from].parent[0] || toc->entry[from].kind != e->kind)
            ok = fail(err, ERR_INPUT, "%s: grid '%s' shares the tree of '%s', which is not there", f->path, e->name, e->parent);
        ok = ok && vdb_tree_load(toc, from, &parent, err) && vdb_decode(&parent, out, err);
        vdb_tree_free(&parent);
    } else {
        ok = vdb_decode(&t, out, err);
    }
    vdb_tree_free(&t);
    return ok;
}

static void vdb_close(VolumeFile *f) { vdb_toc_close(&((VdbFile *)f)->toc); }

const Format VDB_FORMAT = {"OpenVDB", ".vdb", sizeof(VdbFile), vdb_open, vdb_read, vdb_close};
