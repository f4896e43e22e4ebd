// nvdb.cpp: the only place that knows NanoVDB. Walks through one grid's bytes, holding each offset to them, and copies
// blocks and tiles out. No C++ type leaves; nothing here throws.
#include <nanovdb/NanoVDB.h>

#include <cstring>
#include <type_traits>

extern "C" {
#include "io/nvdb_priv.h"
}

namespace {

constexpr int COORD_LIMIT = 1 << 20;
constexpr int TILE_COUNT_MAX = 1 << 24; // as for OpenVDB: only a file made for it holds more

template <typename BuildT> class Walk {
    using Root = typename nanovdb::NanoRoot<BuildT>::DataType;
    using Upper = typename nanovdb::NanoUpper<BuildT>::DataType;
    using Lower = typename nanovdb::NanoLower<BuildT>::DataType;
    using Leaf = typename nanovdb::NanoLeaf<BuildT>::DataType;
    using ValueT = typename Root::ValueT;

public:
    Walk(const NvdbGrid &grid, Grid *to) : g(grid), out(to) {}
    ~Walk() { map_free(&taken); }

    bool run(Err *err)
    {
        if (walkTree()) return true;
        if (!wrong) wrong = "an offset leads out of it";
        return fail(err, ERR_INPUT, "%.600s: grid '%s' cannot be read: %s; write or copy the file again", g.path, g.name, wrong);
    }

private:
    const NvdbGrid &g;
    Grid *out;
    Map taken = {};
    size_t met = 0; // bytes of the nodes met
    const char *wrong = nullptr;

    bool refuse(const char *why)
    {
        wrong = why;
        return false;
    }

    // `count` bytes at an offset from something in the buffer, or null.
    const uint8_t *bytes(const void *from, int64_t offset, size_t count) const
    {
        int64_t at;
        if (__builtin_add_overflow(static_cast<const uint8_t *>(from) - g.data, offset, &at)) return nullptr;
        if (at < 0 || at % NVDB_ALIGNMENT != 0 || uint64_t(at) > g.size || count > g.size - uint64_t(at)) return nullptr;
        return g.data + at;
    }

    template <typename NodeT> const NodeT *node(const void *from, int64_t offset)
    {
        const uint8_t *p = bytes(from, offset, sizeof(NodeT));
        met += sizeof(NodeT);
        if (p && met > g.size) return refuse("its nodes are not a tree"), nullptr;
        return reinterpret_cast<const NodeT *>(p);
    }

    static void put(const ValueT &v, float *to, size_t stride)
    {
        if constexpr (std::is_arithmetic_v<ValueT>) {
            to[0] = static_cast<float>(v);
        } else {
            for (int k = 0; k < 3; k++) to[size_t(k) * stride] = static_cast<float>(v[k]);
        }
    }

    void reach(const int lo[3], int side)
    {
        bool first = grid_is_empty(out);
        for (int a = 0; a < 3; a++) {
            if (first || lo[a] < out->lo[a]) out->lo[a] = lo[a];
            if (first || lo[a] + side - 1 > out->hi[a]) out->hi[a] = lo[a] + side - 1;
        }
    }

    bool addTile(const ValueT &v, const int lo[3], int log2side, bool active)
    {
        GridTile tile = {};
        if (active) reach(lo, 1 << log2side);
        put(v, tile.value, 1);
        if (std::memcmp(tile.value, out->background, sizeof tile.value) == 0) return true;
        for (int a = 0; a < 3; a++) tile.lo[a] = lo[a];
        tile.log2side = log2side;
        if (out->ntile == TILE_COUNT_MAX) return refuse("it has too many constant tiles");
        grid_add_tile(out, tile);
        return true;
    }

    // Child n of a node of `side` children of 2^log2child samples each; z is fastest.
    static void corner(const int lo[3], uint32_t n, int log2side, int log2child, int to[3])
    {
        const uint32_t mask = (1u << log2side) - 1;
        to[0] = lo[0] + (int(n >> 2 * log2side) << log2child);
        to[1] = lo[1] + (int(n >> log2side & mask) << log2child);
        to[2] = lo[2] + (int(n & mask) << log2child);
    }

    bool walkLeaf(const void *from, int64_t offset, const int lo[3])
    {
        const Leaf *leaf = node<Leaf>(from, offset);
        if (!leaf || !bytes(from, offset, leaf->memUsage())) return false;
        float *to = grid_add_block(out, lo[0], lo[1], lo[2]);
        for (uint32_t n = 0; n < GRID_CELLS; n++) {
            int at[3];
            corner(lo, n, 3, 0, at);
            put(leaf->getValue(n), to + (n & 7) * 64 + (n >> 3 & 7) * 8 + (n >> 6), GRID_CELLS);
            if (leaf->mValueMask.isOn(n)) reach(at, 1);
        }
        return true;
    }

    template <typename NodeT> bool walkNode(const void *from, int64_t offset, const int lo[3])
    {
        constexpr bool upper = std::is_same_v<NodeT, Upper>;
        constexpr int log2side = upper ? 5 : 4, log2child = upper ? 7 : 3;
        const NodeT *node = this->template node<NodeT>(from, offset);
        if (!node) return false;
        for (uint32_t n = 0; n < 1u << 3 * log2side; n++) {
            int at[3];
            corner(lo, n, log2side, log2child, at);
            bool ok;
            if (!node->mChildMask.isOn(n))
                ok = addTile(node->mTable[n].value, at, log2child, node->mValueMask.isOn(n));
            else if constexpr (upper)
                ok = walkNode<Lower>(node, node->mTable[n].child, at);
            else
                ok = walkLeaf(node, node->mTable[n].child, at);
            if (!ok) return false;
        }
        return true;
    }

    bool walkRoot(const Root *root)
    {
        const auto *tile = reinterpret_cast<const typename Root::Tile *>(
            bytes(root, sizeof(Root), size_t(root->mTableSize) * sizeof(typename Root::Tile)));
        if (!tile) return false;
        put(root->mBackground, out->background, 1);
        for (uint32_t i = 0; i < root->mTableSize; i++, tile++) {
            const auto o = tile->origin();
            const int lo[3] = {o[0], o[1], o[2]}, before = taken.count;
            for (int a = 0; a < 3; a++)
                if (lo[a] <= -COORD_LIMIT || lo[a] >= COORD_LIMIT) return refuse("samples lie beyond +-2^20 voxels from the origin");
            map_put(&taken, key_coord(lo[0] >> 12, lo[1] >> 12, lo[2] >> 12), 0);
            if (taken.count == before) return refuse("two nodes lie at one place");
            if (tile->child ? !walkNode<Upper>(root, tile->child, lo) : !addTile(tile->value, lo, 12, tile->state != 0)) return false;
        }
        return true;
    }

    bool walkTree()
    {
        const auto *head = reinterpret_cast<const nanovdb::GridData *>(bytes(g.data, 0, sizeof(nanovdb::GridData)));
        if (!head) return refuse("it is cut short");
        if (head->mMagic != NANOVDB_MAGIC_NUMBER || head->mVersion.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER || uint32_t(head->mGridType) != g.type)
            return refuse("it is damaged");
        const double *m = head->mMap.mMatD, *t = head->mMap.mVecD;
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) out->xform.m[a][b] = m[3 * a + b];
        out->xform.t = vec3(t[0], t[1], t[2]);
        if (!affine_invert(&out->xform) || !std::isfinite(v_len2(out->xform.t))) return refuse("its transform has no inverse");
        const auto *tree = reinterpret_cast<const nanovdb::TreeData<3> *>(bytes(head, sizeof *head, sizeof(nanovdb::TreeData<3>)));
        if (!tree) return refuse("it is cut short");
        const Root *root = tree->mNodeOffset[3] > g.size ? nullptr : node<Root>(tree, int64_t(tree->mNodeOffset[3]));
        return root && walkRoot(root);
    }
};

