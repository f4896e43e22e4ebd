/* Particles from files: what OpenVDB writes is read alike, in each codec; what is cut short or damaged is refused. */
#include <openvdb/openvdb.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointGroup.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <vector>

extern "C" {
#include "io/points.h"
#include "temp_dir.h"
#include <cmocka.h>
}

using namespace openvdb;

constexpr float VOXEL = 0.25f;

static std::vector<Vec3s> some_points(size_t n)
{
    std::mt19937 random(7);
    std::vector<Vec3s> p;
    for (size_t i = 0; i < n; i++) {
        const auto next = [&] { return float(random() % 4000) / 500 - 3; };
        const float x = next(), y = next(), z = next();
        p.emplace_back(x, y, z);
    }
    return p;
}

template <typename Codec> static points::PointDataGrid::Ptr cloud(const std::vector<Vec3s> &places, bool radii, const char *name = "points")
{
    points::PointAttributeVector<Vec3s> wrapper(places);
    const auto transform = math::Transform::createLinearTransform(VOXEL);
    transform->postTranslate(Vec3d(1, 2, 3));
    const auto index = tools::createPointIndexGrid<tools::PointIndexGrid>(wrapper, *transform);
    const auto grid = points::createPointDataGrid<Codec, points::PointDataGrid>(*index, wrapper, *transform);
    grid->setName(name);
    points::appendAttribute<int32_t>(grid->tree(), "id");
    if (radii) {
        std::vector<float> radius;
        for (const auto &p : places) radius.push_back(0.1f + std::abs(p.x()));
        const points::PointAttributeVector<float> values(radius);
        points::appendAttribute<float>(grid->tree(), "pscale");
        points::populateAttribute<points::PointDataTree, tools::PointIndexTree, points::PointAttributeVector<float>>(grid->tree(), index->tree(), "pscale", values);
        points::appendGroup(grid->tree(), "spray");
    }
    return grid;
}

