/* volume_files.h: one grid of samples written in every format that is read, for tests. */
#pragma once
#include <nanovdb/util/OpenToNanoVDB.h>
#include <OpenEXR/openexr.h>
#include <bzlib.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <zlib.h>

#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <nanovdb/util/IO.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

using Bytes = std::vector<uint8_t>;

/* base.h has a NONE of its own. */
static const nanovdb::io::Codec NVDB_PLAIN = nanovdb::io::Codec::NONE;

/* Two balls that overlap, negative inside; no side like another, so that mixed-up axes show. x fastest. */
struct Samples {
    int n[3];
    double spacing[3] = {0.5, 0.25, 0.5}, origin[3] = {1, -2, 3};
    std::vector<float> value;
    Samples(int nx = 21, int ny = 18, int nz = 24) : n{nx, ny, nz}
    {
        for (int z = 0; z < n[2]; z++)
            for (int y = 0; y < n[1]; y++)
                for (int x = 0; x < n[0]; x++) value.push_back(float(std::min(ball(x - 8.3, y - 9.1, z - 8.2), ball(x - 11.9, y - 8.7, z - 14.1))));
    }
    static double ball(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 4.6; }
    size_t bytes() const { return value.size() * sizeof(float); }
    float at(int x, int y, int z) const { return value[size_t(x) + size_t(n[0]) * (size_t(y) + size_t(n[1]) * size_t(z))]; }
};

static inline void save(const std::string &path, const Bytes &b)
{
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char *>(b.data()), std::streamsize(b.size()));
}

static inline Bytes load_bytes(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(in), {});
}

template <typename T> static void add(Bytes &to, const T *from, size_t count)
{
    const size_t old = to.size();
    to.resize(old + count * sizeof(T));
    if (count) memcpy(to.data() + old, from, count * sizeof(T));
}
static inline void add(Bytes &to, const std::string &s) { add(to, s.data(), s.size()); }

static inline Bytes gzip(const Bytes &b)
{
    z_stream z = {};
    deflateInit2(&z, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
    Bytes out(deflateBound(&z, b.size()) + 64);
    z.next_in = const_cast<Bytef *>(b.data());
    z.avail_in = uInt(b.size());
    z.next_out = out.data();
    z.avail_out = uInt(out.size());
    deflate(&z, Z_FINISH);
    out.resize(z.total_out);
    deflateEnd(&z);
    return out;
}

static inline Bytes bzip2(const Bytes &b)
{
    unsigned size = unsigned(b.size() + b.size() / 100 + 1000);
    Bytes out(size), in = b;
    BZ2_bzBuffToBuffCompress(reinterpret_cast<char *>(out.data()), &size, reinterpret_cast<char *>(in.data()), unsigned(in.size()), 9, 0, 0);
    out.resize(size);
    return out;
}

static inline Bytes raw_bytes(const Samples &s)
{
    Bytes b;
    add(b, s.value.data(), s.value.size());
    return b;
}

static inline Bytes npy_bytes(const Samples &s)
{
    char dict[118];
    snprintf(dict, sizeof dict, "{'descr': '<f4', 'fortran_order': True, 'shape': (%d, %d, %d), }", s.n[0], s.n[1], s.n[2]);
    std::string text = dict;
    text.resize(117, ' ');
    Bytes b = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, 118, 0};
    add(b, text + "\n");
    add(b, s.value.data(), s.value.size());
    return b;
}

/* `fields` are lines of their own; the samples as the encoding has them, or none. */
static inline Bytes nrrd_bytes(const Samples &s, const std::string &encoding, const std::string &fields, const Bytes &data)
{
    char head[300];
    snprintf(head, sizeof head, "NRRD0005\n# a comment\ntype: float\ndimension: 3\nsizes: %d %d %d\nencoding: %s\nendian: little\n", s.n[0], s.n[1], s.n[2], encoding.c_str());
    Bytes b;
    add(b, head + fields + "\n");
    b.insert(b.end(), data.begin(), data.end());
    return b;
}

static inline std::string nrrd_directions(const Samples &s)
{
    char text[300];
    snprintf(text, sizeof text, "space: left-posterior-superior\nspace directions: (%g,0,0) (0, %g ,0) (0,0,%g)\nspace origin: (%g,%g,%g)\nkinds: domain domain domain\n",
             s.spacing[0], s.spacing[1], s.spacing[2], s.origin[0], s.origin[1], s.origin[2]);
    return text;
}

