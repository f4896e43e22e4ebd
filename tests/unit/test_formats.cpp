/* Every volume format: the same samples give the same grid; what is cut short, changed or made to harm is refused, or
 * read as something else, but never read past its end nor given memory its length does not warrant.
 *
 *     test_formats --write FOLDER    the same samples in all formats, for tests/cli/formats.bats */
#include "volume_files.h"

#include <csetjmp>
#include <cstdarg>
#include <cstring>
#include <sys/resource.h>

extern "C" {
#include "io/volume.h"
#include "temp_dir.h"
#include <cmocka.h>
}

/* OpenVDB loses a node when a chunk cannot be decompressed (test_vdb.cpp); so does OpenEXR's core with attributes. */
extern "C" const char *__lsan_default_suppressions() { return "leak:RootNode*readTopology\nleak:libOpenEXRCore\nleak:core_alloc\n"; }

static const Samples samples;

static VolumeRequest request(bool place)
{
    VolumeRequest r = {};
    r.has_origin = place;
    for (int a = 0; a < 3; a++) {
        r.raw_dims[a] = samples.n[a];
        if (place) r.spacing[a] = samples.spacing[a], r.origin[a] = samples.origin[a];
    }
    return r;
}

static void expect_samples(const std::string &path, const VolumeRequest &r)
{
    Volume v;
    Err err = {};
    if (!volume_read(path.c_str(), &r, &v, &err)) fail_msg("%s", err.text);
    for (int a = 0; a < 3; a++) {
        assert_true(v.surface.lo[a] == 0 && v.surface.hi[a] == samples.n[a] - 1);
        for (int b = 0; b < 3; b++)
            if (v.surface.xform.m[a][b] != (a == b ? samples.spacing[a] : 0)) fail_msg("%s: spacing %g", path.c_str(), v.surface.xform.m[a][b]);
        if (v_get(v.surface.xform.t, a) != samples.origin[a]) fail_msg("%s: origin %g", path.c_str(), v_get(v.surface.xform.t, a));
    }
    for (int z = 0; z < samples.n[2]; z++)
        for (int y = 0; y < samples.n[1]; y++)
            for (int x = 0; x < samples.n[0]; x++)
                if (grid_at(&v.surface, x, y, z, 0) != samples.at(x, y, z)) fail_msg("%s: sample (%d, %d, %d)", path.c_str(), x, y, z);
    volume_free(&v);
}

static void same_samples_give_the_same_grid(void **)
{
    std::vector<std::string> placed, own = write_all(samples, temp_dir, &placed);
    for (const std::string &path : placed) expect_samples(path, request(true));
    for (const std::string &path : own) expect_samples(path, request(false));
}

static void expect_refused(const std::string &path, const VolumeRequest &r, const char *word)
{
    Volume v;
    Err err = {};
    if (volume_read(path.c_str(), &r, &v, &err)) {
        volume_free(&v);
        fail_msg("%s: '%s' was expected", path.c_str(), word);
    }
    if (!strstr(err.text, word)) fail_msg("'%s' is not in: %s", word, err.text);
}

/* --- what may come in a file that is not what it says --------------------------------------------- */

static uint64_t random_bits(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    uint64_t x = *seed ^ *seed >> 29;
    return x * 0xbf58476d1ce4e5b9u >> 24;
}

/* Each kind of harm that a byte can do: bits turned, extreme numbers, stretches gone or doubled. */
static void mutate(Bytes &b, uint64_t *seed, size_t head)
{
    static const uint8_t extreme[] = {0, 1, 0x7f, 0x80, 0xff, 0xfe, '-', '9'};
    for (int times = 1 + int(random_bits(seed) % 4); times > 0 && !b.empty(); times--) {
        size_t reach = random_bits(seed) % 4 ? std::min(head, b.size()) : b.size(); /* mostly the header */
        size_t at = random_bits(seed) % reach, n = 1 + random_bits(seed) % 8;
        switch (random_bits(seed) % 6) {
        case 0: b[at] ^= uint8_t(1 << random_bits(seed) % 8); break;
        case 1: b[at] = extreme[random_bits(seed) % sizeof extreme]; break;
        case 2:
            for (size_t i = at; i < std::min(at + n, b.size()); i++) b[i] = extreme[n % sizeof extreme];
            break;
        case 3: b.erase(b.begin() + long(at), b.begin() + long(std::min(at + n, b.size()))); break;
        case 4: b.insert(b.begin() + long(at), n, uint8_t(random_bits(seed))); break;
        default: b.resize(at); break;
        }
    }
}

