#include "io/ply.h"
#include "io/points_priv.h"

#include <math.h>
#include <string.h>
#include <strings.h>

static bool ends_in(const char *path, const char *ending)
{
    size_t n = strlen(path), e = strlen(ending);
    return n > e && strcasecmp(path + n - e, ending) == 0;
}

static bool ply_read_points(const char *path, PointSet *out, Err *err)
{
    TriMesh m;
    if (!ply_read(path, &m, err)) return false;
    out->n = m.nvert;
    out->place = NEW(Vec3, m.nvert);
    for (int v = 0; v < m.nvert; v++) out->place[v] = vec3((double)m.pos[3 * v], (double)m.pos[3 * v + 1], (double)m.pos[3 * v + 2]);
    for (int a = 0; a < m.nattr && !out->radius; a++) {
        if (strcmp(m.attr_name[a], "pscale") != 0 && strcmp(m.attr_name[a], "radius") != 0) continue;
        out->radius = NEW(float, m.nvert);
        memcpy(out->radius, m.attr[a], (size_t)m.nvert * sizeof(float));
    }
    trimesh_free(&m);
    return true;
}

static bool check(const char *path, const PointSet *p, Err *err)
{
    for (int i = 0; i < p->n; i++) {
        Vec3 x = p->place[i];
        if (!isfinite(x.x) || !isfinite(x.y) || !isfinite(x.z))
            return fail(err, ERR_INPUT, "%.800s: point %d lies at no finite place; repair the cache or leave the frame out", path, i);
        if (p->radius && !(p->radius[i] > 0 && isfinite(p->radius[i])))
            return fail(err, ERR_INPUT, "%.800s: point %d has a radius that is no number above 0; repair the cache or leave the frame out", path, i);
    }
    return true;
}

bool points_are_in(const char *path) { return ends_in(path, ".ply") || (ends_in(path, ".npy") && npy_holds_points(path)); }

bool points_read(const char *path, const char *grid, PointSet *out, Err *err)
{
    *out = (PointSet){0};
    bool ok = ends_in(path, ".ply")   ? ply_read_points(path, out, err)
              : ends_in(path, ".npy") ? npy_read_points(path, out, err)
              : ends_in(path, ".vdb") ? vdb_read_points(path, grid, out, err)
                                      : fail(err, ERR_USAGE, "%.800s: points are read from .ply, .npy and .vdb", path);
    ok = ok && check(path, out, err);
    if (!ok) points_free(out);
    return ok;
}

void points_free(PointSet *p)
{
    mem_free(p->place);
    mem_free(p->radius);
    *p = (PointSet){0};
}
