#include "peer.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <stdexcept>

using openvdb::FloatGrid;
using openvdb::Vec3I;
using openvdb::Vec3s;

PeerMesh volume_to_mesh(const FloatGrid &grid, double iso, double adaptivity)
{
    PeerMesh m;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, m.point, m.triangle, quads, iso, adaptivity);
    for (Vec3I &t : m.triangle) std::swap(t[1], t[2]); // OpenVDB winds clockwise
    m.triangle.reserve(m.triangle.size() + 2 * quads.size());
    for (const auto &q : quads) {
        m.triangle.emplace_back(q[0], q[2], q[1]);
        m.triangle.emplace_back(q[0], q[3], q[2]);
    }
    return m;
}

static FloatGrid::Ptr read_grid(const std::string &path, const char *name)
{
    openvdb::io::File file(path);
    file.open(false);
    auto grid = openvdb::gridPtrCast<FloatGrid>(file.readGrid(name));
    if (!grid) OPENVDB_THROW(openvdb::TypeError, name << " is no grid of floats");
    return grid;
}

static void write_ply(const std::string &path, const PeerMesh &m)
{
    static_assert(sizeof(Vec3s) == 12 && sizeof(Vec3I) == 12, "packed as PLY has them");
    char head[256];
    int nhead = std::snprintf(head, sizeof head, "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty float x\n"
        "property float y\nproperty float z\nelement face %zu\nproperty list uchar int vertex_indices\nend_header\n", m.point.size(),
        m.triangle.size());
    std::vector<char> faces(13 * m.triangle.size());
    for (size_t t = 0; t < m.triangle.size(); t++) {
        faces[13 * t] = 3;
        std::memcpy(&faces[13 * t + 1], &m.triangle[t], 12);
    }
    FILE *f = std::fopen(path.c_str(), "wb");
    if (!f) throw std::runtime_error("cannot be created");
    bool ok = std::fwrite(head, 1, (size_t)nhead, f) == (size_t)nhead &&
        std::fwrite(m.point.data(), 12, m.point.size(), f) == m.point.size() &&
        std::fwrite(faces.data(), 1, faces.size(), f) == faces.size();
    if (std::fclose(f) != 0 || !ok) throw std::runtime_error("cannot be written");
}

// The last digits of a file's name.
static std::string frame_of(const std::string &path)
{
    size_t end = path.rfind('.'), first = end;
    while (first > 0 && std::isdigit((unsigned char)path[first - 1])) first--;
    return path.substr(first, end - first);
}

struct Job {
    const char *grid;
    double iso;
    std::string prefix;
    double parameter;
};

static void mesh_file(const Peer &peer, const Job &job, const std::string &path)
{
    Laps laps;
    auto grid = read_grid(path, job.grid);
    laps.end("read");
    PeerMesh m = peer.mesh(*grid, job.iso, job.parameter, laps);
    std::string frame = frame_of(path);
    write_ply(job.prefix + "." + frame + ".ply", m);
    laps.end("write");
    std::printf("{\"frame\":\"%s\"", frame.c_str());
    for (const auto &[stage, seconds] : laps.lap) std::printf(",\"%s\":%.6f", stage.c_str(), seconds);
    std::printf(",\"triangles\":%zu}\n", m.triangle.size());
}

int peer_main(int argc, char **argv, const Peer &peer)
{
    int file = peer.parameter ? 6 : 5;
    if (argc <= file) {
        std::fprintf(stderr, "%s THREADS GRID ISO PREFIX %s FILE...\n", argv[0], peer.parameter ? peer.parameter : "");
        return 2;
    }
    int threads = std::max(1, std::atoi(argv[1]));
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, (size_t)threads);
    if (peer.set_threads) peer.set_threads(threads);
    openvdb::initialize();
    const Job job = {argv[2], std::atof(argv[3]), argv[4], peer.parameter ? std::atof(argv[5]) : 0};
    for (int i = file; i < argc; i++) {
        try {
            mesh_file(peer, job, argv[i]);
        } catch (const std::exception &e) {
            std::fprintf(stderr, "%s: %s: %s\n", argv[0], argv[i], e.what());
            return 3;
        }
    }
    return 0;
}
