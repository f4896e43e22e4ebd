/* Animated glTF: the files are loaded with tinygltf and played by a few lines of our own; at every frame the
 * visible nodes together must be that frame's mesh. */
#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <csignal>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>
#include <dirent.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <tiny_gltf.h>

extern "C" {
#include "io/gltf_priv.h"
#include <cmocka.h>
}

static std::string folder;

static int set_up(void **)
{
    char name[] = "/tmp/twinmesh.gltf.XXXXXX";
    if (!mkdtemp(name)) return -1;
    folder = name;
    return 0;
}

static std::vector<std::string> files()
{
    std::vector<std::string> names;
    DIR *dir = opendir(folder.c_str());
    while (struct dirent *entry = readdir(dir))
        if (entry->d_name[0] != '.') names.push_back(entry->d_name);
    closedir(dir);
    std::sort(names.begin(), names.end());
    return names;
}

static int clear_files(void **)
{
    for (const std::string &name : files()) remove((folder + "/" + name).c_str());
    return 0;
}

static int tear_down(void **state)
{
    clear_files(state);
    return rmdir(folder.c_str());
}

/* --- sequences -------------------------------------------------------------------------------------- */

/* What a frame shows: a fan of `sides` triangles (0: nothing; -1: a frame that was skipped). */
typedef std::vector<int> Script;

static void fan_place(int sides, double time, float *pos, float *normal)
{
    for (int v = 0; v <= sides; v++) {
        double a = 2 * 3.14159265358979 * v / (sides ? sides : 1) + time, r = v == sides ? 0 : 1 + time;
        double p[3] = {3 * time + r * cos(a), r * sin(a), 0.25 * time}, n[3] = {sin(time), 0, cos(time)};
        for (int k = 0; k < 3; k++) {
            pos[3 * v + k] = float(p[k]);
            normal[3 * v + k] = float(n[k]);
        }
    }
}

/* A wheel has sides + 1 vertices, the hub last. */
static TriMesh fan(int sides, double time, int32_t first_id)
{
    TriMesh m;
    trimesh_init(&m, sides ? sides + 1 : 0, sides, true, false);
    if (sides) fan_place(sides, time, m.pos, m.normal);
    for (int v = 0; v < m.nvert; v++) {
        m.id[v] = first_id + v;
        for (int k = 0; k < 3; k++) m.velocity[3 * v + k] = float(k + time);
    }
    for (int t = 0; t < sides; t++) {
        m.tri[3 * t] = t;
        m.tri[3 * t + 1] = (t + 1) % sides;
        m.tri[3 * t + 2] = sides;
    }
    static const char *const name[] = {"my grid", "id"};
    m.nattr = 2;
    m.attr_name = NEW(char *, 2);
    m.attr = NEW(float *, 2);
    for (int a = 0; a < 2; a++) {
        m.attr_name[a] = mem_text(name[a]);
        m.attr[a] = NEW(float, m.nvert);
        for (int v = 0; v < m.nvert; v++) m.attr[a][v] = float(a + v + time);
    }
    return m;
}

struct Limits {
    uint64_t part, glb;
};

static int warnings;
static void count_warning(const char *) { warnings++; }

static GltfCompress compress; /* of what is started */

static Gltf *start(const std::string &path, double fps, bool step, Err *err)
{
    GltfOptions options = {};
    options.path = path.c_str();
    options.fps = fps;
    options.name = "geometric";
    options.step = step;
    options.compress = compress;
    options.warn = count_warning;
    return gltf_open(&options, err);
}

/* Gives the frames of the script, from one of them on; false after the first failure. */
static bool play_in(Gltf *g, const Script &script, double fps, int32_t first_id, Err *err, size_t from = 0, size_t until = SIZE_MAX)
{
    int gap = 1, last = 0;
    for (size_t k = 0; k < script.size() && k < until; k++) {
        int sides = script[k];
        if (k < from) {
            if (sides >= 0) last = sides;
            gap = sides < 0 ? gap + 1 : 1;
            continue;
        }
        if (sides < 0) {
            gap++;
            continue;
        }
        TriMesh m = fan(sides, double(k) / fps, first_id);
        std::vector<float> pos(size_t(3 * (last + 1))), normal(pos);
        bool carried = last > 0 && sides != last;
        if (carried) fan_place(last, double(k) / fps, pos.data(), normal.data());
        bool ok = gltf_add_frame(g, &m, carried ? pos.data() : nullptr, carried ? normal.data() : nullptr,
                                 gap, err);
        trimesh_free(&m);
        if (!ok) return false;
        last = sides;
        gap = 1;
    }
    return true;
}

