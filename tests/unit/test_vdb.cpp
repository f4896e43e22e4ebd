/* OpenVDB files: what the library writes is read alike; what is cut short, crafted or beyond us is refused. */
#include <openvdb/openvdb.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

extern "C" {
#include "io/vdb_priv.h"
#include "temp_dir.h"
#include <cmocka.h>
}

/* When a chunk cannot be decompressed, OpenVDB throws while a root's child is not yet in its table, and loses it. */
extern "C" const char *__lsan_default_suppressions() { return "leak:RootNode*readTopology"; }

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::GridBase;
using Grids = openvdb::GridPtrVec;

static std::string write_file(const Grids &grids, uint32_t compression = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK,
                              const char *name = "a.vdb")
{
    std::string path = temp_path(name);
    openvdb::io::File file(path);
    file.setCompression(compression);
    file.write(grids);
    file.close();
    return path;
}

static std::vector<char> load(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return std::vector<char>(std::istreambuf_iterator<char>(in), {});
}

static void read_volume(const std::string &path, const char *grid, const char *velocity, Volume *v)
{
    VolumeRequest r = {};
    r.grid = grid;
    r.velocity = velocity;
    Err err = {};
    if (!volume_read(path.c_str(), &r, v, &err)) fail_msg("%s", err.text);
}

static void expect_refused(const std::string &path, const char *grid, const char *velocity, const char *word)
{
    VolumeRequest r = {};
    r.grid = grid;
    r.velocity = velocity;
    Volume v;
    Err err = {};
    if (volume_read(path.c_str(), &r, &v, &err)) fail_msg("%s was expected", word);
    if (!strstr(err.text, word) || !strstr(err.text, path.c_str())) fail_msg("'%s' is not in: %s", word, err.text);
    assert_int_equal(err.code, ERR_INPUT);
    assert_null(v.surface.value);
    assert_null(v.velocity.value);
}

template <typename T> static float component(const T &v, int k)
{
    if constexpr (std::is_arithmetic_v<T>) return k ? 0 : static_cast<float>(v);
    else return static_cast<float>(v[k]);
}

/* Every stored sample, samples around the bounding box and far away, the box and the transform. */
template <typename GridT> static void expect_same(const GridT &want, const ::Grid *got)
{
    auto access = want.getConstAccessor();
    auto check = [&](const Coord &c) {
        const auto v = access.getValue(c);
        for (int k = 0; k < got->ncomp; k++)
            if (component(v, k) != grid_at(got, c.x(), c.y(), c.z(), k))
                fail_msg("(%d, %d, %d) component %d: %g, not %g", c.x(), c.y(), c.z(), k, double(grid_at(got, c.x(), c.y(), c.z(), k)), double(component(v, k)));
    };
    for (auto leaf = want.tree().cbeginLeaf(); leaf; ++leaf)
        for (openvdb::Index i = 0; i < GRID_CELLS; i++) check(leaf->offsetToGlobalCoord(i));
    const CoordBBox box = want.evalActiveVoxelBoundingBox();
    if (box.empty()) {
        assert_true(grid_is_empty(got));
    } else {
        assert_true(box.min() == Coord(got->lo) && box.max() == Coord(got->hi));
        std::mt19937 random(1);
        CoordBBox around = box;
        around.expand(20);
        for (int i = 0; i < 5000; i++) {
            Coord c;
            for (int a = 0; a < 3; a++) c[a] = around.min()[a] + int(random() % unsigned(around.dim()[a]));
            check(c);
        }
    }
    check(Coord(100000, -100000, 99999));
    for (const openvdb::Vec3d p : {openvdb::Vec3d(0, 0, 0), openvdb::Vec3d(1, 2, 3), openvdb::Vec3d(-70, 41.5, 9)}) {
        const openvdb::Vec3d w = want.indexToWorld(p);
        const Vec3 q = affine_to_world(&got->xform, vec3(p.x(), p.y(), p.z())), i = affine_to_index(&got->xform, q);
        assert_true((w - openvdb::Vec3d(q.x, q.y, q.z)).length() < 1e-9);
        assert_true((p - openvdb::Vec3d(i.x, i.y, i.z)).length() < 1e-9);
    }
}

static FloatGrid::Ptr sphere(const char *name, float radius = 20)
{
    auto g = openvdb::tools::createLevelSetSphere<FloatGrid>(radius, openvdb::Vec3f(3, -5, 1), 1.0f);
    g->setName(name);
    return g;
}