static size_t memory_peak()
{
    struct rusage use;
    getrusage(RUSAGE_SELF, &use);
    return size_t(use.ru_maxrss) << 10;
}

/* Opens, lists and reads everything in it. A success must keep its promises: the grid can be walked. */
static void read_any(const std::string &path, const VolumeRequest &r)
{
    Err err = {};
    VolumeFile *f = volume_open(path.c_str(), &r, &err);
    for (int i = 0; f && i < volume_count(f); i++) {
        if (volume_entry(f, i)->ncomp == 0) continue;
        Grid g;
        grid_init(&g, volume_entry(f, i)->ncomp);
        if (volume_load(f, i, &g, &err)) (void)grid_at(&g, 3, 4, 5, 0);
        grid_free(&g);
    }
    volume_close(f);
    if (err.code != ERR_NONE) assert_non_null(strstr(err.text, temp_dir)); /* a sentence that names the file */
}

/* The seeds of one more run: TWINMESH_MUTATIONS=N. */
static int mutations()
{
    const char *more = getenv("TWINMESH_MUTATIONS");
    return more ? atoi(more) : 150;
}

static void mutated_files_do_no_harm(void **)
{
    std::vector<std::string> all, own = write_all(samples, temp_dir, &all);
    all.insert(all.end(), own.begin(), own.end());
    const size_t before = memory_peak();
    for (const std::string &path : all) {
        const Bytes whole = load_bytes(path);
        const std::string ending = path.substr(path.rfind('.')), changed = std::string(temp_dir) + "/changed" + ending;
        uint64_t seed = 1;
        for (int i = 0; i < mutations(); i++) {
            Bytes b = whole;
            mutate(b, &seed, ending == ".exr" ? 6000 : ending == ".nvdb" ? 3000 : 400);
            save(changed, b);
            read_any(changed, request(true));
        }
    }
    /* uni files are packed: what is inside is mutated too */
    for (char version : {'1', '2', '3'}) {
        const Bytes whole = uni_bytes(samples, version, version == '1' ? 12 : 17, version == '1' ? 3 : 1);
        uint64_t seed = 2;
        for (int i = 0; i < mutations(); i++) {
            Bytes b = whole;
            mutate(b, &seed, 60);
            const std::string changed = std::string(temp_dir) + "/changed.uni";
            save(changed, gzip(b));
            read_any(changed, request(true));
        }
    }
#if !defined(__SANITIZE_ADDRESS__) /* which keeps freed memory for a while */
    assert_true(memory_peak() - before < size_t(400) << 20);
#else
    (void)before;
#endif
}

static void truncated_files_are_refused(void **)
{
    std::vector<std::string> all, own = write_all(samples, temp_dir, &all);
    all.insert(all.end(), own.begin(), own.end());
    for (const std::string &path : all) {
        if (path.find(".nhdr") != std::string::npos) continue;
        const Bytes whole = load_bytes(path);
        const std::string cut = std::string(temp_dir) + "/cut" + path.substr(path.rfind('.'));
        size_t step = 1;
        for (size_t n = 0; n < whole.size(); n += step) {
            save(cut, Bytes(whole.begin(), whole.begin() + long(n)));
            Volume v;
            Err err = {};
            const VolumeRequest r = request(true);
            if (volume_read(cut.c_str(), &r, &v, &err)) {
                volume_free(&v);
                fail_msg("%s: %zu of %zu bytes were taken", path.c_str(), n, whole.size());
            }
            step = n < 600 ? 7 : whole.size() / 40 + 1;
        }
    }
}

/* --- headers made to harm ------------------------------------------------------------------------- */

static void put32(Bytes &b, size_t at, uint32_t v) { memcpy(b.data() + at, &v, 4); }
static void put64(Bytes &b, size_t at, uint64_t v) { memcpy(b.data() + at, &v, 8); }