static GltfStat write(const std::string &path, const Script &script, double fps, bool step = false,
                      int32_t first_id = 0, Limits limits = {GLTF_PART_BYTES, GLTF_GLB_BYTES})
{
    Err err = {};
    Gltf *g = start(path, fps, step, &err);
    assert_non_null(g);
    g->part_bytes = limits.part;
    g->glb_bytes = limits.glb;
    assert_true(play_in(g, script, fps, first_id, &err));
    GltfStat stat = gltf_stat(g);
    bool ok = gltf_close(g, &err);
    if (!ok) print_message("%s\n", err.text);
    assert_true(ok);
    return stat;
}

/* --- a small player ----------------------------------------------------------------------------------- */

static tinygltf::Model load(const std::string &path)
{
    tinygltf::Model model;
    tinygltf::TinyGLTF loader;
    std::string error, warning;
    bool binary = path.substr(path.size() - 4) == ".glb";
    bool ok = binary ? loader.LoadBinaryFromFile(&model, &error, &warning, path)
                     : loader.LoadASCIIFromFile(&model, &error, &warning, path);
    if (!ok) print_message("%s %s\n", error.c_str(), warning.c_str());
    assert_true(ok);
    return model;
}

static const uint8_t *data_of(const tinygltf::Model &m, int accessor)
{
    const tinygltf::Accessor &a = m.accessors.at(size_t(accessor));
    const tinygltf::BufferView &v = m.bufferViews.at(size_t(a.bufferView));
    size_t row = size_t(tinygltf::GetComponentSizeInBytes(uint32_t(a.componentType))) *
                 size_t(tinygltf::GetNumComponentsInType(uint32_t(a.type)));
    assert_true(a.byteOffset + a.count * row <= v.byteLength);
    assert_true(v.byteOffset + v.byteLength <= m.buffers.at(size_t(v.buffer)).data.size());
    assert_int_equal((v.byteOffset + a.byteOffset) % 4, 0);
    return m.buffers[size_t(v.buffer)].data.data() + v.byteOffset + a.byteOffset;
}

static std::vector<float> floats(const tinygltf::Model &m, int accessor)
{
    const tinygltf::Accessor &a = m.accessors.at(size_t(accessor));
    assert_int_equal(a.componentType, GLTF_F32);
    std::vector<float> v(a.count * size_t(tinygltf::GetNumComponentsInType(uint32_t(a.type))));
    memcpy(v.data(), data_of(m, accessor), 4 * v.size()); /* the tests run on little-endian machines */
    return v;
}

/* One row of a sampler's output at time t. */
static std::vector<double> sample(const tinygltf::Model &m, const tinygltf::AnimationSampler &s, float t)
{
    std::vector<float> key = floats(m, s.input), value = floats(m, s.output);
    size_t width = value.size() / key.size(), k = 0;
    while (k + 1 < key.size() && key[k + 1] <= t) k++;
    double f = 0;
    if (s.interpolation == "LINEAR" && k + 1 < key.size() && t > key[k])
        f = double(t - key[k]) / double(key[k + 1] - key[k]);
    std::vector<double> row(width);
    for (size_t i = 0; i < width; i++)
        row[i] = value[k * width + i] + (f > 0 ? f * (value[(k + 1) * width + i] - value[k * width + i]) : 0);
    return row;
}

struct Shown {
    int nodes = 0, triangles = 0;
    std::vector<double> pos, normal;
};

