// vdb_write.cpp: a grid as an OpenVDB file in memory, then on disk. No C++ type and no exception leaves.
#include <openvdb/openvdb.h>
#include <openvdb/io/Archive.h>

#include <cmath>
#include <sstream>
#include <string>

extern "C" {
#include "io/volume_write_priv.h"
}

namespace {

// The library gives every file a random name of 36 letters behind 21 bytes; ours have the same bytes for the same grid.
constexpr size_t UUID_AT = 21;
constexpr char UUID[] = "00000000-0000-4000-8000-000000000000";

class Bytes : public openvdb::io::Archive {
public:
    std::string of(const openvdb::GridCPtrVec &grids)
    {
        setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
        setGridStatsMetadataEnabled(false);
        std::ostringstream os(std::ios_base::binary);
        write(os, grids, /*seekable=*/true);
        std::string bytes = os.str();
        bytes.replace(UUID_AT, sizeof UUID - 1, UUID);
        return bytes;
    }
};

openvdb::math::Transform::Ptr transformOf(const Affine &a)
{
    using namespace openvdb::math;
    const double h = a.m[0][0];
    bool cube = h > 0;
    for (int k = 0; k < 9; k++) cube = cube && a.m[k / 3][k % 3] == (k % 4 == 0 ? h : 0);
    // any other map is taken apart and put together again, which costs the last digits
    if (cube) {
        const Transform::Ptr t = Transform::createLinearTransform(h);
        t->postTranslate(Vec3d(a.t.x, a.t.y, a.t.z));
        return t;
    }
    // row vectors: the transpose of ours
    openvdb::Mat4R m = openvdb::Mat4R::identity();
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) m[k][i] = a.m[i][k];
    m.setTranslation(openvdb::Vec3R(a.t.x, a.t.y, a.t.z));
    return openvdb::math::Transform::createLinearTransform(m);
}

void addBlock(const Grid &g, int b, openvdb::FloatTree &tree)
{
    const int *o = g.origin[b];
    auto *leaf = tree.touchLeaf(openvdb::Coord(o[0], o[1], o[2]));
    for (int c = 0; c < GRID_CELLS; c++) {
        const openvdb::Coord at(o[0] + (c & 7), o[1] + (c >> 3 & 7), o[2] + (c >> 6));
        bool in = true;
        for (int a = 0; a < 3; a++) in = in && at[a] >= g.lo[a] && at[a] <= g.hi[a];
        const float v = g.value[size_t(b) * GRID_CELLS + size_t(c)];
        if (g.narrow) in = std::fabs(v) < g.background[0];
        if (in) leaf->setValueOn(at, v);
        else leaf->setValueOff(at, v);
    }
}

openvdb::FloatGrid::Ptr gridOf(const Grid &g)
{
    auto grid = openvdb::FloatGrid::create(g.background[0]);
    grid->setName("phi");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(transformOf(g.xform));
    for (int t = 0; t < g.ntile; t++) {
        const GridTile &tile = g.tile[t];
        const openvdb::Index level = tile.log2side == 3 ? 1 : tile.log2side == 7 ? 2 : 3;
        grid->tree().addTile(level, openvdb::Coord(tile.lo[0], tile.lo[1], tile.lo[2]), tile.value[0], !g.narrow);
    }
    for (int b = 0; b < g.nblock; b++) addBlock(g, b, grid->tree());
    return grid;
}

} // namespace

bool vdb_write(OutFile *f, const Grid *g, Err *err)
{
    try {
        static const bool ready = (openvdb::initialize(), true);
        (void)ready;
        const std::string bytes = Bytes().of({gridOf(*g)});
        return outfile_write(f, bytes.data(), bytes.size(), err);
    } catch (const std::bad_alloc &) {
        return fail(err, ERR_RESOURCE, "%.800s: does not fit into memory", f->path);
    } catch (const std::exception &e) {
        return fail(err, ERR_OUTPUT, "%.500s: cannot be made into an OpenVDB file: %.400s; write .npy", f->path, e.what());
    } catch (...) {
        return fail(err, ERR_OUTPUT, "%.800s: cannot be made into an OpenVDB file; write .npy", f->path);
    }
}