static void hostile_uni(void **)
{
    const std::string path = std::string(temp_dir) + "/phi_0001.uni";
    auto refused = [&](size_t at, uint32_t v, const char *word, char version = '3') {
        Bytes b = uni_bytes(samples, version, 17);
        put32(b, at, v);
        save(path, gzip(b));
        expect_refused(path, request(false), word);
    };
    for (size_t at : {4, 8, 12}) {
        refused(at, 0, "no volume");
        refused(at, 0xffffffff, "no volume");
        refused(at, 0x7fffffff, "no side");
        refused(at, 1 << 20, "do not fit");
        refused(at, 3, "more than");
        refused(at, 25, "cut short");
    }
    refused(16, 2, "neither real");
    refused(16, 32, "neither real");
    refused(20, 0, "neither real");
    refused(24, 0, "bytes");
    refused(24, 8, "cut short", '2');
    refused(0, 0x3254344d, "MNT3"); /* M4T2 */
    refused(0, 0x32464444, "DDF2");
    refused(0, 0x34544e4d, "no .uni"); /* MNT4 */
    refused(4 + 24 + 252, 10, "four dimensions");
    save(path, gzip(uni_bytes(samples, '3', 12, 3)));
    expect_refused(path, request(false), "scalar");
}

static void hostile_nrrd(void **)
{
    const std::string path = std::string(temp_dir) + "/a.nrrd";
    auto refused = [&](const std::string &head, const char *word) {
        Bytes b;
        add(b, head);
        b.resize(b.size() + 32);
        save(path, b);
        expect_refused(path, request(false), word);
    };
    const std::string good = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: little\n";
    auto with = [&](const char *line) { return good + line + "\n\n"; };
    refused("NRRD0004\n\n", "`dimension` is missing");
    refused("PNG", "no NRRD");
    refused(with("sizes: 1048576 1048576 1048576"), "do not fit");
    refused(with("sizes: 99999999 2 2"), "no side");
    refused(with("sizes: 2 2"), "three counts");
    refused(with("sizes: 2 -2 2"), "three counts");
    refused(with("sizes: 0 2 2"), "no volume");
    refused(with("sizes: nan 2 2"), "three counts");
    refused(with("dimension: 4"), "not 3");
    refused(with("type: block"), "unu convert");
    refused(with("encoding: hex"), "none of raw");
    refused(with("endian: middle"), "neither");
    refused(with("byte skip: 4"), "do not fit");
    refused(with("byte skip: 1e15"), "skipped");
    refused(with("line skip: 77"), "fewer lines");
    refused(with("space directions: (1,0,0) (0,1,0)"), "three vectors");
    refused(with("space directions: (1,0,0) (0,1,0) (1,1,0)"), "no volume");
    refused(with("space directions: (1,0,0) (0,1,0) (0,0,inf)"), "no lengths");
    refused(with("spacings: 1 0 1"), "no volume");
    refused(with("data file: LIST"), "several");
    refused(with("data file: nowhere.raw"), "no such file");
    refused(with("data file: ."), "regular file");
    refused(with("nonsense"), "field: value");
    refused("NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n", "endian");
    refused(std::string("NRRD0004\n") + std::string(1 << 20, '#'), "does not end");
    refused("NRRD0004\ntype: float\ndimension: 3\nsizes: 900 900 900\nencoding: bz2\nendian: little\n\n", "do not fit");
}