static Shown show(const tinygltf::Model &m, float t)
{
    Shown all;
    for (size_t n = 0; n < m.nodes.size(); n++) {
        double scale = m.nodes[n].scale.empty() ? 1 : m.nodes[n].scale[0];
        std::vector<double> weight;
        for (const tinygltf::Animation &animation : m.animations)
            for (const tinygltf::AnimationChannel &c : animation.channels) {
                if (c.target_node != int(n)) continue;
                const tinygltf::AnimationSampler &s = animation.samplers.at(size_t(c.sampler));
                if (c.target_path == "scale") scale = sample(m, s, t)[0];
                if (c.target_path == "weights") weight = sample(m, s, t);
            }
        if (scale == 0) continue;
        const tinygltf::Primitive &p = m.meshes.at(size_t(m.nodes[n].mesh)).primitives.at(0);
        for (const char *name : {"POSITION", "NORMAL"}) {
            std::vector<float> base = floats(m, p.attributes.at(name));
            std::vector<double> sum(base.begin(), base.end());
            for (size_t k = 0; k < weight.size(); k++) {
                std::vector<float> target = floats(m, p.targets.at(k).at(name));
                for (size_t i = 0; i < sum.size(); i++) sum[i] += weight[k] * target[i];
            }
            std::vector<double> &to = name[0] == 'P' ? all.pos : all.normal;
            to.insert(to.end(), sum.begin(), sum.end());
        }
        all.nodes++;
        all.triangles += int(m.accessors.at(size_t(p.indices)).count / 3);
    }
    return all;
}

static void assert_frames_equal(const tinygltf::Model &m, const Script &script, double fps)
{
    for (size_t k = 0; k < script.size(); k++) {
        Shown s = show(m, float(double(k) / fps));
        int sides = script[k] > 0 ? script[k] : 0;
        assert_int_equal(s.nodes, sides > 0);
        assert_int_equal(s.triangles, sides);
        TriMesh mesh = fan(sides, double(k) / fps, 0);
        assert_int_equal(s.pos.size(), 3 * size_t(mesh.nvert));
        for (size_t i = 0; i < s.pos.size(); i++) {
            assert_true(fabs(s.pos[i] - double(mesh.pos[i])) < 2e-5);
            assert_true(fabs(s.normal[i] - double(mesh.normal[i])) < 2e-5);
        }
        trimesh_free(&mesh);
    }
}

/* What section "What to test" asks of every file, whatever it shows. */
static void assert_well_formed(const tinygltf::Model &m, int frames, double fps)
{
    for (const tinygltf::BufferView &v : m.bufferViews) assert_int_equal(v.byteOffset % 4, 0);
    for (const tinygltf::Mesh &mesh : m.meshes) {
        const tinygltf::Primitive &p = mesh.primitives.at(0);
        assert_int_equal(p.mode, TINYGLTF_MODE_TRIANGLES);
        assert_true(p.targets.size() <= GLTF_TARGETS);
        std::vector<int> ranged = {p.attributes.at("POSITION")};
        for (const auto &target : p.targets) {
            assert_int_equal(target.size(), 2);
            ranged.push_back(target.at("POSITION"));
        }
        for (int a : ranged) {
            std::vector<float> v = floats(m, a);
            for (size_t k = 0; k < 3; k++) {
                double lo = 1e30, hi = -1e30;
                for (size_t i = k; i < v.size(); i += 3)
                    lo = std::min(lo, double(v[i])), hi = std::max(hi, double(v[i]));
                assert_true(m.accessors[size_t(a)].minValues.at(k) == lo &&
                            m.accessors[size_t(a)].maxValues.at(k) == hi);
            }
        }
    }
    if (frames <= 1) assert_true(m.animations.empty());
    double end = 0;
    for (const tinygltf::Animation &animation : m.animations)
        for (const tinygltf::AnimationSampler &s : animation.samplers) {
            std::vector<float> key = floats(m, s.input);
            assert_true(m.accessors[size_t(s.input)].minValues.at(0) == key.front());
            assert_true(m.accessors[size_t(s.input)].maxValues.at(0) == key.back());
            for (size_t i = 0; i < key.size(); i++) {
                assert_true(i == 0 || key[i] > key[i - 1]);
                double frame = std::round(key[i] * fps);
                assert_true(key[i] <= frame / fps &&
                            std::nextafter(key[i], 1e30f) > frame / fps); /* toward zero */
            }
            end = std::max(end, double(key.back()));
        }
    if (!m.animations.empty()) assert_true(std::round(end * fps) == frames);
}

static void assert_plays(const std::string &name, const Script &script, double fps, bool step = false)
{
    std::string path = folder + "/" + name;
    write(path, script, fps, step);
    tinygltf::Model m = load(path);
    assert_well_formed(m, int(script.size()), fps);
    assert_frames_equal(m, script, fps);
    for (const std::string &file : files()) assert_true(file.find(".part") == std::string::npos);
}

