#include "cli/info.h"
#include "io/gltf_info.h"
#include "io/ply.h"

#include <math.h>
#include <string.h>

/* --- PLY ---------------------------------------------------------------------------------------- */

struct PlyRuns {
    TriMesh last;
    char *first_path, *last_path; /* of the run at hand */
    int files, frames;
    json_t *run;
};

PlyRuns *plyruns_make(void)
{
    PlyRuns *r = NEW0(PlyRuns, 1);
    r->run = json_array();
    return r;
}

static void end_run(PlyRuns *r)
{
    if (!r->frames) return;
    json_array_append_new(r->run, json_pack("{s:i,s:o,s:o}", "frames", r->frames, "first", info_text(r->first_path), "last", info_text(r->last_path)));
    r->frames = 0;
}

/* Takes over the mesh. */
static void add_frame(PlyRuns *r, const char *path, TriMesh *mesh)
{
    if (r->frames && !trimesh_is_same_run(&r->last, mesh)) end_run(r);
    if (r->frames++ == 0) {
        mem_free(r->first_path);
        r->first_path = mem_text(path);
    }
    mem_free(r->last_path);
    r->last_path = mem_text(path);
    r->files++;
    trimesh_free(&r->last);
    r->last = *mesh;
}

json_t *plyruns_end(PlyRuns *r)
{
    end_run(r);
    json_t *out = r->files > 1 ? json_pack("{s:i,s:O}", "frames", r->files, "runs", r->run) : NULL;
    json_decref(r->run);
    trimesh_free(&r->last);
    mem_free(r->first_path);
    mem_free(r->last_path);
    mem_free(r);
    return out;
}

static json_t *attribute_names(const TriMesh *m)
{
    json_t *names = json_array();
    if (m->velocity) json_array_append_new(names, json_string("velocity"));
    if (m->parent) json_array_append_new(names, json_string("mechanical"));
    for (int a = 0; a < m->nattr; a++) json_array_append_new(names, info_text(m->attr_name[a]));
    return names;
}

json_t *info_ply(const char *path, PlyRuns *runs, Err *err)
{
    TriMesh m;
    if (!ply_read(path, &m, err)) return NULL;
    double lo[3] = {NAN, NAN, NAN}, hi[3] = {NAN, NAN, NAN};
    for (size_t i = 0; i < 3 * (size_t)m.nvert; i++) {
        lo[i % 3] = fmin(lo[i % 3], (double)m.pos[i]);
        hi[i % 3] = fmax(hi[i % 3], (double)m.pos[i]);
    }
    json_t *o = json_pack("{s:o,s:s,s:i,s:i,s:{s:o,s:o},s:o}", "file", info_text(path), "format", "PLY", "vertices", m.nvert, "triangles", m.ntri,
                          "bounds", "from", info_reals(3, lo), "to", info_reals(3, hi), "attributes", attribute_names(&m));
    add_frame(runs, path, &m);
    return o;
}

/* --- glTF --------------------------------------------------------------------------------------- */

/* A JSON array of the words of a text, which is cut up. */
static json_t *words(char *text)
{
    char *save;
    json_t *array = json_array();
    for (char *word = strtok_r(text, " ", &save); word; word = strtok_r(NULL, " ", &save)) json_array_append_new(array, info_text(word));
    return array;
}

json_t *info_gltf(const char *path, Err *err)
{
    GltfInfo g;
    if (!gltf_info_read(path, &g, err)) return NULL;
    json_t *runs = json_array();
    for (int i = 0; i < g.nrun; i++)
        json_array_append_new(runs, json_pack("{s:I,s:I,s:i,s:i}", "vertices", (json_int_t)g.run[i].vertices, "triangles", (json_int_t)g.run[i].triangles,
                                              "pieces", g.run[i].pieces, "targets", g.run[i].targets));
    json_t *o = json_pack("{s:o,s:s,s:i,s:i,s:o,s:o}", "file", info_text(path), "format", g.binary ? "binary glTF" : "glTF", "nodes", g.nodes, "meshes",
                          g.meshes, "seconds", info_real(g.seconds), "attributes", words(g.attributes));
    if (g.has_bounds) json_object_set_new(o, "bounds", json_pack("{s:o,s:o}", "from", info_reals(3, g.lo), "to", info_reals(3, g.hi)));
    json_object_set_new(o, "runs", runs);
    gltf_info_free(&g);
    return o;
}
