/* choose.c: which of a file's grids are meant, the same for all formats. */
#include "io/io_priv.h"

#include <string.h>

/* "phi, density" or "none": the grids of so many components, as many as fit; 0: all that can be read. */
static void list_grids(const VolumeFile *f, int ncomp, char *to, size_t size)
{
    size_t n = 0;
    snprintf(to, size, "none");
    for (int i = 0; i < f->nentry; i++) {
        int have = f->entry[i].ncomp;
        if (have == 0 || (ncomp && have != ncomp)) continue;
        int more = snprintf(to + n, size - n, "%s%s", n ? ", " : "", f->entry[i].name);
        if (more < 0 || (size_t)more >= size - n) {
            snprintf(to + size - 4, 4, "...");
            return;
        }
        n += (size_t)more;
    }
}

static bool is_nameless(const VolumeFile *f) { return f->nentry == 1 && f->entry[0].name[0] == 0; }

static int choose_by_itself(const VolumeFile *f)
{
    static const char *const names[] = {"surface", "phi", "sdf", "density"};
    int only = NONE, nscalar = 0;
    for (int i = 0; i < f->nentry; i++)
        if (f->entry[i].ncomp == 1) {
            only = i;
            nscalar++;
        }
    if (nscalar == 1) return only;
    for (int k = 0; k < 4; k++) {
        int i = volume_find(f, names[k]);
        if (i != NONE && f->entry[i].ncomp == 1) return i;
    }
    return NONE;
}

int volume_choose(const VolumeFile *f, Err *err)
{
    const char *name = f->request->grid, *path = f->path;
    char have[600];
    if (name && is_nameless(f)) {
        fail(err, ERR_USAGE, "%s: holds one grid without a name; leave out --grid", path);
        return NONE;
    }
    list_grids(f, 1, have, sizeof have);
    int i = name ? volume_find(f, name) : choose_by_itself(f);
    if (i != NONE && f->entry[i].ncomp == 1) return i;
    if (i != NONE)
        fail(err, ERR_INPUT, "%s: grid '%.100s' is of type %s, not of real numbers; scalar grids: %s", path, name, f->entry[i].type, have);
    else if (name)
        fail(err, ERR_INPUT, "%s: there is no grid '%.100s'; scalar grids: %s", path, name, have);
    else if (strcmp(have, "none") == 0)
        fail(err, ERR_INPUT, "%s: holds no scalar grid of real numbers; name a file that does", path);
    else
        fail(err, ERR_INPUT, "%s: holds several scalar grids; choose one with --grid: %s", path, have);
    return NONE;
}

/* Three scalars NAMEx NAMEy NAMEz, or with _ or . between: their places, or false. */
static bool find_triple(const VolumeFile *f, const char *name, int at[3])
{
    static const char *const between[] = {"", "_", "."};
    for (int b = 0; b < 3; b++) {
        int found = 0;
        for (int k = 0; k < 3; k++) {
            char part[300];
            snprintf(part, sizeof part, "%.250s%s%c", name, between[b], "xyz"[k]);
            at[k] = volume_find(f, part);
            found += at[k] != NONE && f->entry[at[k]].ncomp == 1;
        }
        if (found == 3) return true;
    }
    return false;
}

static bool is_staggered(const VolumeFile *f, int i) { return strcmp(f->entry[i].grid_class, "staggered") == 0; }

static bool read_vector(VolumeFile *f, int i, Grid *out, Err *err)
{
    if (!volume_load(f, i, out, err)) return false;
    out->staggered |= is_staggered(f, i);
    return true;
}

static bool read_triple(VolumeFile *f, const char *name, const int at[3], Grid *out, Err *err)
{
    Grid part[3];
    bool ok = true, staggered = false;
    for (int k = 0; k < 3; k++) grid_init(&part[k], 1);
    for (int k = 0; k < 3 && ok; k++) {
        ok = volume_load(f, at[k], &part[k], err);
        staggered |= is_staggered(f, at[k]);
    }
    if (ok && !volume_join(part, staggered, out))
        ok = fail(err, ERR_INPUT, "%s: the components of vector '%s' have different transforms; resample them to one", f->path, name);
    for (int k = 0; k < 3; k++) grid_free(&part[k]);
    return ok;
}

bool volume_read_velocity(VolumeFile *f, const char *name, Grid *out, Err *err)
{
    char have[600];
    int at[3], i = volume_find(f, name);
    if (i != NONE && f->entry[i].ncomp == 3) return read_vector(f, i, out, err);
    if (find_triple(f, name, at)) return read_triple(f, name, at, out, err);
    if (is_nameless(f))
        return fail(err, ERR_USAGE, "%s: holds one grid without a name; leave out --velocity", f->path);
    list_grids(f, 3, have, sizeof have);
    return fail(err, ERR_INPUT, "%s: there is no vector grid '%.100s' (nor %.100s_x, _y, _z); vector grids: %s", f->path,
                name, name, have);
}

bool volume_read_attribute(VolumeFile *f, const char *name, Grid *out, Err *err)
{
    char have[600];
    int at[3], i = volume_find(f, name);
    bool ok;
    if (i != NONE && f->entry[i].ncomp) {
        grid_init(out, f->entry[i].ncomp);
        ok = out->ncomp == 3 ? read_vector(f, i, out, err) : volume_load(f, i, out, err);
    } else if (find_triple(f, name, at)) {
        grid_init(out, 3);
        ok = read_triple(f, name, at, out, err);
    } else if (is_nameless(f)) {
        return fail(err, ERR_USAGE, "%s: holds one grid without a name; leave out --attribute", f->path);
    } else {
        list_grids(f, 0, have, sizeof have);
        return fail(err, ERR_INPUT, "%s: there is no grid '%.100s' for --attribute; grids: %s", f->path, name, have);
    }
    if (!ok) grid_free(out);
    return ok;
}