static inline std::string nrrd_spacings(const Samples &s)
{
    char text[300];
    snprintf(text, sizeof text, "spacings: %g %g %g\naxis mins: %.9g %.9g %.9g\ncenters: cell node cell\nkey:=value\n", s.spacing[0], s.spacing[1], s.spacing[2],
             s.origin[0] - 0.5 * s.spacing[0], s.origin[1], s.origin[2] - 0.5 * s.spacing[2]);
    return text;
}

static inline Bytes text_bytes(const Samples &s)
{
    Bytes b;
    char word[32];
    for (size_t i = 0; i < s.value.size(); i++) {
        snprintf(word, sizeof word, "%.9g%s", double(s.value[i]), i % 7 ? " " : "\n");
        add(b, std::string(word));
    }
    b.back() = '\n';
    return b;
}

/* type: 17 a level set, 1 real; ncomp 3 repeats the value with signs of its own. Not yet packed. */
static inline Bytes uni_bytes(const Samples &s, char version, int type, int ncomp = 1)
{
    Bytes b = {'M', 'N', 'T', uint8_t(version)};
    const int32_t head[6] = {s.n[0], s.n[1], s.n[2], type, ncomp == 3 ? 2 : 1, 4 * ncomp};
    add(b, head, 6);
    if (version > '1') b.resize(b.size() + 264);
    for (float v : s.value) {
        const float three[3] = {v, -v, 2 * v};
        add(b, three, size_t(ncomp));
    }
    return b;
}

static inline openvdb::FloatGrid::Ptr vdb_grid(const Samples &s)
{
    openvdb::initialize();
    auto g = openvdb::FloatGrid::create(0);
    g->setName("phi");
    g->setGridClass(openvdb::GRID_LEVEL_SET);
    openvdb::Mat4d m = openvdb::Mat4d::identity();
    for (int a = 0; a < 3; a++) {
        m(a, a) = s.spacing[a];
        m(3, a) = s.origin[a];
    }
    g->setTransform(openvdb::math::Transform::createLinearTransform(m));
    auto access = g->getAccessor();
    for (int z = 0; z < s.n[2]; z++)
        for (int y = 0; y < s.n[1]; y++)
            for (int x = 0; x < s.n[0]; x++) access.setValueOn(openvdb::Coord(x, y, z), s.at(x, y, z));
    return g;
}

static inline void write_vdb(const std::string &path, const Samples &s)
{
    openvdb::io::File file(path);
    file.write(openvdb::GridPtrVec{vdb_grid(s)});
    file.close();
}

static inline void write_nvdb(const std::string &path, const Samples &s, nanovdb::io::Codec codec)
{
    auto handle = nanovdb::openToNanoVDB(*vdb_grid(s));
    nanovdb::io::writeGrid(path, handle, codec);
}

/* --- OpenEXR ------------------------------------------------------------------------------------ */

enum ExrKind { EXR_PARTS, EXR_STACKED };

/* One channel; what is written there are `type` pixels made of the samples. */
struct ExrImage {
    exr_compression_t compression = EXR_COMPRESSION_ZIP;
    exr_pixel_type_t type = EXR_PIXEL_FLOAT;
    std::vector<std::string> channels = {"phi"};
};

static inline void exr_try(exr_result_t code)
{
    if (code != EXR_ERR_SUCCESS) throw std::runtime_error(exr_get_default_error_message(code));
}

static inline void exr_write_part(exr_context_t f, int part, int w, int h, const float *value, exr_pixel_type_t type)
{
    const std::vector<uint32_t> whole(value, type == EXR_PIXEL_UINT ? value + size_t(w) * size_t(h) : value);
    const void *from = type == EXR_PIXEL_UINT ? static_cast<const void *>(whole.data()) : value;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    int32_t lines;
    exr_try(exr_get_scanlines_per_chunk(f, part, &lines));
    for (int y = 0; y < h; y += lines) {
        exr_chunk_info_t chunk;
        exr_try(exr_write_scanline_chunk_info(f, part, y, &chunk));
        exr_try(y == 0 ? exr_encoding_initialize(f, part, &chunk, &pipe) : exr_encoding_update(f, part, &chunk, &pipe));
        for (int c = 0; c < pipe.channel_count; c++) {
            exr_coding_channel_info_t *ch = &pipe.channels[c];
            ch->user_data_type = type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
            ch->user_bytes_per_element = ch->user_pixel_stride = 4;
            ch->user_line_stride = 4 * w;
            ch->encode_from_ptr = static_cast<const uint8_t *>(from) + 4 * size_t(y) * size_t(w);
        }
        if (y == 0) exr_try(exr_encoding_choose_default_routines(f, part, &pipe));
        exr_try(exr_encoding_run(f, part, &pipe));
    }
    exr_try(exr_encoding_destroy(f, &pipe));
}