template <typename GridT, typename T> static typename GridT::Ptr ball(const char *name, T (*value)(int, int, int))
{
    auto g = GridT::create(value(1000, 1000, 1000));
    g->setName(name);
    auto access = g->getAccessor();
    for (int x = -9; x < 9; x++)
        for (int y = -9; y < 9; y++)
            for (int z = -9; z < 9; z++)
                if (x * x + y * y + z * z < 81) access.setValue(Coord(x, y, z), value(x, y, z));
    return g;
}

static FloatGrid::Ptr small(const char *name)
{
    return ball<FloatGrid, float>(name, [](int x, int y, int z) { return float(x + 20 * y + 400 * z); });
}

static openvdb::Vec3SGrid::Ptr small_vectors(const char *name)
{
    return ball<openvdb::Vec3SGrid, openvdb::Vec3f>(name, [](int x, int y, int z) { return openvdb::Vec3f(float(x), float(y) / 4, float(z) * 2); });
}

static void reads_every_compression_and_precision(void **)
{
    using namespace openvdb::io;
    for (uint32_t c : {uint32_t(COMPRESS_NONE), uint32_t(COMPRESS_ZIP), uint32_t(COMPRESS_BLOSC), uint32_t(COMPRESS_ACTIVE_MASK),
                       uint32_t(COMPRESS_ZIP | COMPRESS_ACTIVE_MASK), uint32_t(COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK)})
        for (bool half : {false, true}) {
            auto level = sphere("phi");
            auto real = ball<openvdb::DoubleGrid, double>("fine", [](int x, int y, int z) { return x * 0.1 + y - z * 3.; });
            auto v = small_vectors("v");
            auto vd = ball<openvdb::Vec3DGrid, openvdb::Vec3d>("vd", [](int x, int y, int z) { return openvdb::Vec3d(x * .3, y, z); });
            for (GridBase::Ptr g : {GridBase::Ptr(level), GridBase::Ptr(real), GridBase::Ptr(v), GridBase::Ptr(vd)}) g->setSaveFloatAsHalf(half);
            const std::string path = write_file({level, real, v, vd}, c);
            File file(path);
            file.open(false);
            Volume a, b;
            read_volume(path, "phi", "v", &a);
            read_volume(path, "fine", "vd", &b);
            /* as OpenVDB itself reads it: halves are rounded */
            expect_same(*openvdb::gridPtrCast<FloatGrid>(file.readGrid("phi")), &a.surface);
            expect_same(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(file.readGrid("v")), &a.velocity);
            expect_same(*openvdb::gridPtrCast<openvdb::DoubleGrid>(file.readGrid("fine")), &b.surface);
            expect_same(*openvdb::gridPtrCast<openvdb::Vec3DGrid>(file.readGrid("vd")), &b.velocity);
            assert_string_equal(a.name, "phi");
            assert_int_equal(a.kind, VOLUME_LEVEL_SET);
            assert_true(a.has_velocity && !a.velocity.staggered);
            assert_true(a.surface.ntile > 0 && a.surface.background[0] == 3);
            volume_free(&a);
            volume_free(&b);
        }
}

static void reads_tiles_of_every_level(void **)
{
    auto g = FloatGrid::create(5);
    g->setName("phi");
    g->tree().addTile(1, Coord(-16, 8, 0), -1, true);
    g->tree().addTile(1, Coord(0, 8, 0), -2, false);
    g->tree().addTile(2, Coord(128, -128, 0), -3, false);
    g->tree().addTile(3, Coord(-4096, 4096, 0), -4, false);
    g->tree().setValue(Coord(-1, -1, -1), 7);
    const std::string path = write_file({g});
    Volume v;
    read_volume(path, nullptr, nullptr, &v);
    expect_same(*g, &v.surface);
    assert_true(grid_at(&v.surface, -9, 15, 7, 0) == -1 && grid_at(&v.surface, 255, -1, 127, 0) == -3);
    assert_true(grid_at(&v.surface, -1, 8191, 4095, 0) == -4 && grid_at(&v.surface, -1, -1, -1, 0) == 7);
    int seen[13] = {0};
    for (int i = 0; i < v.surface.ntile; i++) seen[v.surface.tile[i].log2side]++;
    assert_true(seen[3] == 2 && seen[7] == 1 && seen[12] == 1 && v.surface.ntile == 4);
    volume_free(&v);
}