static void nrrd_types_and_places(void **)
{
    const std::string path = std::string(temp_dir) + "/t.nrrd";
    static const struct {
        const char *type;
        int size;
        uint8_t little[8];
        float want;
    } types[] = {
        {"int8", 1, {0xfe}, -2}, {"uchar", 1, {0xfe}, 254}, {"short int", 2, {0xfe, 0xff}, -2}, {"uint16_t", 2, {0xfe, 0xff}, 65534},
        {"int", 4, {0xfe, 0xff, 0xff, 0xff}, -2}, {"unsigned int", 4, {1, 0, 0, 0x80}, 2147483648.0f}, {"long long", 8, {0xfd, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff}, -3},
        {"uint64", 8, {0, 0, 0, 0, 0, 0, 0, 0x80}, 9223372036854775808.0f}, {"float", 4, {0, 0, 0xc0, 0x3f}, 1.5f}, {"double", 8, {0, 0, 0, 0, 0, 0, 0xf8, 0x3f}, 1.5f},
    };
    for (const auto &t : types)
        for (bool big : {false, true}) {
            Bytes b;
            add(b, "NRRD0001\r\nType: " + std::string(t.type) + "\r\n" + "dimension: 3\r\nsizes: 2 1 1\r\nspacings: 2 nan 3\r\naxis mins: 1 2 3\r\naxis maxs: 9 9 9\r\nencoding: raw\r\ncenterings: cell node cell\r\nendian: " +
                       (big ? "big" : "little") + "\r\n\r\n");
            for (int copy = 0; copy < 2; copy++)
                for (int i = 0; i < t.size; i++) b.push_back(t.little[big ? t.size - 1 - i : i]);
            save(path, b);
            Volume v;
            Err err = {};
            const VolumeRequest r = request(false);
            if (!volume_read(path.c_str(), &r, &v, &err)) fail_msg("%s", err.text);
            if (grid_at(&v.surface, 1, 0, 0, 0) != t.want) fail_msg("%s: %g", t.type, double(grid_at(&v.surface, 1, 0, 0, 0)));
            const Affine *x = &v.surface.xform;
            assert_true(x->m[0][0] == 2 && x->m[1][1] == 1 && x->m[2][2] == 3 && x->t.x == 2 && x->t.y == 2 && x->t.z == 4.5);
            volume_free(&v);
        }
}

static void hostile_nvdb(void **)
{
    const std::string path = std::string(temp_dir) + "/a.nvdb";
    write_nvdb(path, samples, NVDB_PLAIN);
    const Bytes whole = load_bytes(path);
    const size_t grid = 16 + 176 + strlen("phi") + 1, tree = grid + sizeof(nanovdb::GridData);
    uint64_t to_root;
    memcpy(&to_root, whole.data() + tree + 24, 8);
    const size_t root = tree + to_root, tile = root + sizeof(nanovdb::NanoRoot<float>::DataType), upper = tile + 32;
    auto refused64 = [&](size_t at, uint64_t v, const char *word) {
        Bytes b = whole;
        put64(b, at, v);
        save(path, b);
        expect_refused(path, request(false), word);
    };
    for (uint64_t bad : {uint64_t(0) - 4096, uint64_t(1) << 63, uint64_t(1) << 40, uint64_t(whole.size()), uint64_t(7)}) {
        refused64(tree + 24, bad, "cannot be read"); /* to the root */
        refused64(tile + 8, bad, "cannot be read");  /* to the upper node */
    }
    for (int far : {256, 257, -257, -256}) { /* 4096ths of a root tile's place; 21 bits a coordinate */
        refused64(tile, uint64_t(far & 0x1fffff) << 42, "beyond");
        refused64(tile, uint64_t(far & 0x1fffff), "beyond");
    }
    refused64(0, 1, "no NanoVDB");
    refused64(16, uint64_t(1) << 62, "list of grids");     /* the grid's size, unpacked */
    refused64(24, uint64_t(1) << 62, "list of grids");     /* and packed */
    refused64(24, whole.size() * 2, "list of grids");
    Bytes b = whole;
    put32(b, root + 24, 0xffffffff); /* tiles of the root */
    save(path, b);
    expect_refused(path, request(false), "cannot be read");
    b = whole;
    put32(b, 8, 31u << 21);
    save(path, b);
    expect_refused(path, request(false), "layout 31");
    /* all children of the upper node that there can be are the one that is: many ways to one node */
    using Upper = nanovdb::NanoUpper<float>::DataType;
    const size_t masks = offsetof(Upper, mChildMask), table = offsetof(Upper, mTable);
    b = whole;
    uint64_t child;
    memcpy(&child, b.data() + upper + table, 8);
    for (size_t i = 0; i < 4096; i++) b[upper + masks + i] = 0xff;
    for (size_t i = 0; i < 32768; i++) put64(b, upper + table + 8 * i, child);
    save(path, b);
    expect_refused(path, request(false), "not a tree");
}