static inline void write_exr(const std::string &path, const Samples &s, ExrKind kind, const ExrImage &image = {})
{
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t f;
    int parts = kind == EXR_PARTS ? s.n[2] : 1, h = kind == EXR_PARTS ? s.n[1] : s.n[1] * s.n[2];
    exr_try(exr_start_write(&f, path.c_str(), EXR_WRITE_FILE_DIRECTLY, &how));
    for (int p = 0; p < parts; p++) {
        int part;
        exr_try(exr_add_part(f, ("slice" + std::to_string(p)).c_str(), EXR_STORAGE_SCANLINE, &part));
        exr_try(exr_initialize_required_attr_simple(f, part, s.n[0], h, image.compression));
        for (const std::string &name : image.channels) exr_try(exr_add_channel(f, part, name.c_str(), image.type, EXR_PERCEPTUALLY_LINEAR, 1, 1));
        const exr_attr_v3d_t spacing = {s.spacing[0], s.spacing[1], s.spacing[2]}, origin = {s.origin[0], s.origin[1], s.origin[2]};
        const exr_attr_v3i_t dims = {s.n[0], s.n[1], s.n[2]};
        exr_try(exr_attr_set_v3d(f, part, "spacing", &spacing));
        exr_try(exr_attr_set_v3d(f, part, "origin", &origin));
        if (kind == EXR_STACKED) exr_try(exr_attr_set_v3i(f, part, "dims", &dims));
    }
    exr_try(exr_write_header(f));
    for (int p = 0; p < parts; p++) exr_write_part(f, p, s.n[0], h, s.value.data() + size_t(p) * size_t(s.n[0]) * size_t(h), image.type);
    exr_try(exr_finish(&f));
}

/* --- all of them ---------------------------------------------------------------------------------- */

/* Writes them all to a folder; `placed`: those that need --spacing and --origin of the command. */
static inline std::vector<std::string> write_all(const Samples &s, const std::string &folder, std::vector<std::string> *placed)
{
    const std::string at = folder + "/";
    save(at + "a.npy", npy_bytes(s));
    save(at + "a.raw", raw_bytes(s));
    save(at + "mnt1_0001.uni", gzip(uni_bytes(s, '1', 1)));
    save(at + "mnt2_0001.uni", gzip(uni_bytes(s, '2', 17)));
    save(at + "mnt3_0001.uni", gzip(uni_bytes(s, '3', 17)));
    save(at + "plain_0001.uni", uni_bytes(s, '3', 16));
    *placed = {at + "a.npy", at + "a.raw", at + "mnt1_0001.uni", at + "mnt2_0001.uni", at + "mnt3_0001.uni", at + "plain_0001.uni"};

    save(at + "raw.nrrd", nrrd_bytes(s, "raw", nrrd_directions(s), raw_bytes(s)));
    save(at + "gzip.nrrd", nrrd_bytes(s, "GZip", nrrd_spacings(s) + "content: phi\n", gzip(raw_bytes(s))));
    save(at + "bzip2.nrrd", nrrd_bytes(s, "bzip2", nrrd_spacings(s), bzip2(raw_bytes(s))));
    save(at + "text.nrrd", nrrd_bytes(s, "ascii", nrrd_directions(s), text_bytes(s)));
    save(at + "head.nhdr", nrrd_bytes(s, "raw", nrrd_directions(s) + "byte skip: -1\ndata file: head.bytes\n", {}));
    Bytes with_head = {'x', '\n', 'y'};
    add(with_head, raw_bytes(s).data(), s.bytes());
    save(at + "head.bytes", with_head);
    write_vdb(at + "a.vdb", s);
    write_nvdb(at + "none.nvdb", s, NVDB_PLAIN);
    write_nvdb(at + "zip.nvdb", s, nanovdb::io::Codec::ZIP);
    write_nvdb(at + "blosc.nvdb", s, nanovdb::io::Codec::BLOSC);
    write_exr(at + "parts.exr", s, EXR_PARTS);
    write_exr(at + "stacked.exr", s, EXR_STACKED);
    ExrImage piz;
    piz.compression = EXR_COMPRESSION_PIZ;
    write_exr(at + "piz.exr", s, EXR_STACKED, piz);
    std::vector<std::string> own;
    for (const char *name : {"raw.nrrd", "gzip.nrrd", "bzip2.nrrd", "text.nrrd", "head.nhdr", "a.vdb", "none.nvdb", "zip.nvdb", "blosc.nvdb", "parts.exr", "stacked.exr", "piz.exr"})
        own.push_back(at + name);
    return own;
}