static void reads_every_affine_transform(void **)
{
    using namespace openvdb::math;
    const double shear[16] = {0.5, 0.1, 0, 0, -0.2, 0.4, 0.3, 0, 0, 0.05, -0.7, 0, 3, -2, 11, 1};
    Transform::Ptr all[] = {
        Transform::createLinearTransform(0.25),
        Transform::createLinearTransform(openvdb::Mat4R(shear)),
        Transform::Ptr(new Transform(MapBase::Ptr(new ScaleMap(openvdb::Vec3d(1, -2, 3))))),
        Transform::Ptr(new Transform(MapBase::Ptr(new TranslationMap(openvdb::Vec3d(1, 2, 3))))),
        Transform::Ptr(new Transform(MapBase::Ptr(new ScaleTranslateMap(openvdb::Vec3d(1, 2, 3), openvdb::Vec3d(4, 5, 6))))),
        Transform::Ptr(new Transform(MapBase::Ptr(new UniformScaleTranslateMap(2, openvdb::Vec3d(4, 5, 6))))),
        Transform::Ptr(new Transform(MapBase::Ptr(new UnitaryMap(openvdb::Vec3d(0, 1, 1), 0.7)))),
    };
    for (const Transform::Ptr &t : all) {
        auto g = small("phi");
        g->setTransform(t);
        Volume v;
        read_volume(write_file({g}), nullptr, nullptr, &v);
        expect_same(*g, &v.surface);
        volume_free(&v);
    }
    auto g = small("phi");
    g->setTransform(Transform::createFrustumTransform(openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(9)), 0.5, 4));
    expect_refused(write_file({g}), nullptr, nullptr, "resample");
    /* a scale that OpenVDB would not write: 0, or no number at all */
    g->setTransform(Transform::createLinearTransform(0.25));
    std::vector<char> bytes = load(write_file({g}));
    const std::string map = "UniformScaleMap";
    const auto scale = std::search(bytes.begin(), bytes.end(), map.begin(), map.end()) + std::ptrdiff_t(map.size());
    for (int fill : {0, 0xff}) {
        std::fill(scale, scale + 8, static_cast<char>(fill));
        expect_refused(temp_write("a.vdb", bytes.data(), bytes.size()), nullptr, nullptr, "without an inverse");
    }
}

static void chooses_grids_by_name(void **)
{
    auto ints = openvdb::Int32Grid::create();
    ints->setName("flags");
    const std::string one = write_file({ints, small("whatever"), small_vectors("v")}, 0, "one.vdb");
    Volume v;
    read_volume(one, nullptr, nullptr, &v);
    assert_string_equal(v.name, "whatever");
    assert_false(v.has_velocity);
    volume_free(&v);
    expect_refused(one, "flags", nullptr, "scalar grids: whatever");
    expect_refused(one, "phi", nullptr, "scalar grids: whatever");
    expect_refused(one, nullptr, "vel", "vector grids: v");
    expect_refused(one, nullptr, "whatever", "vector grids: v");
    const std::string many = write_file({small("density"), small("b"), small("phi"), small("b")}, 0, "many.vdb");
    read_volume(many, nullptr, nullptr, &v);
    assert_string_equal(v.name, "phi");
    volume_free(&v);
    read_volume(many, "b", nullptr, &v);
    assert_string_equal(v.name, "b[0]");
    volume_free(&v);
    expect_refused(write_file({small("a"), small("b")}, 0, "ask.vdb"), nullptr, nullptr, "--grid: a, b");
    expect_refused(write_file({ints}, 0, "none.vdb"), nullptr, nullptr, "no scalar grid");
    expect_refused(write_file({}, 0, "nothing.vdb"), nullptr, nullptr, "no scalar grid");
    expect_refused(temp_path("absent.vdb"), nullptr, nullptr, "no such file");
    auto odd = small("a\nb\x1b[31m");
    expect_refused(write_file({odd, small("c")}, 0, "odd.vdb"), nullptr, nullptr, "a?b?[31m, c");
}

static void knows_classes(void **)
{
    const struct {
        openvdb::GridClass grid_class;
        const char *name;
        VolumeClass kind;
    } cases[] = {{openvdb::GRID_LEVEL_SET, "density", VOLUME_LEVEL_SET}, {openvdb::GRID_FOG_VOLUME, "phi", VOLUME_DENSITY},
                 {openvdb::GRID_UNKNOWN, "density", VOLUME_DENSITY},     {openvdb::GRID_UNKNOWN, "sdf", VOLUME_LEVEL_SET},
                 {openvdb::GRID_UNKNOWN, "x", VOLUME_LEVEL_SET} /* both signs */};
    for (const auto &c : cases) {
        auto g = small(c.name);
        g->setGridClass(c.grid_class);
        Volume v;
        read_volume(write_file({g}), nullptr, nullptr, &v);
        assert_int_equal(v.kind, c.kind);
        volume_free(&v);
    }
}

