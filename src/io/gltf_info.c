#include "io/gltf_info.h"

#include "io/gltf_json_priv.h"

#include <string.h>

typedef struct Parts {
    json_t *accessors;
    GltfInfo *info;
    int caprun, nname;
    int64_t *run_index;    /* [nrun] the accessor of the run's indices; NONE: none */
    const char *name[64];  /* of attributes, sorted */
} Parts;

static int64_t accessor_count(const Parts *p, int64_t i)
{
    int64_t n = gltf_whole(gltf_at(p->accessors, i), "count");
    return n == NONE ? 0 : n;
}

static void note_bounds(Parts *p, json_t *position, const GltfPlace *place)
{
    json_t *lo = json_object_get(position, "min"), *hi = json_object_get(position, "max");
    if (json_array_size(lo) != 3 || json_array_size(hi) != 3) return;
    GltfInfo *g = p->info;
    for (size_t a = 0; a < 3; a++) {
        double l = place->at[a] + place->scale * json_number_value(json_array_get(lo, a)),
               h = place->at[a] + place->scale * json_number_value(json_array_get(hi, a));
        g->lo[a] = g->has_bounds ? real_min(g->lo[a], l) : l;
        g->hi[a] = g->has_bounds ? real_max(g->hi[a], h) : h;
    }
    g->has_bounds = true;
}

static void note_name(Parts *p, const char *name)
{
    int i = 0;
    while (i < p->nname && strcmp(p->name[i], name) < 0) i++;
    if (p->nname == 64 || (i < p->nname && strcmp(p->name[i], name) == 0)) return;
    memmove(p->name + i + 1, p->name + i, (size_t)(p->nname - i) * sizeof *p->name);
    p->name[i] = name;
    p->nname++;
}

static GltfRunInfo *run_of(Parts *p, int64_t index)
{
    GltfInfo *g = p->info;
    if (g->nrun && index != NONE && p->run_index[g->nrun - 1] == index) return &g->run[g->nrun - 1];
    if (g->nrun == p->caprun) {
        p->caprun = 2 * p->caprun + 8;
        RESIZE(g->run, p->caprun);
        RESIZE(p->run_index, p->caprun);
    }
    p->run_index[g->nrun] = index;
    g->run[g->nrun] = (GltfRunInfo){0};
    return &g->run[g->nrun++];
}

static void note_primitive(Parts *p, json_t *primitive, const GltfPlace *place)
{
    json_t *attributes = json_object_get(primitive, "attributes"), *value;
    const char *name;
    int64_t index = gltf_whole(primitive, "indices"), position = gltf_whole(attributes, "POSITION");
    GltfRunInfo *run = run_of(p, index);
    run->vertices = accessor_count(p, position);
    run->triangles = (index == NONE ? run->vertices : accessor_count(p, index)) / 3;
    run->pieces++;
    run->targets += (int)json_array_size(json_object_get(primitive, "targets"));
    note_bounds(p, gltf_at(p->accessors, position), place);
    json_object_foreach(attributes, name, value) note_name(p, name);
}

static void note_animation(Parts *p, json_t *animation)
{
    json_t *sampler;
    size_t i;
    json_array_foreach(json_object_get(animation, "samplers"), i, sampler)
    {
        json_t *most = json_object_get(gltf_at(p->accessors, gltf_whole(sampler, "input")), "max");
        p->info->seconds = real_max(p->info->seconds, json_number_value(json_array_get(most, 0)));
    }
}

/* [number of meshes]: where the node stands that shows it. The caller frees it. */
static GltfPlace *mesh_places(const GltfJson *json)
{
    json_t *nodes = json_object_get(json->root, "nodes"), *node;
    size_t i, n = json_array_size(json_object_get(json->root, "meshes"));
    GltfPlace *of_node = NEW(GltfPlace, json_array_size(nodes)), *of_mesh = NEW(GltfPlace, n);
    gltf_json_places(json, of_node); /* what is placed in other ways is told where it stands without */
    for (i = 0; i < n; i++) of_mesh[i] = (GltfPlace){.scale = 1};
    json_array_foreach(nodes, i, node)
    {
        int64_t mesh = gltf_whole(node, "mesh");
        if (mesh != NONE && mesh < (int64_t)n) of_mesh[mesh] = of_node[i];
    }
    mem_free(of_node);
    return of_mesh;
}

static void gather(Parts *p, const GltfJson *json)
{
    json_t *root = json->root;
    GltfPlace *place = mesh_places(json);
    json_t *meshes = json_object_get(root, "meshes"), *mesh, *primitive;
    size_t i, k, used = 0;
    p->accessors = json_object_get(root, "accessors");
    p->info->nodes = (int)json_array_size(json_object_get(root, "nodes"));
    p->info->meshes = (int)json_array_size(meshes);
    json_array_foreach(meshes, i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) note_primitive(p, primitive, &place[i]);
    mem_free(place);
    json_array_foreach(json_object_get(root, "animations"), i, mesh) note_animation(p, mesh);
    for (int n = 0; n < p->nname && used < sizeof p->info->attributes; n++)
        used += (size_t)snprintf(p->info->attributes + used, sizeof p->info->attributes - used, "%s%s", n ? " " : "", p->name[n]);
}

bool gltf_info_read(const char *path, GltfInfo *out, Err *err)
{
    InFile in;
    GltfJson json;
    *out = (GltfInfo){0};
    if (!infile_open(&in, path, err)) return false;
    bool ok = gltf_json_read(&in, &json, err);
    infile_close(&in);
    if (!ok) return false;
    Parts parts = {.info = out};
    out->binary = json.binary;
    gather(&parts, &json);
    mem_free(parts.run_index);
    json_decref(json.root);
    return true;
}

void gltf_info_free(GltfInfo *info)
{
    mem_free(info->run);
    *info = (GltfInfo){0};
}