/* --- tests ------------------------------------------------------------------------------------------------
 */

static Script repeat(int sides, int n) { return Script(size_t(n), sides); }

static Script operator+(Script a, const Script &b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

static void one_run_is_cut_into_pieces(void **)
{
    for (int n : {2, 3, 8, 9, 10, 16, 17, 18, 25}) assert_plays("a.glb", repeat(5, n), 25);
    write(folder + "/a.glb", repeat(5, 25), 25);
    tinygltf::Model m = load(folder + "/a.glb");
    assert_int_equal(m.meshes.size(), 3); /* 0..8, 8..16, 16..24 */
    assert_int_equal(m.meshes[0].primitives[0].indices, m.meshes[2].primitives[0].indices);
    assert_int_equal(m.meshes[0].primitives[0].attributes["_ID"],
                     m.meshes[2].primitives[0].attributes["_ID"]);
    assert_int_equal(m.meshes[2].primitives[0].targets.size(), 8);
    assert_true(m.nodes[0].scale.empty());
    assert_true(m.nodes[1].scale == std::vector<double>(3, 0.0));
}

static void connectivity_may_change_at_any_frame(void **)
{
    assert_plays("a.glb", {3, 4, 5, 5, 4}, 24);
    for (int n = 1; n < 11; n++) assert_plays("a.glb", repeat(6, n) + repeat(7, 11 - n) + repeat(6, n), 24);
}

static void empty_and_skipped_frames_show_nothing(void **)
{
    assert_plays("a.glb", {5, 5, 0, 0, 4, 4}, 24);
    assert_plays("a.glb", {5, 5, -1, -1, 5, 5, 5}, 24);
    assert_plays("a.glb", {-1, -1, 5, 5}, 24);
    assert_plays("a.glb", {0, 5}, 24);
    assert_plays("a.glb", {5, 0, 0}, 24);
    assert_plays("a.glb", {0, 0, 0}, 24);
    assert_plays("a.glb", {0}, 24);
    assert_plays("a.glb", {}, 24);
}

static void long_mixture_plays_at_odd_rates(void **)
{
    Script s = repeat(5, 30) + Script{4, 3, 8, 0} + repeat(9, 9) + Script{-1} + repeat(9, 17) + repeat(4, 60);
    for (double fps : {24.0, 25.0, 29.97, 59.94, 1.0}) {
        assert_plays("a.glb", s, fps);
        assert_plays("a.glb", s, fps, true);
        assert_plays("a.gltf", s, fps);
    }
}

static void single_frame_has_no_animation(void **)
{
    assert_plays("a.glb", {5}, 24);
    assert_int_equal(load(folder + "/a.glb").meshes[0].primitives[0].targets.size(), 0);
}

/* Halfway between two frames the vertices stand halfway, over switches of pieces and runs and before a gap
 * too. */
static void time_between_frames_moves(void **)
{
    const double fps = 24;
    Script s = repeat(5, 10) + Script{4, 3} + repeat(6, 2) + Script{-1, 6, 0};
    write(folder + "/a.glb", s, fps);
    tinygltf::Model m = load(folder + "/a.glb");
    for (size_t k = 0; k + 2 < s.size(); k++) {
        if (s[k] <= 0 || s[k + 1] < 0) continue;
        Shown half = show(m, float((double(k) + 0.5) / fps));
        TriMesh a = fan(s[k], double(k) / fps, 0), b = fan(s[k], double(k + 1) / fps, 0);
        assert_int_equal(half.pos.size(), 3 * a.nvert);
        for (size_t i = 0; i < half.pos.size(); i++)
            assert_true(fabs(half.pos[i] - 0.5 * (double(a.pos[i]) + double(b.pos[i]))) < 1e-4);
        trimesh_free(&a);
        trimesh_free(&b);
    }
    Shown gap = show(m, float(13.5 / fps)), before = show(m, float(13 / fps));
    assert_true(gap.nodes == 1 && fabs(gap.pos[0] - before.pos[0]) > 1e-3);
    assert_int_equal(show(m, float(14.5 / fps)).nodes, 0);
}

static void step_holds_each_frame(void **)
{
    Script s = repeat(5, 12) + repeat(4, 2);
    write(folder + "/a.glb", s, 24, true);
    tinygltf::Model m = load(folder + "/a.glb");
    for (size_t k = 0; k < s.size(); k++) {
        Shown at = show(m, float(double(k) / 24)), half = show(m, float((double(k) + 0.5) / 24));
        assert_true(at.pos == half.pos);
    }
}

static void vertices_bear_identity_velocity_attributes(void **)
{
    write(folder + "/a.glb", repeat(5, 12), 24, false, 16777216 - 6);
    tinygltf::Model m = load(folder + "/a.glb");
    auto attribute = m.meshes[1].primitives[0].attributes;
    std::vector<float> id = floats(m, attribute.at("_ID"));
    assert_true(id.size() == 6 && id[5] == 16777215.0f);
    assert_true(floats(m, attribute.at("_VELOCITY"))[2] == float(2 + 8.0 / 24)); /* the piece's first frame */
    assert_true(floats(m, attribute.at("_MY_GRID"))[3] == 3.0f);                 /* the run's */
    assert_true(floats(m, attribute.at("_ID_"))[3] == 4.0f);

    write(folder + "/a.glb", repeat(5, 2), 24, false, 16777216 - 5);
    m = load(folder + "/a.glb");
    int a = m.meshes[0].primitives[0].attributes.at("_ID");
    assert_int_equal(m.accessors[size_t(a)].type, TINYGLTF_TYPE_VEC2);
    assert_int_equal(m.accessors[size_t(a)].componentType, GLTF_U16);
    assert_memory_equal(data_of(m, a), "\xfb\xff\xff\0\xfc\xff\xff\0", 8);
    assert_memory_equal(data_of(m, a) + 20, "\0\0\0\1", 4);
}

static void indices_are_as_narrow_as_may_be(void **)
{
    for (int sides : {65533, 65534}) {
        write(folder + "/a.glb", {sides}, 24);
        tinygltf::Model m = load(folder + "/a.glb");
        const tinygltf::Accessor &index = m.accessors[size_t(m.meshes[0].primitives[0].indices)];
        assert_int_equal(index.componentType, sides == 65533 ? GLTF_U16 : GLTF_U32);
        const uint8_t *p = data_of(m, m.meshes[0].primitives[0].indices);
        uint32_t last = 0;
        memcpy(&last, p + (index.count - 1) * (sides == 65533 ? 2 : 4), sides == 65533 ? 2 : 4);
        assert_int_equal(last, sides);
    }
}

static std::string slurp(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
}

static void same_input_gives_same_bytes(void **)
{
    Script s = repeat(5, 12) + Script{4, 0, 3};
    write(folder + "/a.glb", s, 24);
    write(folder + "/b.glb", s, 24);
    std::string a = slurp(folder + "/a.glb");
    assert_true(a == slurp(folder + "/b.glb"));
    uint32_t head[3];
    memcpy(head, a.data(), sizeof head);
    assert_true(head[0] == 0x46546c67 && head[1] == 2 && head[2] == a.size());
    assert_true(a.find("\"generator\":\"twinmesh\"") != std::string::npos);
    assert_true(a.find(folder) == std::string::npos);
}

static void large_glb_becomes_gltf_with_parts(void **)
{
    const double fps = 24;
    Script s = repeat(50, 12) + repeat(40, 3);
    warnings = 0;
    write(folder + "/big name.glb", s, fps, false, 0, {5000, 20000});
    assert_int_equal(warnings, 1);
    std::vector<std::string> names = files();
    assert_true(names.size() > 4);
    assert_true(std::find(names.begin(), names.end(), "big name.glb") == names.end());
    for (const std::string &name : names) {
        assert_true(name == "big name.gltf" || name.substr(name.size() - 4) == ".bin");
        if (name != "big name.gltf") assert_true(slurp(folder + "/" + name).size() <= 5000);
    }
    assert_true(slurp(folder + "/big name.gltf").find("\"uri\":\"big%20name.1.bin\"") != std::string::npos);

    /* tinygltf does not decode the URIs' %20 */
    clear_files(nullptr);
    write(folder + "/big.glb", s, fps, false, 0, {5000, 20000});
    tinygltf::Model m = load(folder + "/big.gltf");
    assert_well_formed(m, int(s.size()), fps);
    assert_frames_equal(m, s, fps);

    /* parts that fit together become one buffer */
    clear_files(nullptr);
    warnings = 0;
    write(folder + "/a.glb", s, fps, false, 0, {5000, GLTF_GLB_BYTES});
    assert_int_equal(warnings, 0);
    assert_int_equal(files().size(), 1);
    m = load(folder + "/a.glb");
    assert_int_equal(m.buffers.size(), 1);
    assert_frames_equal(m, s, fps);
}

static void glb_limit_is_exact(void **)
{
    Script s = repeat(5, 3);
    write(folder + "/a.glb", s, 24);
    uint64_t size = slurp(folder + "/a.glb").size();
    clear_files(nullptr);
    write(folder + "/a.glb", s, 24, false, 0, {GLTF_PART_BYTES, size});
    assert_int_equal(files().size(), 1);
    clear_files(nullptr);
    write(folder + "/a.glb", s, 24, false, 0, {GLTF_PART_BYTES, size - 1});
    assert_true(files() == std::vector<std::string>({"a.bin", "a.gltf"}));
}

static void bad_normals_become_unit_vectors(void **)
{
    Err err = {};
    Gltf *g = start(folder + "/a.glb", 24, false, &err);
    TriMesh m = fan(3, 0, 0);
    for (int k = 0; k < 3; k++) m.normal[k] = 0, m.normal[3 + k] = 2, m.normal[6 + k] = NAN;
    assert_true(gltf_add_frame(g, &m, nullptr, nullptr, 1, &err));
    assert_true(gltf_close(g, &err));
    trimesh_free(&m);
    tinygltf::Model model = load(folder + "/a.glb");
    std::vector<float> n = floats(model, model.meshes[0].primitives[0].attributes.at("NORMAL"));
    for (size_t v = 0; v < n.size(); v += 3)
        assert_true(fabsf(n[v] * n[v] + n[v + 1] * n[v + 1] + n[v + 2] * n[v + 2] - 1) < 1e-5f);
}

static void what_cannot_be_is_refused(void **)
{
    Err err = {};
    assert_null(start(folder + "/a.obj", 24, false, &err));
    assert_int_equal(err.code, ERR_USAGE);
    assert_null(start(folder + "/a.glb", 0, false, &err));
    assert_int_equal(err.code, ERR_USAGE);

    Gltf *g = start(folder + "/none/a.glb", 24, false, &err);
    assert_non_null(g);
    assert_false(play_in(g, {5, 5}, 24, 0, &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    assert_non_null(strstr(err.text, "folder does not exist"));
    assert_false(gltf_close(g, &err));

    g = start(folder + "/a.glb", 24, false, &err);
    TriMesh m = fan(3, 0, 0);
    m.pos[4] = INFINITY;
    assert_false(gltf_add_frame(g, &m, nullptr, nullptr, 1, &err));
    trimesh_free(&m);
    assert_false(gltf_close(g, &err));
    assert_true(files().empty());
}

static void abort_leaves_nothing(void **)
{
    Err err = {};
    Gltf *g = start(folder + "/a.glb", 24, false, &err);
    assert_true(play_in(g, {5, 5, 4}, 24, 0, &err));
    assert_int_equal(files().size(), 1);
    gltf_abort(g);
    assert_true(files().empty());
    gltf_abort(nullptr);
}

/* A .glb and a .gltf of one prefix, fed in turns, are what each is when written alone; giving one up leaves the
 * other's bytes alone. */
static void glb_and_gltf_of_one_prefix_do_not_meet(void **)
{
    Script s = repeat(5, 12) + Script{4, 3};
    write(folder + "/a.glb", s, 24);
    write(folder + "/a.gltf", s, 24);
    std::string glb = slurp(folder + "/a.glb"), gltf = slurp(folder + "/a.gltf"), bin = slurp(folder + "/a.bin");

    for (int given_up : {0, 1, 2}) {
        clear_files(nullptr);
        Err err = {};
        Gltf *a = start(folder + "/a.glb", 24, false, &err), *b = start(folder + "/a.gltf", 24, false, &err);
        for (size_t k = 0; k < s.size(); k++)
            for (Gltf *g : {a, b}) {
                TriMesh m = fan(s[k], double(k) / 24, 0), carried = {};
                bool same = k == 0 || s[k] == s[k - 1];
                if (!same) carried = fan(s[k - 1], double(k) / 24, 0);
                assert_true(gltf_add_frame(g, &m, same ? nullptr : carried.pos, same ? nullptr : carried.normal, 1, &err));
                trimesh_free(&m);
                trimesh_free(&carried);
            }
        assert_true(files() == std::vector<std::string>({"a.bin.part", "a.glb.bin.part"}));
        if (given_up == 1) gltf_abort(a);
        else assert_true(gltf_close(a, &err));
        if (given_up == 2) gltf_abort(b);
        else assert_true(gltf_close(b, &err));
        std::vector<std::string> want;
        if (given_up != 2) want = {"a.bin"};
        if (given_up != 1) want.push_back("a.glb");
        if (given_up != 2) want.push_back("a.gltf");
        assert_true(files() == want);
        if (given_up != 1) assert_true(slurp(folder + "/a.glb") == glb);
        if (given_up != 2) assert_true(slurp(folder + "/a.gltf") == gltf && slurp(folder + "/a.bin") == bin);
    }
}

/* Files may grow to `limit` bytes only, as on a disk that is full by then. */
static bool write_limited(const char *name, const Script &script, rlim_t limit, Limits limits, Err *err)
{
    struct rlimit old, low;
    getrlimit(RLIMIT_FSIZE, &old);
    low = old;
    low.rlim_cur = limit;
    setrlimit(RLIMIT_FSIZE, &low);
    Gltf *g = start(folder + "/" + name, 24, false, err);
    g->part_bytes = limits.part;
    g->glb_bytes = limits.glb;
    play_in(g, script, 24, 0, err);
    bool ok = gltf_close(g, err);
    setrlimit(RLIMIT_FSIZE, &old);
    return ok;
}

static void full_disk_at_any_moment_leaves_nothing(void **)
{
    signal(SIGXFSZ, SIG_IGN);
    Script s = repeat(300, 40) +
               repeat(310, 3); /* more than the buffers hold, so that it fails within a frame too */
    const struct {
        const char *name;
        Limits limits;
    } kinds[] = {{"a.glb", {GLTF_PART_BYTES, GLTF_GLB_BYTES}},
                 {"a.gltf", {GLTF_PART_BYTES, GLTF_GLB_BYTES}},
                 {"a.glb", {100000, 150000}}};
    for (const auto &kind : kinds) {
        uint64_t largest = 0;
        Err err = {};
        assert_true(write_limited(kind.name, s, RLIM_INFINITY, kind.limits, &err));
        for (const std::string &name : files())
            largest = std::max(largest, uint64_t(slurp(folder + "/" + name).size()));
        clear_files(nullptr);
        for (uint64_t limit = 0; limit < largest; limit += 1 + largest / 25) {
            err = {};
            assert_false(write_limited(kind.name, s, rlim_t(limit), kind.limits, &err));
            assert_int_equal(err.code, ERR_OUTPUT);
            assert_non_null(strstr(err.text, "size limit"));
            assert_true(files().empty());
        }
        assert_true(write_limited(kind.name, s, rlim_t(largest), kind.limits, &err));
        clear_files(nullptr);
    }
    signal(SIGXFSZ, SIG_DFL);
}

static void disk_full_is_said(void **)
{
    Err err = {};
    assert_int_equal(symlink("/dev/full", (folder + "/a.glb.bin.part").c_str()), 0);
    Gltf *g = start(folder + "/a.glb", 24, false, &err);
    play_in(g, {5, 5}, 24, 0, &err);
    assert_false(gltf_close(g, &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    assert_non_null(strstr(err.text, "disk is full"));
    assert_true(files().empty());
}

/* All files of the folder, by name. */
static std::map<std::string, std::string> contents()
{
    std::map<std::string, std::string> all;
    for (const std::string &name : files()) all[name] = slurp(folder + "/" + name);
    return all;
}

/* What a killed run leaves: parts that go on behind what the store tells of. */
static Store leave_after(const std::string &path, const Script &script, size_t frames)
{
    Err err = {};
    Gltf *g = start(path, 24, false, &err);
    assert_true(play_in(g, script, 24, 0, &err, 0, frames));
    Store s = store_writing();
    assert_true(gltf_sync(g, &err));
    gltf_store(g, &s);
    assert_true(play_in(g, script, 24, 0, &err, frames, frames + 2));
    gltf_leave(g);
    return s;
}

static void leave_and_go_on()
{
    const Script script = repeat(5, 3) + repeat(4, 11) + Script{-1, 0, 4} + repeat(6, 2);
    for (const char *name : {"/a.glb", "/a.gltf"}) {
        const std::string path = folder + name;
        write(path, script, 24);
        const auto expected = contents();
        clear_files(nullptr);
        for (size_t k = 1; k < script.size(); k++) {
            if (script[k - 1] < 0) continue;
            Store w = leave_after(path, script, k), r = store_reading(w.data, w.n);
            Err err = {};
            GltfOptions options = {path.c_str(), 24, "geometric", false, compress, nullptr};
            Gltf *g = gltf_reopen(&options, &r, &err);
            assert_non_null(g);
            assert_true(r.at == r.n);
            assert_true(play_in(g, script, 24, 0, &err, k));
            assert_true(gltf_finish(g, &err));
            gltf_abort(g);
            assert_true(contents() == expected);
            store_free(&w);
            clear_files(nullptr);
        }
    }
}

static void one_left_is_gone_on_with(void **)
{
    for (GltfCompress how : {GLTF_PLAIN, GLTF_QUANTIZE, GLTF_MESHOPT}) compress = how, leave_and_go_on();
    compress = GLTF_PLAIN;
}

/* No byte of the store makes it crash, whether it notices or not. */
static void damage_store()
{
    const std::string path = folder + "/a.glb";
    Store w = leave_after(path, repeat(3, 2) + repeat(4, 2), 3);
    int refused = 0;
    for (size_t i = 0; i < w.n; i++)
        for (uint8_t flip : {0x01, 0x80, 0xff}) {
            w.data[i] ^= flip;
            Store r = store_reading(w.data, w.n);
            Err err = {};
            GltfOptions options = {path.c_str(), 24, "geometric", false, compress, nullptr};
            Gltf *g = gltf_reopen(&options, &r, &err);
            assert_true(g || r.bad || err.code == ERR_INPUT);
            refused += !g;
            if (g) gltf_leave(g);
            w.data[i] ^= flip;
        }
    assert_true(refused > 100);
    store_free(&w);
}

static void damage_in_a_store_does_no_harm(void **)
{
    for (GltfCompress how : {GLTF_PLAIN, GLTF_MESHOPT}) compress = how, damage_store();
    compress = GLTF_PLAIN;
}

static void runs_are_counted(void **)
{
    GltfStat none = write(folder + "/a.glb", {0, 0}, 24);
    assert_true(none.runs == 0 && none.median_run == 0);
    GltfStat three = write(folder + "/a.glb", repeat(5, 10) + repeat(4, 1) + Script{0} + repeat(4, 3), 24);
    assert_true(three.runs == 3 && three.median_run == 3);
    GltfStat two = write(folder + "/a.glb", repeat(5, 2) + repeat(4, 1), 24);
    assert_true(two.runs == 2 && two.median_run == 1.5);
}

int main()
{
#define TEST(name) cmocka_unit_test_setup(name, clear_files)
    const struct CMUnitTest tests[] = {
        TEST(one_run_is_cut_into_pieces),
        TEST(connectivity_may_change_at_any_frame),
        TEST(empty_and_skipped_frames_show_nothing),
        TEST(long_mixture_plays_at_odd_rates),
        TEST(single_frame_has_no_animation),
        TEST(time_between_frames_moves),
        TEST(step_holds_each_frame),
        TEST(vertices_bear_identity_velocity_attributes),
        TEST(indices_are_as_narrow_as_may_be),
        TEST(same_input_gives_same_bytes),
        TEST(large_glb_becomes_gltf_with_parts),
        TEST(glb_limit_is_exact),
        TEST(glb_and_gltf_of_one_prefix_do_not_meet),
        TEST(bad_normals_become_unit_vectors),
        TEST(what_cannot_be_is_refused),
        TEST(abort_leaves_nothing),
        TEST(full_disk_at_any_moment_leaves_nothing),
        TEST(disk_full_is_said),
        TEST(one_left_is_gone_on_with),
        TEST(damage_in_a_store_does_no_harm),
        TEST(runs_are_counted),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