static void empty_grids_are_frames_without_surface(void **)
{
    auto g = FloatGrid::create(3);
    auto v3 = openvdb::Vec3SGrid::create();
    g->setName("phi");
    v3->setName("v");
    for (bool tile : {false, true}) {
        if (tile) g->tree().addTile(1, Coord(0), 3, false);
        Volume v;
        read_volume(write_file({g, v3}), nullptr, "v", &v);
        assert_true(grid_is_empty(&v.surface) && grid_is_empty(&v.velocity) && v.has_velocity);
        assert_true(v.surface.background[0] == 3 && v.surface.ntile == 0);
        volume_free(&v);
    }
}

static void joins_staggered_velocities(void **)
{
    auto mac = small_vectors("mac");
    mac->setGridClass(openvdb::GRID_STAGGERED);
    Grids grids = {small("phi"), mac};
    const char *const names[3] = {"vel.x", "vel.y", "vel.z"};
    for (int k = 0; k < 3; k++) { /* as Houdini writes them: each moved half a voxel down its axis */
        auto g = FloatGrid::create(float(k));
        g->setName(names[k]);
        g->tree().addTile(2, Coord(0, 0, 128 * k), float(10 + k), true);
        g->tree().setValue(Coord(k, 2, 130), float(20 + k));
        openvdb::Vec3d shift(0, 0, 0);
        shift[k] = -0.25;
        g->setTransform(openvdb::math::Transform::Ptr(new openvdb::math::Transform(
            openvdb::math::MapBase::Ptr(new openvdb::math::UniformScaleTranslateMap(0.5, openvdb::Vec3d(1, 2, 3) + shift)))));
        grids.push_back(g);
    }
    const std::string path = write_file(grids);
    Volume v;
    read_volume(path, "phi", "mac", &v);
    assert_true(v.velocity.staggered);
    expect_same(*mac, &v.velocity);
    volume_free(&v);
    read_volume(path, "phi", "vel", &v);
    assert_true(v.velocity.staggered);
    assert_true(fabs(v.velocity.xform.t.x - 1) < 1e-12 && fabs(v.velocity.xform.t.z - 3) < 1e-12);
    for (int k = 0; k < 3; k++) {
        auto access = openvdb::gridPtrCast<FloatGrid>(grids[size_t(2 + k)])->getConstAccessor();
        for (int z = -20; z < 400; z += 3)
            for (int x = -2; x < 140; x++)
                if (access.getValue(Coord(x, 2, z)) != grid_at(&v.velocity, x, 2, z, k)) fail_msg("component %d at (%d, 2, %d)", k, x, z);
    }
    volume_free(&v);
    grids[4]->setTransform(openvdb::math::Transform::createLinearTransform(0.75));
    expect_refused(write_file(grids), "phi", "vel", "different transforms");
}

static void reads_instances_and_streams(void **)
{
    auto a = sphere("a"), b = openvdb::gridPtrCast<FloatGrid>(a->copyGrid());
    b->setName("b");
    b->setTransform(openvdb::math::Transform::createLinearTransform(0.125));
    auto ints = openvdb::Int32Grid::create(4);
    ints->setName("flags");
    ints->tree().setValue(Coord(1), 2);
    const Grids grids = {ints, a, b, small_vectors("v")};
    const std::string plain = write_file(grids), streamed = temp_path("s.vdb");
    std::ofstream out(streamed, std::ios::binary);
    openvdb::io::Stream(out).write(grids);
    out.close();
    for (const std::string &path : {plain, streamed}) {
        Volume v;
        read_volume(path, "b", "v", &v);
        expect_same(*b, &v.surface);
        volume_free(&v);
    }
    const std::vector<char> whole = load(streamed);
    for (size_t n = 0; n < whole.size(); n += n < 120 ? 1 : whole.size() / 50)
        expect_refused(temp_write("t.vdb", whole.data(), n), "b", "v", ": ");
}