static void hostile_exr(void **)
{
    const std::string path = std::string(temp_dir) + "/a.exr";
    Samples s;
    write_exr(path, s, EXR_STACKED);
    Bytes b = load_bytes(path);
    auto find = [&](const char *name) {
        const size_t n = strlen(name) + 1;
        return size_t(std::search(b.begin(), b.end(), name, name + n) - b.begin()) + n;
    };
    const size_t dims = find("dims") + 4 + 4, window = find("dataWindow") + 6 + 4;
    const Bytes whole = b;
    for (uint32_t bad : {0u, 0xffffffffu, 0x7fffffffu, 5u}) {
        put32(b, dims + 4, bad);
        save(path, b);
        expect_refused(path, request(false), "dims");
    }
    b = whole;
    put32(b, window + 8, 0x7ffffff0);
    save(path, b);
    expect_refused(path, request(false), path.c_str());
    b = whole;
    put32(b, window + 8, 999999);
    put32(b, window + 12, 99999999);
    put32(b, dims, 1000000);
    put32(b, dims + 4, 100000000);
    put32(b, dims + 8, 1);
    save(path, b);
    expect_refused(path, request(false), path.c_str());
}

/* --- grids by name, and vectors ------------------------------------------------------------------- */

static void uni_files_have_siblings(void **)
{
    const std::string at = std::string(temp_dir) + "/";
    save(at + "phi_0007.uni", gzip(uni_bytes(samples, '3', 17)));
    save(at + "vel_0007.uni", gzip(uni_bytes(samples, '3', 12, 3)));
    VolumeRequest r = request(true);
    const char *const names[] = {"vel", "phi"};
    r.velocity = "vel";
    r.nattribute = 2;
    r.attribute = names;
    Volume v;
    Err err = {};
    if (!volume_read((at + "phi_0007.uni").c_str(), &r, &v, &err)) fail_msg("%s", err.text);
    assert_string_equal(v.name, "phi");
    assert_int_equal(v.kind, VOLUME_LEVEL_SET);
    assert_true(v.has_velocity && v.velocity.staggered);
    for (int k = 0; k < 3; k++) assert_true(grid_at(&v.velocity, 3, 4, 5, k) == samples.at(3, 4, 5) * (k == 0 ? 1 : k == 1 ? -1 : 2));
    assert_true(v.nattribute == 2 && v.attribute[0].ncomp == 3 && v.attribute[1].ncomp == 1);
    volume_free(&v);
    r.velocity = "wind";
    expect_refused(at + "phi_0007.uni", r, "no vector grid 'wind'");
    r.velocity = NULL;
    r.grid = "rho";
    expect_refused(at + "phi_0007.uni", r, "no grid 'rho'");
}

static void expect_same_grid(const ::Grid *a, const ::Grid *b, float within)
{
    assert_true(a->ncomp == b->ncomp && a->staggered == b->staggered);
    for (int k = 0; k < 3; k++) assert_true(a->lo[k] == b->lo[k] && a->hi[k] == b->hi[k] && a->background[k] == b->background[k]);
    assert_memory_equal(&a->xform, &b->xform, sizeof a->xform);
    for (int z = a->lo[2] - 9; z <= a->hi[2] + 9; z++)
        for (int y = a->lo[1] - 9; y <= a->hi[1] + 9; y++)
            for (int x = a->lo[0] - 9; x <= a->hi[0] + 9; x++)
                for (int k = 0; k < a->ncomp; k++)
                    if (!(std::fabs(grid_at(a, x, y, z, k) - grid_at(b, x, y, z, k)) <= within)) fail_msg("(%d, %d, %d)[%d]", x, y, z, k);
}

