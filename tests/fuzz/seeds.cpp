/* The fuzz targets' seeds: small files of every kind in a folder for each target.
 *
 *     seeds FOLDER */
#include "../unit/volume_files.h"

#include <openvdb/io/Stream.h>
#include <filesystem>
#include <random>

extern "C" {
#include "io/gltf.h"
#include "io/ply.h"
#include "track/track.h"
}

namespace fs = std::filesystem;

static const Samples SAMPLES(7, 6, 8);

static std::string folder(const std::string &root, const char *name)
{
    fs::create_directories(root + "/" + name);
    return root + "/" + name + "/";
}

/* The byte by which fuzz_volume.c and fuzz_mesh_file.c know the kind. */
static Bytes marked(uint8_t kind, const Bytes &b)
{
    Bytes out;
    add(out, &kind, 1);
    add(out, b.data(), b.size());
    return out;
}

static void write_vdb_seeds(const std::string &to)
{
    using namespace openvdb;
    auto phi = vdb_grid(SAMPLES);
    auto half = tools::createLevelSetSphere<FloatGrid>(1.5f, Vec3f(0), 0.5f);
    half->setName("half");
    half->setSaveFloatAsHalf(true);
    auto v = Vec3SGrid::create(Vec3s(0, 1, 0));
    v->setName("v");
    v->setGridClass(GRID_STAGGERED);
    v->fill(CoordBBox(Coord(0), Coord(3)), Vec3s(1, 2, 3));
    auto tiles = DoubleGrid::create(0.5);
    tiles->setName("tiles");
    tiles->fill(CoordBBox(Coord(-128), Coord(-1)), -1.0);
    auto count = Int32Grid::create(1);
    count->setName("count");
    const GridPtrVec sets[] = {{phi}, {half, v}, {phi, tiles, count}, {phi, phi->copy()}};
    const uint32_t codecs[] = {io::COMPRESS_NONE, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK, io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK};
    int n = 0;
    for (const GridPtrVec &grids : sets)
        for (uint32_t codec : codecs) {
            io::File file(to + std::to_string(n++) + ".vdb");
            file.setCompression(codec);
            file.write(grids);
        }
    std::ofstream pipe(to + "pipe.vdb", std::ios::binary);
    io::Stream(pipe).write(sets[1]);
}

static void write_volume_seeds(const std::string &root, const std::string &to)
{
    static const char *const endings[] = {".nvdb", ".npy", ".raw", ".nrrd", ".nhdr", ".uni", ".exr"};
    const std::string scratch = folder(root, "scratch");
    std::vector<std::string> placed, all = write_all(SAMPLES, scratch, &placed);
    all.insert(all.end(), placed.begin(), placed.end());
    for (const std::string &path : all)
        for (uint8_t k = 0; k < 7; k++)
            if (path.substr(path.rfind('.')) == endings[k]) save(to + fs::path(path).filename().string(), marked(k, load_bytes(path)));
    fs::remove_all(scratch);
}

/* Three frames, quantized and packed. */
static void write_packed_seed(const std::string &path, const TriMesh &m)
{
    Err err = {};
    GltfOptions options = {path.c_str(), 24, "geometric", false, GLTF_MESHOPT, nullptr};
    Gltf *g = gltf_open(&options, &err);
    for (int k = 0; k < 3; k++)
        if (!gltf_add_frame(g, &m, nullptr, nullptr, 1, &err)) throw std::runtime_error(err.text);
    if (!gltf_close(g, &err)) throw std::runtime_error(err.text);
    save(path, marked(1, load_bytes(path)));
}