static void refuses_files_cut_short(void **)
{
    using namespace openvdb::io;
    for (uint32_t c : {uint32_t(COMPRESS_NONE), uint32_t(COMPRESS_ZIP), uint32_t(COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK)}) {
        auto g = sphere("phi", 8);
        const std::vector<char> whole = load(write_file({small_vectors("v"), g}, c));
        for (size_t n = 0; n < whole.size(); n += n < 300 ? 1 : whole.size() / 100)
            expect_refused(temp_write("t.vdb", whole.data(), n), nullptr, nullptr, ": ");
        for (size_t n = 1; n < 20; n++) expect_refused(temp_write("t.vdb", whole.data(), whole.size() - n), nullptr, nullptr, "cut short");
    }
}

/* Whatever bytes are changed: a sentence or a grid, and nothing beyond the buffers (the sanitizers look on). */
static void survives_changed_bytes(void **)
{
    using namespace openvdb::io;
    std::mt19937 random(5);
    for (uint32_t c : {uint32_t(COMPRESS_NONE), uint32_t(COMPRESS_ZIP), uint32_t(COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK)}) {
        const std::vector<char> whole = load(write_file({small("phi"), small_vectors("v")}, c));
        for (int t = 0; t < 60; t++) {
            std::vector<char> changed = whole;
            for (unsigned i = 0; i < 1 + random() % 4; i++) {
                const size_t at = random() % (random() % 2 ? changed.size() : 2000);
                for (size_t k = at; k < at + 1 + 3 * (random() % 2) && k < changed.size(); k++)
                    changed[k] = static_cast<char>(random() % 2 ? 0xff : random());
            }
            VolumeRequest r = {};
            r.velocity = "v";
            Volume v;
            Err err = {};
            if (volume_read(temp_write("t.vdb", changed.data(), changed.size()), &r, &v, &err)) volume_free(&v);
            else assert_true(err.code != ERR_NONE && err.text[0] && !strchr(err.text, '\n'));
        }
    }
}

/* OpenVDB 10 would read as many bytes as such a chunk claims into a buffer of 512 samples. */
static void refuses_chunks_of_another_size(void **)
{
    auto g = small("phi");
    std::vector<char> whole = load(write_file({g}, openvdb::io::COMPRESS_BLOSC));
    VdbToc toc;
    Err err = {};
    assert_true(vdb_toc_open(&toc, temp_path("a.vdb"), &err));
    VdbTree tree;
    assert_true(vdb_tree_load(&toc, 0, &tree, &err));
    const size_t at = tree.tree_at + 4 + 4 + 8 + 12 + 2 * 4096 + 1; /* the length of the first node's chunk */
    uint8_t *chunk = tree.data + at;
    size_t used;
    for (int64_t claimed : {int64_t(-32768 * 4 - 4), int64_t(-1), INT64_MIN, INT64_MAX, int64_t(0), int64_t(1), int64_t(15)}) {
        memcpy(chunk, &claimed, 8);
        assert_false(vdb_walk(&tree, &used, &err));
    }
    vdb_tree_free(&tree);
    vdb_toc_close(&toc);
}

static void refuses_what_lies_too_far(void **)
{
    auto g = small("phi");
    g->tree().setValue(Coord(0, 1 << 20, 0), 1);
    expect_refused(write_file({g}), nullptr, nullptr, "beyond +-2^20");
    auto h = small("phi");
    h->tree().addTile(3, Coord(INT32_MIN, 0, 0), 1, true);
    expect_refused(write_file({h}), nullptr, nullptr, "beyond +-2^20");
    std::vector<char> old = load(write_file({small("phi")}));
    old[8] = char(221);
    expect_refused(temp_write("old.vdb", old.data(), old.size()), nullptr, nullptr, "old OpenVDB format 221");
    expect_refused(temp_write("no.vdb", "something else altogether", 25), nullptr, nullptr, "no OpenVDB file");
}

static int start(void **state)
{
    openvdb::initialize();
    return temp_open(state);
}

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_every_compression_and_precision),
        cmocka_unit_test(reads_tiles_of_every_level),
        cmocka_unit_test(reads_every_affine_transform),
        cmocka_unit_test(chooses_grids_by_name),
        cmocka_unit_test(knows_classes),
        cmocka_unit_test(empty_grids_are_frames_without_surface),
        cmocka_unit_test(joins_staggered_velocities),
        cmocka_unit_test(reads_instances_and_streams),
        cmocka_unit_test(refuses_files_cut_short),
        cmocka_unit_test(survives_changed_bytes),
        cmocka_unit_test(refuses_chunks_of_another_size),
        cmocka_unit_test(refuses_what_lies_too_far),
    };
    return cmocka_run_group_tests(tests, start, temp_close);
}