template <typename BuildT> bool decode(const NvdbGrid &g, Grid *out, Err *err) { return Walk<BuildT>(g, out).run(err); }

struct Kind {
    nanovdb::GridType type;
    int ncomp;
    bool (*decode)(const NvdbGrid &g, Grid *out, Err *err);
};
const Kind KINDS[] = {
    {nanovdb::GridType::Float, 1, decode<float>},         {nanovdb::GridType::Double, 1, decode<double>},
    {nanovdb::GridType::Vec3f, 3, decode<nanovdb::Vec3f>}, {nanovdb::GridType::Vec3d, 3, decode<nanovdb::Vec3d>},
    {nanovdb::GridType::Fp4, 1, decode<nanovdb::Fp4>},    {nanovdb::GridType::Fp8, 1, decode<nanovdb::Fp8>},
    {nanovdb::GridType::Fp16, 1, decode<nanovdb::Fp16>},  {nanovdb::GridType::FpN, 1, decode<nanovdb::FpN>},
};

} // namespace

const char *nvdb_type_name(uint32_t type, int *ncomp)
{
    *ncomp = 0;
    for (const Kind &k : KINDS)
        if (uint32_t(k.type) == type) *ncomp = k.ncomp;
    return nanovdb::toStr(type < uint32_t(nanovdb::GridType::End) ? nanovdb::GridType(type) : nanovdb::GridType::Unknown);
}

const char *nvdb_class_name(uint32_t grid_class)
{
    switch (nanovdb::GridClass(grid_class)) {
    case nanovdb::GridClass::LevelSet: return "level set";
    case nanovdb::GridClass::FogVolume: return "fog volume";
    case nanovdb::GridClass::Staggered: return "staggered";
    default: return "";
    }
}

bool nvdb_decode(const NvdbGrid *g, Grid *out, Err *err)
{
    for (const Kind &k : KINDS)
        if (uint32_t(k.type) == g->type) return k.decode(*g, out, err);
    return fail(err, ERR_INPUT, "%.600s: grid '%s' holds no real numbers", g->path, g->name);
}

uint64_t nvdb_magic(void) { return NANOVDB_MAGIC_NUMBER; }
uint32_t nvdb_major(void) { return NANOVDB_MAJOR_VERSION_NUMBER; }
