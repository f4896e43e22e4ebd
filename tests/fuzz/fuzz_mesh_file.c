/* Mesh files: PLY, and glTF as `twinmesh info` looks at it and as others take its frames; the first byte says which. */
#include "fuzz.h"

#include "io/gltf_info.h"
#include "io/gltf_read.h"
#include "io/ply.h"

static void check_mesh(TriMesh *m)
{
    for (int i = 0; i < 3 * m->ntri; i++)
        if (m->tri[i] < 0 || m->tri[i] >= m->nvert) abort();
    trimesh_free(m);
}

static void read_ply(const char *path)
{
    TriMesh m;
    Err err = {0};
    if (ply_read(path, &m, &err)) check_mesh(&m);
    else fuzz_check_failure(&err);
}

static void read_gltf(const char *path)
{
    GltfInfo info;
    Err err = {0};
    if (gltf_info_read(path, &info, &err)) gltf_info_free(&info);
    else fuzz_check_failure(&err);

    GltfReader *r = gltf_reader_open(path, &err);
    if (!r) fuzz_check_failure(&err);
    for (int i = 0; r && i < gltf_reader_length(r) && i < 20; i++) {
        TriMesh m;
        if (gltf_reader_mesh(r, i, &m, &err)) check_mesh(&m);
        else fuzz_check_failure(&err);
    }
    gltf_reader_close(r);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    int kind = data[0] % 3;
    const char *path = fuzz_file(kind == 0 ? ".ply" : kind == 1 ? ".glb" : ".gltf", data + 1, size - 1);
    (kind == 0 ? read_ply : read_gltf)(path);
    remove(path);
    return 0;
}
