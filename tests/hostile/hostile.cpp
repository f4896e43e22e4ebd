/* Files of every kind, damaged in every way and read: volumes by processes of their own as `twinmesh` reads them, meshes and
 * scenes in a child each. A crash, more than ten seconds, more memory than is given, a file cut short that is taken
 * for a whole one: each is counted, and fails.
 *
 *     hostile COUNT [FIRST]     inputs FIRST ... FIRST + COUNT - 1; an input is the same in every run */
#include "../unit/volume_files.h"

#include <openvdb/io/Stream.h>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <sys/resource.h>
#include <sys/wait.h>

extern "C" {
#include "io/gltf_info.h"
#include "io/isolate.h"
#include "io/ply.h"
#include "io/volume.h"
#include "scene/scene.h"
#include "../unit/temp_dir.h"
}

static constexpr double SECONDS_MAX = 10;
static constexpr rlim_t MEMORY_MAX = rlim_t(2) << 30; /* of a reader of meshes and scenes */
static const Samples SAMPLES(9, 8, 10);

static double clock_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/* --- damage --------------------------------------------------------------------------------------- */

static uint64_t random_bits(uint64_t *seed)
{
    uint64_t x = *seed += 0x9e3779b97f4a7c15u; /* splitmix64 */
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

enum Damage { BITS, CUT, SPLICE, GROW, EXTREME, MIX, DAMAGE_COUNT };
static const char *const DAMAGE_NAMES[] = {"bits turned", "cut short", "spliced", "counts grown", "extreme bytes", "mixed"};

/* Mostly in the first kilobytes, where counts and offsets are. */
static size_t place(const Bytes &b, uint64_t *seed)
{
    size_t reach = random_bits(seed) % 3 ? std::min<size_t>(b.size(), 1500) : b.size();
    return random_bits(seed) % reach;
}

static void damage(Bytes &b, Damage how, uint64_t *seed)
{
    static const uint8_t extreme[] = {0, 1, 0x7f, 0x80, 0xff, 0xfe, '-', '9'};
    const size_t at = place(b, seed), n = 1 + random_bits(seed) % 64, from = place(b, seed);
    switch (how) {
    case BITS:
        for (size_t i = 0; i <= n % 4; i++) b[place(b, seed)] ^= uint8_t(1 << random_bits(seed) % 8);
        break;
    case CUT: b.resize(random_bits(seed) % b.size()); break;
    case SPLICE: {
        const Bytes piece(b.begin() + long(from), b.begin() + long(std::min(b.size(), from + n)));
        if (random_bits(seed) % 2) b.insert(b.begin() + long(at), piece.begin(), piece.end());
        else b.erase(b.begin() + long(at), b.begin() + long(std::min(b.size(), at + n)));
        break;
    }
    case GROW: /* a little-endian number of 4 bytes that becomes larger, or one in letters */
        if (b[at] >= '0' && b[at] <= '9') b.insert(b.begin() + long(at), n % 6 + 1, uint8_t('1' + n % 9));
        else
            for (size_t i = at; i < std::min(b.size(), at + 1 + n % 4); i++) b[i] = uint8_t(b[i] * 2 + 1 + random_bits(seed) % 7);
        break;
    case EXTREME:
        for (size_t i = at; i < std::min(b.size(), at + 1 + n % 8); i++) b[i] = extreme[from % sizeof extreme];
        break;
    default:
        for (int i = 0; i < 4 && !b.empty(); i++) damage(b, Damage(random_bits(seed) % MIX), seed);
    }
}

/* Whether only blanks are missing: those say nothing. */
static bool is_as_good(const Bytes &whole, const Bytes &part)
{
    for (size_t i = part.size(); i < whole.size(); i++)
        if (!strchr(" \t\r\n", whole[i]) || !whole[i]) return false;
    return true;
}

/* --- what is read ------------------------------------------------------------------------------------ */

enum Outcome { TAKEN, REFUSED, CRASHED, HUNG, OVER, OUTCOME_COUNT };

static Outcome outcome_of(bool ok, const Err &err)
{
    if (ok) return TAKEN;
    if (strstr(err.text, "more memory")) return OVER;
    return strstr(err.text, "process") || !err.text[0] || strchr(err.text, '\n') ? CRASHED : REFUSED;
}

/* All of a volume's grids, by a process of its own. */
static Outcome read_volume(const std::string &path)
{
    VolumeRequest r = {};
    for (int a = 0; a < 3; a++) r.raw_dims[a] = SAMPLES.n[a];
    Err err = {};
    VolumeFile *f = volume_open(path.c_str(), &r, &err);
    bool ok = f != nullptr;
    for (int i = 0; ok && i < volume_count(f); i++) {
        if (volume_entry(f, i)->ncomp == 0) continue;
        Grid g;
        grid_init(&g, volume_entry(f, i)->ncomp);
        ok = volume_load(f, i, &g, &err);
        grid_free(&g);
    }
    volume_close(f);
    return outcome_of(ok, err);
}

static bool read_ply(const char *path, Err *err)
{
    TriMesh m;
    return ply_read(path, &m, err);
}

static bool read_gltf(const char *path, Err *err)
{
    GltfInfo info;
    return gltf_info_read(path, &info, err);
}

static bool read_scene(const char *path, Err *err)
{
    Scene s;
    return scene_load(path, &s, err);
}

/* In a child: memory and time are its own. */
static Outcome read_in_child(bool (*read)(const char *path, Err *err), const std::string &path)
{
    const pid_t pid = fork();
    if (pid == 0) {
        const rlimit memory = {MEMORY_MAX, MEMORY_MAX};
        setrlimit(RLIMIT_AS, &memory);
        alarm(unsigned(SECONDS_MAX));
        Err err = {};
        _exit(outcome_of(read(path.c_str(), &err), err));
    }
    int status = 0;
    waitpid(pid, &status, 0);
    if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGALRM ? HUNG : CRASHED;
    return WEXITSTATUS(status) == ERR_RESOURCE ? OVER : Outcome(WEXITSTATUS(status)); /* as mem_alloc leaves */
}

struct Kind {
    std::string path;
    bool (*read)(const char *path, Err *err); /* NULL: a volume */
    Bytes whole;
};

static void add_text(std::vector<Kind> &kinds, const std::string &path, bool (*read)(const char *, Err *), const std::string &text)
{
    Bytes b;
    add(b, text);
    save(path, b);
    kinds.push_back({path, read, b});
}

static void write_vdbs(const std::string &at, std::vector<std::string> &paths)
{
    using namespace openvdb;
    auto v = Vec3SGrid::create(Vec3s(0, 1, 0));
    v->setName("v");
    v->fill(CoordBBox(Coord(0), Coord(9)), Vec3s(1, 2, 3));
    auto tiles = DoubleGrid::create(0.5);
    tiles->setName("tiles");
    tiles->fill(CoordBBox(Coord(-128), Coord(-1)), -1.0);
    const GridPtrVec grids = {vdb_grid(SAMPLES), v, tiles};
    const std::pair<const char *, uint32_t> codecs[] = {{"plain.vdb", io::COMPRESS_NONE}, {"zip.vdb", io::COMPRESS_ZIP}, {"masked.vdb", io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK}};
    for (const auto &[name, codec] : codecs) {
        io::File file(at + name);
        file.setCompression(codec);
        file.write(grids);
        paths.push_back(at + name);
    }
    std::ofstream pipe(at + "pipe.vdb", std::ios::binary);
    io::Stream(pipe).write(grids);
    paths.push_back(at + "pipe.vdb");
}

static std::vector<Kind> write_kinds(const std::string &folder)
{
    std::vector<std::string> paths, own = write_all(SAMPLES, folder, &paths);
    paths.insert(paths.end(), own.begin(), own.end());
    write_vdbs(folder + "/", paths);
    std::vector<Kind> kinds;
    for (const std::string &path : paths) kinds.push_back({path, nullptr, load_bytes(path)});

    TriMesh m;
    Err err = {};
    trimesh_init(&m, 4, 4, true, true);
    const int32_t tri[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    for (int i = 0; i < 12; i++) m.pos[i] = m.normal[i] = m.velocity[i] = float(i % 4 == 0), m.tri[i] = tri[i];
    for (int i = 0; i < 4; i++) m.id[i] = m.parent[i] = i;
    if (!ply_write((folder + "/binary.ply").c_str(), &m, &err)) throw std::runtime_error(err.text);
    trimesh_free(&m);
    kinds.push_back({folder + "/binary.ply", read_ply, load_bytes(folder + "/binary.ply")});
    add_text(kinds, folder + "/ascii.ply", read_ply,
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty float y\nproperty float z\nelement face 1\n"
             "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    const std::string gltf = R"({"asset":{"version":"2.0"},"accessors":[{"count":3,"type":"SCALAR"},{"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
                             R"("meshes":[{"primitives":[{"indices":0,"attributes":{"POSITION":1}}]}],"nodes":[{"mesh":0}]})";
    add_text(kinds, folder + "/a.gltf", read_gltf, gltf);
    Bytes head = {'g', 'l', 'T', 'F', 2, 0, 0, 0}, bin(64, 1);
    const uint32_t sizes[3] = {uint32_t(20 + gltf.size() + bin.size()), uint32_t(gltf.size()), 0x4e4f534a};
    add(head, sizes, 3);
    add_text(kinds, folder + "/a.glb", read_gltf, std::string(head.begin(), head.end()) + gltf + std::string(bin.begin(), bin.end()));
    add_text(kinds, folder + "/a.json", read_scene,
             R"({"frames": [1, 4], "domain": [[-1, -1, -1], [1, 1, 1]], "voxel": 0.1, "elements": [{"points": {"random": 9, "seed": 1, "box": [[-1, -1, -1], [1, 1, 1]]},)"
             R"( "radius": 0.2, "rotate": {"axis": [0, 1, 1], "degrees": {"keys": [[1, 0], [4, 30]]}}}, {"segments": [[[0, 0, 0], [1, 0, 0]]], "radius": 0.1}]})");
    return kinds;
}

/* --- counting ------------------------------------------------------------------------------------------ */

struct Count {
    int inputs = 0, outcome[OUTCOME_COUNT] = {}, cuts_taken = 0;
    double slowest = 0;
    void add(const Count &c)
    {
        inputs += c.inputs;
        for (int i = 0; i < OUTCOME_COUNT; i++) outcome[i] += c.outcome[i];
        cuts_taken += c.cuts_taken;
        slowest = std::max(slowest, c.slowest);
    }
    bool good() const { return outcome[CRASHED] + outcome[HUNG] + outcome[OVER] + cuts_taken == 0; }
    void print(const std::string &name) const
    {
        printf("%-16s %7d %7d %8d %6d %6d %6d %6d %8.2f\n", name.c_str(), inputs, outcome[TAKEN], outcome[REFUSED], outcome[CRASHED], outcome[HUNG], outcome[OVER], cuts_taken, slowest);
    }
};

static Count run_one(const Kind &kind, Damage how, uint64_t seed)
{
    Bytes b = kind.whole;
    damage(b, how, &seed);
    const std::string changed = std::string(temp_dir) + "/changed_0001" + kind.path.substr(kind.path.rfind('.'));
    save(changed, b);
    Count c;
    const double start = clock_s();
    Outcome o = kind.read ? read_in_child(kind.read, changed) : read_volume(changed);
    c.slowest = clock_s() - start;
    if (c.slowest > SECONDS_MAX) o = HUNG;
    c.inputs = c.outcome[o] = 1;
    c.cuts_taken = how == CUT && o == TAKEN && !is_as_good(kind.whole, b);
    if (!c.good()) fprintf(stderr, "%s, %s, seed %llu\n", changed.c_str(), DAMAGE_NAMES[how], static_cast<unsigned long long>(seed));
    return c;
}

int main(int argc, char **argv)
{
    const int count = argc > 1 ? atoi(argv[1]) : 0, first = argc > 2 ? atoi(argv[2]) : 0;
    Err err;
    if (count < 1 || !isolate_start(ISOLATE_LIMITS, &err)) return 2;
    if (temp_open(nullptr) != 0) return 2;
    const std::vector<Kind> kinds = write_kinds(temp_dir);
    std::map<std::string, Count> by_kind;
    Count by_damage[DAMAGE_COUNT], all;
    for (int i = first; i < first + count; i++) {
        const Kind &kind = kinds[size_t(i) % kinds.size()];
        const Damage how = Damage(size_t(i) / kinds.size() % DAMAGE_COUNT);
        const Count c = run_one(kind, how, uint64_t(i) << 32);
        by_kind[kind.path.substr(kind.path.rfind('/') + 1)].add(c);
        by_damage[how].add(c);
        all.add(c);
    }
    printf("%-16s %7s %7s %8s %6s %6s %6s %6s %8s\n", "", "inputs", "taken", "refused", "crash", "> 10 s", "memory", "cut", "slowest");
    for (const auto &[name, c] : by_kind) c.print(name);
    for (int d = 0; d < DAMAGE_COUNT; d++) by_damage[d].print(DAMAGE_NAMES[d]);
    all.print("all");
    isolate_stop();
    temp_close(nullptr);
    fflush(stdout);
    return all.good() ? 0 : 1;
}