static void write_mesh_seeds(const std::string &to)
{
    TriMesh m;
    Err err = {};
    trimesh_init(&m, 4, 4, true, true);
    const int32_t tri[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    for (int i = 0; i < 12; i++) m.pos[i] = m.normal[i] = m.velocity[i] = float(i % 4 == 0), m.tri[i] = tri[i];
    for (int i = 0; i < 4; i++) m.id[i] = m.parent[i] = i;
    if (!ply_write((to + "mesh.ply").c_str(), &m, &err)) throw std::runtime_error(err.text);
    write_packed_seed(to + "packed.glb", m);
    trimesh_free(&m);
    save(to + "mesh.ply", marked(0, load_bytes(to + "mesh.ply")));

    const std::string text = "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty double x\nproperty float y\nproperty float z\nproperty float heat\n"
                             "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3e4\n3 0 1 2\n";
    const std::string gltf = R"({"asset":{"version":"2.0"},"accessors":[{"count":3,"type":"SCALAR","componentType":5123},{"count":3,"type":"VEC3","componentType":5126,)"
                             R"("min":[0,0,0],"max":[1,1,0]},{"count":2,"type":"SCALAR","componentType":5126,"min":[0],"max":[1]}],"meshes":[{"primitives":[)"
                             R"({"indices":0,"attributes":{"POSITION":1},"targets":[{"POSITION":1}]}]}],"nodes":[{"mesh":0}],)"
                             R"("animations":[{"samplers":[{"input":2,"output":2}],"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}]}]})";
    Bytes ascii, json, glb = {'g', 'l', 'T', 'F', 2, 0, 0, 0};
    add(ascii, text);
    add(json, gltf);
    std::string padded = gltf;
    padded.resize((gltf.size() + 3) / 4 * 4, ' ');
    const uint32_t sizes[3] = {uint32_t(20 + padded.size()), uint32_t(padded.size()), 0x4e4f534a};
    add(glb, sizes, 3);
    add(glb, padded);
    save(to + "ascii.ply", marked(0, ascii));
    save(to + "mesh.glb", marked(1, glb));
    save(to + "mesh.gltf", marked(2, json));
}

static void save_store(const std::string &to, uint8_t kind, Store *s)
{
    save(to, marked(kind, Bytes(s->data, s->data + s->n)));
    store_free(s);
}

/* A ball of so many voxels' radius. */
struct SphereFrame {
    Field field;
    explicit SphereFrame(int radius)
    {
        const int n = 2 * radius + 5, size[3] = {n, n, n};
        std::vector<float> phi;
        for (int i = 0; i < n * n * n; i++) {
            const double x = i % n - n / 2, y = i / n % n - n / 2, z = i / n / n - n / 2;
            phi.push_back(float(std::sqrt(x * x + y * y + z * z) - radius));
        }
        Grid g;
        grid_init(&g, 1);
        grid_from_dense(&g, phi.data(), size);
        const FieldSpec spec = {0, true};
        Err err = {};
        if (!field_build(&field, &g, &spec, &err)) throw std::runtime_error(err.text);
        grid_free(&g);
    }
    SphereFrame(const SphereFrame &) = delete;
    ~SphereFrame() { field_free(&field); }
};

static void write_state_seeds(const std::string &to)
{
    const SphereFrame ball(2);
    TrackSettings set = track_defaults();
    set.rest = set.own_motion = true;
    Track *tr = track_open(&set);
    FrameStat stat;
    Err err = {};
    if (!track_frame(tr, &ball.field, nullptr, 1, &stat, &err)) throw std::runtime_error(err.text);
    Store s = store_writing();
    track_store(tr, &s);
    save_store(to + "track", 0, &s);

    TriMesh m;
    track_meshes(tr, false, nullptr, &m);
    s = store_writing();
    trimesh_store(&m, &s);
    save_store(to + "mesh", 1, &s);

    const std::string path = to + "seed.glb";
    GltfOptions options = {path.c_str(), 24, "geometric", false, GLTF_MESHOPT, nullptr};
    Gltf *g = gltf_open(&options, &err);
    for (int k = 0; k < 3; k++)
        if (!gltf_add_frame(g, &m, nullptr, nullptr, 1, &err)) throw std::runtime_error(err.text);
    s = store_writing();
    gltf_store(g, &s);
    save_store(to + "gltf", 2, &s);
    gltf_abort(g);
    trimesh_free(&m);
    track_close(tr);
}

static void write_edit_seeds(const std::string &to)
{
    std::mt19937 random(1);
    for (int n = 0; n < 8; n++) {
        Bytes b(30u << n % 4);
        for (uint8_t &x : b) x = uint8_t(random());
        save(to + std::to_string(n), b);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2) return 2;
    const std::string root = argv[1];
    write_vdb_seeds(folder(root, "vdb"));
    write_volume_seeds(root, folder(root, "volume"));
    write_mesh_seeds(folder(root, "mesh_file"));
    write_state_seeds(folder(root, "state"));
    write_edit_seeds(folder(root, "edits"));
    return 0;
}