static std::string write_file(const GridPtrVec &grids, uint32_t compression = io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK)
{
    const std::string path = temp_path("a.vdb");
    io::File file(path);
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

static void save(const char *path, const std::vector<char> &bytes)
{
    std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

static void expect_refused(const std::string &path, const char *grid, const char *word)
{
    PointSet p;
    Err err = {};
    assert_false(points_read(path.c_str(), grid, &p, &err));
    assert_int_equal(err.code, ERR_INPUT);
    if (!strstr(err.text, word)) fail_msg("'%s' is not in: %s", word, err.text);
    assert_null(p.place);
    assert_null(p.radius);
}

static bool before(const Vec3 &a, const Vec3 &b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

/* The same places in any order, each within `slack`. */
static void expect_points(const std::string &path, std::vector<Vec3s> places, double slack, bool radii)
{
    PointSet p;
    Err err = {};
    if (!points_read(path.c_str(), nullptr, &p, &err)) fail_msg("%s", err.text);
    assert_int_equal(p.n, int(places.size()));
    std::vector<Vec3> want;
    for (const auto &q : places) want.push_back(vec3(double(q.x()), double(q.y()), double(q.z())));
    for (int i = 0; i < p.n; i++) {
        double nearest = 1e9;
        for (const auto &q : want) nearest = std::min(nearest, v_dist(q, p.place[i]));
        assert_true(nearest <= slack);
        if (radii) assert_true(std::abs(double(p.radius[i]) - 0.1 - std::abs(p.place[i].x)) <= slack + 1e-6);
    }
    if (!radii) assert_null(p.radius);
    if (slack < 1e-5) { /* none is there twice, none is missing */
        std::vector<Vec3> got(p.place, p.place + p.n);
        std::sort(want.begin(), want.end(), before);
        std::sort(got.begin(), got.end(), before);
        for (int i = 0; i < p.n; i += 7) assert_true(v_dist(want[size_t(i)], got[size_t(i)]) < 2e-2);
    }
    assert_true(std::abs(p.voxel - double(VOXEL)) < 1e-9);
    points_free(&p);
}

static void each_codec_is_read(void **)
{
    const auto places = some_points(700);
    expect_points(write_file({cloud<points::NullCodec>(places, false)}), places, 2e-6, false);
    expect_points(write_file({cloud<points::NullCodec>(places, true)}), places, 2e-6, true);
    expect_points(write_file({cloud<points::FixedPointCodec<false>>(places, true)}), places, 2e-5, true);
    expect_points(write_file({cloud<points::FixedPointCodec<true>>(places, false)}), places, 2e-3, false);
}

static void each_compression_is_read(void **)
{
    const auto places = some_points(300);
    for (const uint32_t c : {uint32_t(io::COMPRESS_NONE), uint32_t(io::COMPRESS_ACTIVE_MASK), uint32_t(io::COMPRESS_ZIP), uint32_t(io::COMPRESS_BLOSC)})
        expect_points(write_file({cloud<points::NullCodec>(places, true)}, c), places, 2e-6, true);
}

/* Several thousand points in one voxel fill pages; a single one is not compressed. */
static void crowds_and_single_points_are_read(void **)
{
    std::vector<Vec3s> crowd(300000, Vec3s(1.1f, 2.1f, 3.1f));
    PointSet p;
    Err err = {};
    const std::string path = write_file({cloud<points::NullCodec>(crowd, false)});
    if (!points_read(path.c_str(), "points", &p, &err)) fail_msg("%s", err.text);
    assert_int_equal(p.n, 300000);
    for (int i = 0; i < p.n; i += 1000) assert_true(v_dist(p.place[i], vec3(1.1, 2.1, 3.1)) < 1e-6);
    points_free(&p);
    expect_points(write_file({cloud<points::NullCodec>({Vec3s(-2, 5, 1)}, true)}), {Vec3s(-2, 5, 1)}, 1e-6, true);
    const auto none = points::PointDataGrid::create();
    none->setName("none");
    const std::string empty = write_file({none});
    assert_true(points_read(empty.c_str(), nullptr, &p, &err));
    assert_int_equal(p.n, 0);
    points_free(&p);
}

static void the_grid_is_chosen_by_name(void **)
{
    const auto few = some_points(20), many = some_points(40);
    const auto level_set = FloatGrid::create(1);
    level_set->setName("phi");
    const std::string one = write_file({level_set, cloud<points::NullCodec>(few, false)});
    expect_points(one, few, 2e-6, false);
    expect_refused(one, "phi", "'phi'");
    const std::string two = write_file({cloud<points::NullCodec>(few, false, "a"), cloud<points::NullCodec>(many, false, "b")});
    expect_refused(two, nullptr, "--points");
    PointSet p;
    Err err = {};
    assert_true(points_read(two.c_str(), "b", &p, &err));
    assert_int_equal(p.n, 40);
    points_free(&p);
    expect_refused(write_file({level_set}), nullptr, "no point grid");
}

static void what_is_cut_short_is_refused(void **)
{
    const auto bytes = load(write_file({cloud<points::NullCodec>(some_points(40), true)}));
    const char *path = temp_path("cut.vdb");
    for (size_t n = 0; n < bytes.size(); n += n < 3000 || n + 3000 > bytes.size() ? 13 : 211) {
        save(path, std::vector<char>(bytes.begin(), bytes.begin() + long(n)));
        PointSet p;
        Err err = {};
        assert_false(points_read(path, nullptr, &p, &err));
        assert_int_equal(err.code, ERR_INPUT);
    }
}

/* Whatever a byte is turned into: read, or refused with a sentence, and nothing beyond the buffers (under ASan). */
static void damage_does_no_harm(void **)
{
    const auto whole = load(write_file({cloud<points::FixedPointCodec<false>>(some_points(60), true)}));
    const char *path = temp_path("hurt.vdb");
    std::mt19937 random(11);
    int refused = 0;
    for (int i = 0; i < 3000; i++) {
        auto bytes = whole;
        for (int k = 0; k < 1 + i % 3; k++) bytes[random() % bytes.size()] = char(i % 2 ? random() : random() % 2 ? 255 : 0);
        save(path, bytes);
        PointSet p;
        Err err = {};
        if (points_read(path, nullptr, &p, &err)) points_free(&p);
        else refused += err.code == ERR_INPUT && err.text[0];
    }
    assert_true(refused > 200);
}

static void npy_points_are_read(void **)
{
    const auto write = [](const char *header, const void *data, size_t size) {
        std::vector<char> b = {'\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0, char(strlen(header)), 0};
        b.insert(b.end(), header, header + strlen(header));
        b.insert(b.end(), static_cast<const char *>(data), static_cast<const char *>(data) + size);
        save(temp_path("p.npy"), b);
        return std::string(temp_path("p.npy"));
    };
    const float rows[6] = {1, 2, 3, 4, 5, 6}, columns[6] = {1, 4, 2, 5, 3, 6};
    const double wide[6] = {1, 2, 3, 4, 5, 6};
    const std::string paths[] = {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }",
                                 "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }"};
    for (int i = 0; i < 3; i++) {
        const std::string path = write(paths[i].c_str(), i == 0 ? static_cast<const void *>(rows) : i == 1 ? columns : static_cast<const void *>(wide), i < 2 ? sizeof rows : sizeof wide);
        assert_true(points_are_in(path.c_str()));
        PointSet p;
        Err err = {};
        if (!points_read(path.c_str(), nullptr, &p, &err)) fail_msg("%s", err.text);
        assert_int_equal(p.n, 2);
        assert_true(p.place[0].x == 1 && p.place[0].z == 3 && p.place[1].x == 4 && p.place[1].y == 5 && !p.radius && p.voxel == 0);
        points_free(&p);
    }
    expect_refused(write(paths[0].c_str(), rows, sizeof rows - 4), nullptr, "do not fit");
    expect_refused(write("{'descr': '<f4', 'fortran_order': False, 'shape': (4294967298, 3), }", rows, sizeof rows), nullptr, "do not fit");
    const std::string four = write("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 6), }", rows, sizeof rows);
    assert_false(points_are_in(four.c_str()));
    expect_refused(four, nullptr, "n x 3");
    const float bad[3] = {1, std::nanf(""), 2};
    expect_refused(write("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }", bad, sizeof bad), nullptr, "no finite place");
}

static void ply_points_are_read(void **)
{
    const char text[] = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float pscale\nend_header\n"
                        "1 2 3 0.5\n4 5 6 0.25\n";
    const char *path = temp_path("p.ply");
    save(path, std::vector<char>(text, text + sizeof text - 1));
    assert_true(points_are_in(path));
    PointSet p;
    Err err = {};
    if (!points_read(path, nullptr, &p, &err)) fail_msg("%s", err.text);
    assert_int_equal(p.n, 2);
    assert_true(p.place[1].y == 5 && p.radius && p.radius[0] == 0.5f && p.radius[1] == 0.25f);
    points_free(&p);
    std::string flat(text);
    flat.replace(flat.find("0.25"), 4, "0.00");
    save(path, std::vector<char>(flat.begin(), flat.end()));
    expect_refused(path, nullptr, "radius");
}

static int open_all(void **state)
{
    openvdb::initialize();
    return temp_open(state);
}

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(each_codec_is_read),
        cmocka_unit_test(each_compression_is_read),
        cmocka_unit_test(crowds_and_single_points_are_read),
        cmocka_unit_test(the_grid_is_chosen_by_name),
        cmocka_unit_test(what_is_cut_short_is_refused),
        cmocka_unit_test(damage_does_no_harm),
        cmocka_unit_test(npy_points_are_read),
        cmocka_unit_test(ply_points_are_read),
    };
    return cmocka_run_group_tests(tests, open_all, temp_close);
}
