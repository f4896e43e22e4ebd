// vdb.cpp: the only place that knows OpenVDB. Decodes one grid's tree, which vdb_walk has found sound, from memory
// into plain blocks and tiles. No C++ type and no exception leaves. TBB is not asked for anything: to make itself ready takes it longer than
// most frames take to be decoded.
#include <openvdb/openvdb.h>
#include <openvdb/io/io.h>

#include <cstring>
#include <istream>
#include <memory>
#include <new>
#include <streambuf>
#include <type_traits>

extern "C" {
#include "io/vdb_priv.h"
}

namespace {

constexpr int COORD_LIMIT = 1 << 20;
constexpr int TILE_COUNT_MAX = 1 << 24; // a GB or so; more tiles than that only a file made for it can hold

// Bytes in memory as a stream.
class Bytes : public std::streambuf {
public:
    Bytes(const uint8_t *data, size_t size)
    {
        char *p = const_cast<char *>(reinterpret_cast<const char *>(data));
        setg(p, p, p + size);
    }

protected:
    pos_type seekoff(off_type off, std::ios_base::seekdir dir, std::ios_base::openmode) override
    {
        const off_type size = egptr() - eback();
        const off_type from = dir == std::ios_base::beg ? 0 : dir == std::ios_base::cur ? gptr() - eback() : size;
        if (off < -from || off > size - from) return pos_type(off_type(-1));
        setg(eback(), eback() + from + off, egptr());
        return pos_type(from + off);
    }
    pos_type seekpos(pos_type at, std::ios_base::openmode mode) override
    {
        return seekoff(off_type(at), std::ios_base::beg, mode);
    }
};

uint32_t gridClass(const VdbTree &t)
{
    return openvdb::GridBase::stringToGridClass(t.grid_class);
}

// A tree whose nodes are freed here: by themselves they would be with TBB.
template <typename GridT> struct OwnTree {
    typename GridT::Ptr grid = GridT::create();
    OwnTree() = default;
    OwnTree(const OwnTree &) = delete;
    ~OwnTree() { grid->tree().root().clear(); }
};

template <typename GridT> void readTree(const VdbTree &t, GridT &grid)
{
    using namespace openvdb;
    Bytes bytes(t.data + t.tree_at, t.size - t.tree_at);
    std::istream is(&bytes);
    is.exceptions(std::ios_base::badbit | std::ios_base::failbit | std::ios_base::eofbit);

    io::StreamMetadata::Ptr meta(new io::StreamMetadata);
    io::setStreamMetadataPtr(is, meta, /*transfer=*/false);
    io::setVersion(is, VersionId(OPENVDB_LIBRARY_MAJOR_VERSION, OPENVDB_LIBRARY_MINOR_VERSION), t.version);
    io::setDataCompression(is, t.compression);
    io::setGridClass(is, gridClass(t));
    io::setHalfFloat(is, t.half);

    grid.tree().readTopology(is, t.half);
    grid.tree().readBuffers(is, t.half);
}

// A sample's components, as floats.
template <typename T> void put(const T &v, float *to, size_t stride)
{
    if constexpr (std::is_arithmetic_v<T>) {
        to[0] = static_cast<float>(v);
    } else {
        for (int k = 0; k < 3; k++) to[size_t(k) * stride] = static_cast<float>(v[k]);
    }
}

bool outOfReach(const VdbTree &t, Err *err)
{
    return fail(err, ERR_INPUT, "%s: grid '%s' has samples beyond +-2^20 voxels from the origin; move or resample it", t.path, t.name);
}

// OpenVDB's leaves have z fastest, our blocks x.
template <typename TreeT> bool copyLeaves(const VdbTree &t, const TreeT &tree, Grid *out, Err *err)
{
    grid_reserve(out, int(tree.leafCount()));
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord o = leaf->origin();
        float *to = grid_add_block(out, o.x(), o.y(), o.z());
        if (!to) return outOfReach(t, err);
        const auto *from = leaf->buffer().data();
        for (int x = 0; x < 8; x++)
            for (int y = 0; y < 8; y++)
                for (int z = 0; z < 8; z++) put(from[x * 64 + y * 8 + z], to + z * 64 + y * 8 + x, GRID_CELLS);
    }
    return true;
}

// Tiles are what differs from the background, active or not.
template <typename TreeT> bool copyTiles(const VdbTree &t, const TreeT &tree, Grid *out, Err *err)
{
    static const int LOG2SIDE[] = {0, 3, 7, 12};
    auto it = tree.cbeginValueAll();
    it.setMaxDepth(TreeT::ValueAllCIter::LEAF_DEPTH - 1);
    for (; it; ++it) {
        GridTile tile = {};
        put(it.getValue(), tile.value, 1);
        if (std::memcmp(tile.value, out->background, sizeof tile.value) == 0) continue;
        const openvdb::CoordBBox box = it.getBoundingBox();
        for (int a = 0; a < 3; a++) {
            if (box.min()[a] < -COORD_LIMIT || box.max()[a] >= COORD_LIMIT) return outOfReach(t, err);
            tile.lo[a] = box.min()[a];
        }
        tile.log2side = LOG2SIDE[it.getLevel()];
        if (out->ntile == TILE_COUNT_MAX)
            return fail(err, ERR_RESOURCE, "%s: grid '%s' has more than %d constant tiles; prune it", t.path, t.name, TILE_COUNT_MAX);
        grid_add_tile(out, tile);
    }
    return true;
}

template <typename GridT> bool decode(const VdbTree &t, Grid *out, Err *err)
{
    const OwnTree<GridT> own;
    readTree(t, *own.grid);
    const auto &tree = own.grid->constTree();
    put(tree.background(), out->background, 1);
    const openvdb::CoordBBox box = own.grid->evalActiveVoxelBoundingBox();
    if (!box.empty())
        for (int a = 0; a < 3; a++) {
            if (box.min()[a] <= -COORD_LIMIT || box.max()[a] >= COORD_LIMIT) return outOfReach(t, err);
            out->lo[a] = box.min()[a];
            out->hi[a] = box.max()[a];
        }
    return copyLeaves(t, tree, out, err) && copyTiles(t, tree, out, err);
}

bool decodeKind(const VdbTree &t, Grid *out, Err *err)
{
    static const bool ready = (openvdb::initialize(), true);
    (void)ready;
    switch (t.kind) {
    case VDB_FLOAT: return decode<openvdb::FloatGrid>(t, out, err);
    case VDB_DOUBLE: return decode<openvdb::DoubleGrid>(t, out, err);
    case VDB_VEC3S: return decode<openvdb::Vec3SGrid>(t, out, err);
    case VDB_VEC3D: return decode<openvdb::Vec3DGrid>(t, out, err);
    default: return fail(err, ERR_INPUT, "%s: grid '%s' holds no floating-point values", t.path, t.name);
    }
}

} // namespace

bool vdb_decode(const VdbTree *t, Grid *out, Err *err)
{
    try {
        return decodeKind(*t, out, err);
    } catch (const std::bad_alloc &) {
        return fail(err, ERR_RESOURCE, "%s: grid '%s' does not fit into memory", t->path, t->name);
    } catch (const std::exception &e) {
        return fail(err, ERR_INPUT, "%s: grid '%s' cannot be read: %s; write or copy the file again", t->path, t->name, e.what());
    } catch (...) {
        return fail(err, ERR_INPUT, "%s: grid '%s' cannot be read; write or copy the file again", t->path, t->name);
    }
}
