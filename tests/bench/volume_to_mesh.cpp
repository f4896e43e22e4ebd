// OpenVDB's own mesher on one grid of each file named, timed: what twinmesh's figures are read beside.
//
//   volume_to_mesh GRID ISO FILE...
//
// Prints a line a file: seconds to read, seconds to mesh (adaptivity 0, as many threads as TBB takes), triangles.

#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

static double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

static void mesh_file(const char *path, const char *name, double iso)
{
    auto start = std::chrono::steady_clock::now();
    openvdb::io::File file(path);
    file.open(false);
    auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(name));
    if (!grid) OPENVDB_THROW(openvdb::TypeError, "no float grid");
    double read = seconds_since(start);

    start = std::chrono::steady_clock::now();
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*grid, points, triangles, quads, iso, 0.0);
    std::printf("%.6f %.6f %zu\n", read, seconds_since(start), triangles.size() + 2 * quads.size());
}

int main(int argc, char **argv)
{
    if (argc < 4) {
        std::fprintf(stderr, "volume_to_mesh GRID ISO FILE...\n");
        return 2;
    }
    openvdb::initialize();
    for (int i = 3; i < argc; i++) {
        try {
            mesh_file(argv[i], argv[1], std::atof(argv[2]));
        } catch (const std::exception &e) {
            std::fprintf(stderr, "volume_to_mesh: %s: %s\n", argv[i], e.what());
            return 3;
        }
    }
    return 0;
}