/* Narrow bands with tiles, negative places, turned axes, vectors; several grids in a file. */
static void nvdb_is_read_as_vdb_is(void **)
{
    const std::string vdb = std::string(temp_dir) + "/both.vdb", nvdb = std::string(temp_dir) + "/both.nvdb";
    auto phi = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(21, openvdb::Vec3f(-30, 5, 1), 0.5f);
    auto smoke = openvdb::FloatGrid::create(0);
    auto wind = openvdb::Vec3SGrid::create(openvdb::Vec3f(1, 2, 3));
    phi->setName("phi");
    phi->transform().postRotate(0.3);
    smoke->setName("density");
    smoke->setGridClass(openvdb::GRID_FOG_VOLUME);
    smoke->fill(openvdb::CoordBBox(openvdb::Coord(-130), openvdb::Coord(5)), 0.75f);
    wind->setName("wind");
    wind->setGridClass(openvdb::GRID_STAGGERED);
    wind->fill(openvdb::CoordBBox(openvdb::Coord(-3), openvdb::Coord(30, 9, 7)), openvdb::Vec3f(-1, 0.5f, 7));
    openvdb::io::File file(vdb);
    file.write(openvdb::GridPtrVec{phi, smoke, wind});
    file.close();
    for (nanovdb::io::Codec codec : {NVDB_PLAIN, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC})
        for (bool quantised : {false, true}) {
            std::vector<nanovdb::GridHandle<nanovdb::HostBuffer>> all;
            if (quantised) all.push_back(nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, nanovdb::Fp16>(*phi));
            else all.push_back(nanovdb::openToNanoVDB(*phi));
            all.push_back(nanovdb::openToNanoVDB(*smoke));
            all.push_back(nanovdb::openToNanoVDB(*wind));
            nanovdb::io::writeGrids(nvdb, all, codec);
            for (const char *name : {"phi", "density"}) {
                VolumeRequest r = {};
                r.grid = name;
                r.velocity = "wind";
                Volume a, b;
                Err err = {};
                if (!volume_read(vdb.c_str(), &r, &a, &err) || !volume_read(nvdb.c_str(), &r, &b, &err)) fail_msg("%s", err.text);
                assert_int_equal(a.kind, b.kind);
                assert_string_equal(a.name, b.name);
                expect_same_grid(&a.surface, &b.surface, quantised ? 1e-3f : 0);
                expect_same_grid(&a.velocity, &b.velocity, 0);
                volume_free(&a);
                volume_free(&b);
            }
        }
}

static void exr_channels_are_grids(void **)
{
    const std::string path = std::string(temp_dir) + "/c.exr";
    for (exr_pixel_type_t type : {EXR_PIXEL_FLOAT, EXR_PIXEL_HALF, EXR_PIXEL_UINT}) {
        Samples s;
        for (float &v : s.value) v = type == EXR_PIXEL_UINT ? std::floor(40 + v) : std::floor(v * 4) / 4; /* halves and uints hold it */
        ExrImage image;
        image.type = type;
        image.channels = {"v.x", "v.y", "v.z", "density", "other"};
        write_exr(path, s, EXR_PARTS, image);
        VolumeRequest r = request(true);
        r.velocity = "v";
        Volume v;
        Err err = {};
        if (!volume_read(path.c_str(), &r, &v, &err)) fail_msg("%s", err.text);
        assert_string_equal(v.name, "density");
        assert_int_equal(v.kind, VOLUME_DENSITY);
        assert_true(grid_at(&v.surface, 20, 1, 23, 0) == s.at(20, 1, 23) && grid_at(&v.velocity, 2, 17, 3, 2) == s.at(2, 17, 3));
        volume_free(&v);
        r.grid = "nothing";
        expect_refused(path, r, "v.x");
    }
}

/* --- the rest ------------------------------------------------------------------------------------- */

int main(int argc, char **argv)
{
    if (argc == 3 && strcmp(argv[1], "--write") == 0) {
        std::vector<std::string> placed;
        write_all(samples, argv[2], &placed);
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_samples_give_the_same_grid),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(mutated_files_do_no_harm),
        cmocka_unit_test(hostile_uni),
        cmocka_unit_test(hostile_nrrd),
        cmocka_unit_test(nrrd_types_and_places),
        cmocka_unit_test(hostile_nvdb),
        cmocka_unit_test(hostile_exr),
        cmocka_unit_test(uni_files_have_siblings),
        cmocka_unit_test(nvdb_is_read_as_vdb_is),
        cmocka_unit_test(exr_channels_are_grids),
    };
    return cmocka_run_group_tests_name("formats", tests, temp_open, temp_close);
}
