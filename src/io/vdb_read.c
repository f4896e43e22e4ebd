#include "io/vdb_priv.h"

#include <string.h>

static bool is_scalar(VdbType kind) { return kind == VDB_FLOAT || kind == VDB_DOUBLE; }
static bool is_vector(VdbType kind) { return kind == VDB_VEC3S || kind == VDB_VEC3D; }

/* "phi, density" or "none": the grids of a kind, as many as fit. */
static void list_grids(const VdbToc *toc, bool (*wanted)(VdbType), char *to, size_t size)
{
    size_t n = 0;
    snprintf(to, size, "none");
    for (int i = 0; i < toc->nentry; i++) {
        if (!wanted(toc->entry[i].kind)) continue;
        int more = snprintf(to + n, size - n, "%s%s", n ? ", " : "", toc->entry[i].name);
        if (more < 0 || (size_t)more >= size - n) {
            snprintf(to + size - 4, 4, "...");
            return;
        }
        n += (size_t)more;
    }
}

static int choose_by_itself(const VdbToc *toc)
{
    static const char *const names[] = {"surface", "phi", "sdf", "density"};
    int only = NONE, nscalar = 0;
    for (int i = 0; i < toc->nentry; i++)
        if (is_scalar(toc->entry[i].kind)) {
            only = i;
            nscalar++;
        }
    if (nscalar == 1) return only;
    for (int k = 0; k < 4; k++) {
        int i = vdb_toc_find(toc, names[k]);
        if (i != NONE && is_scalar(toc->entry[i].kind)) return i;
    }
    return NONE;
}

/* The surface's grid, or NONE with a sentence. */
static int choose_grid(const VdbToc *toc, const char *name, Err *err)
{
    char have[600];
    const char *path = toc->in.path;
    list_grids(toc, is_scalar, have, sizeof have);
    int i = name ? vdb_toc_find(toc, name) : choose_by_itself(toc);
    if (i != NONE && is_scalar(toc->entry[i].kind)) return i;
    if (i != NONE)
        fail(err, ERR_INPUT, "%s: grid '%.100s' is of type %s, not float or double; scalar grids: %s", path, name,
             toc->entry[i].type, have);
    else if (name)
        fail(err, ERR_INPUT, "%s: there is no grid '%.100s'; scalar grids: %s", path, name, have);
    else if (strcmp(have, "none") == 0)
        fail(err, ERR_INPUT, "%s: holds no float or double grid", path);
    else
        fail(err, ERR_INPUT, "%s: holds several scalar grids; choose one with --grid: %s", path, have);
    return NONE;
}

/* Reads grid i into an empty grid of its number of components; an instance takes its parent's tree. */
static bool read_grid(VdbToc *toc, int i, Grid *out, char grid_class[32], Err *err)
{
    VdbEntry *e = &toc->entry[i];
    VdbTree t, parent = {0};
    if (!vdb_tree_load(toc, i, &t, err)) return false;
    out->xform = t.xform;
    snprintf(grid_class, 32, "%s", t.grid_class);
    bool ok = true;
    if (e->parent[0]) {
        int from = vdb_toc_find(toc, e->parent);
        if (from == NONE || toc->entry[from].parent[0] || toc->entry[from].kind != e->kind)
            ok = fail(err, ERR_INPUT, "%s: grid '%s' shares the tree of '%s', which is not there", toc->in.path, e->name, e->parent);
        ok = ok && vdb_tree_load(toc, from, &parent, err) && vdb_decode(&parent, out, err);
        vdb_tree_free(&parent);
    } else {
        ok = vdb_decode(&t, out, err);
    }
    vdb_tree_free(&t);
    return ok;
}

/* Three floats NAMEx NAMEy NAMEz, or with _ or . between: their places, or false. */
static bool find_triple(const VdbToc *toc, const char *name, int at[3])
{
    static const char *const between[] = {"", "_", "."};
    for (int b = 0; b < 3; b++) {
        int found = 0;
        for (int k = 0; k < 3; k++) {
            char part[300];
            snprintf(part, sizeof part, "%.250s%s%c", name, between[b], "xyz"[k]);
            at[k] = vdb_toc_find(toc, part);
            found += at[k] != NONE && is_scalar(toc->entry[at[k]].kind);
        }
        if (found == 3) return true;
    }
    return false;
}

static bool read_velocity(VdbToc *toc, const char *name, Grid *out, Err *err)
{
    char grid_class[32], have[600];
    int at[3], i = vdb_toc_find(toc, name);
    if (i != NONE && is_vector(toc->entry[i].kind)) {
        if (!read_grid(toc, i, out, grid_class, err)) return false;
        out->staggered = strcmp(grid_class, "staggered") == 0;
        return true;
    }
    if (!find_triple(toc, name, at)) {
        list_grids(toc, is_vector, have, sizeof have);
        return fail(err, ERR_INPUT, "%s: there is no vector grid '%.100s' (nor %.100s_x, _y, _z); vector grids: %s",
                    toc->in.path, name, name, have);
    }
    Grid part[3];
    bool ok = true, staggered = false;
    for (int k = 0; k < 3; k++) grid_init(&part[k], 1);
    for (int k = 0; k < 3 && ok; k++) {
        ok = read_grid(toc, at[k], &part[k], grid_class, err);
        staggered |= strcmp(grid_class, "staggered") == 0;
    }
    if (ok && !vdb_join_components(part, staggered, out))
        ok = fail(err, ERR_INPUT, "%s: the components of velocity '%.100s' have different transforms; resample them to one",
                  toc->in.path, name);
    for (int k = 0; k < 3; k++) grid_free(&part[k]);
    return ok;
}

bool vdb_read(const char *path, const VolumeRequest *request, Volume *out, Err *err)
{
    VdbToc toc;
    char grid_class[32];
    if (!vdb_toc_open(&toc, path, err)) return false;
    int i = choose_grid(&toc, request->grid, err);
    bool ok = i != NONE && read_grid(&toc, i, &out->surface, grid_class, err);
    if (ok) {
        snprintf(out->name, sizeof out->name, "%s", toc.entry[i].name);
        out->kind = strcmp(grid_class, "level set") == 0    ? VOLUME_LEVEL_SET
                    : strcmp(grid_class, "fog volume") == 0 ? VOLUME_DENSITY
                                                            : VOLUME_UNKNOWN;
        out->has_velocity = request->velocity != NULL;
    }
    if (ok && request->velocity) ok = read_velocity(&toc, request->velocity, &out->velocity, err);
    vdb_toc_close(&toc);
    return ok;
}
