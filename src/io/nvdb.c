/* A NanoVDB file: segments, one behind the other, of a header (mark, version, number of grids, codec), a record with
 * a name for each grid, and the grids' bytes, packed by the codec. */
#include "io/bytes.h"
#include "io/nvdb_priv.h"
#include "io/stream.h"

#include <blosc.h>
#include <string.h>
#include <zlib.h>

enum { HEADER_BYTES = 16, RECORD_BYTES = 176, NAME_MAX_BYTES = 1 << 12, BLOSC_HEADER = 16 };
enum { CODEC_NONE, CODEC_ZIP, CODEC_BLOSC, CODEC_COUNT };
enum { RATIO_MAX = 1032 };                    /* of zip; NanoVDB's blosc, with lz4 inside, reaches 255 */
static const uint64_t CHUNK_MAX = 1u << 30;   /* of blosc */

typedef struct NvdbEntry {
    int64_t at;
    uint64_t packed, size; /* bytes */
    uint32_t type;
    int codec;
} NvdbEntry;

typedef struct NvdbFile {
    VolumeFile base;
    InFile in;
    int capgrid;
    NvdbEntry *grid; /* [nentry] */
} NvdbFile;

static bool nvdb_damaged(const char *path, Err *err)
{
    return fail(err, ERR_INPUT, "%.600s: its list of grids is damaged or cut short; write or copy the file again", path);
}

/* --- the list of grids -------------------------------------------------------------------------- */

static bool check_header(const char *path, const uint8_t *b, Err *err)
{
    uint32_t major = get_u32(b + 8) >> 21;
    if (get_u64(b) != nvdb_magic()) return fail(err, ERR_INPUT, "%.600s: is no NanoVDB file", path);
    if (major != nvdb_major())
        return fail(err, ERR_INPUT, "%.600s: has NanoVDB's layout %u, and %u is read; convert it again with that version, or to .vdb", path, major, nvdb_major());
    if (get_u16(b + 14) >= CODEC_COUNT) return fail(err, ERR_INPUT, "%.600s: its codec %u is not known; write it as none, zip or blosc", path, get_u16(b + 14));
    return true;
}

/* The record of one grid and its name; *at moves behind them. */
static bool add_grid(NvdbFile *nvdb, int codec, int64_t *at, Err *err)
{
    VolumeFile *f = &nvdb->base;
    uint8_t b[RECORD_BYTES];
    if (!infile_read(&nvdb->in, *at, sizeof b, b, err)) return false;
    uint32_t nname = get_u32(b + 136);
    if (nname > NAME_MAX_BYTES) return nvdb_damaged(f->path, err);
    char *name = NEW0(char, nname + 1);
    bool ok = infile_read(&nvdb->in, *at + RECORD_BYTES, nname, name, err);
    *at += RECORD_BYTES + (int64_t)nname;
    if (ok) {
        NvdbEntry g = {.size = get_u64(b), .packed = get_u64(b + 8), .type = get_u32(b + 32), .codec = codec};
        int ncomp;
        const char *type = nvdb_type_name(g.type, &ncomp);
        RESERVE(nvdb->grid, nvdb->capgrid, f->nentry + 1);
        nvdb->grid[f->nentry] = g;
        VolumeEntry *e = volume_add_entry(f, name, type, ncomp);
        snprintf(e->grid_class, sizeof e->grid_class, "%s", nvdb_class_name(get_u32(b + 36)));
    }
    mem_free(name);
    return ok;
}

/* The grids' bytes follow the records in the same order. */
static bool place_grids(NvdbFile *nvdb, int first, int64_t *at, Err *err)
{
    for (int i = first; i < nvdb->base.nentry; i++) {
        NvdbEntry *g = &nvdb->grid[i];
        g->at = *at;
        if (g->packed > (uint64_t)(nvdb->in.length - *at)) return nvdb_damaged(nvdb->base.path, err);
        uint64_t most = g->codec == CODEC_NONE ? g->packed : g->packed * RATIO_MAX; /* a file has fewer than 2^53 bytes */
        if (g->size > most || (g->codec == CODEC_NONE && g->size != g->packed)) return nvdb_damaged(nvdb->base.path, err);
        *at += (int64_t)g->packed;
    }
    return true;
}

static bool nvdb_open(VolumeFile *f, Err *err)
{
    NvdbFile *nvdb = (NvdbFile *)f;
    if (!infile_open(&nvdb->in, f->path, err)) return false;
    int64_t at = 0;
    do {
        uint8_t b[HEADER_BYTES];
        int first = f->nentry;
        if (!infile_read(&nvdb->in, at, sizeof b, b, err) || !check_header(f->path, b, err)) return false;
        at += HEADER_BYTES;
        for (int count = get_u16(b + 12); count > 0; count--)
            if (!add_grid(nvdb, get_u16(b + 14), &at, err)) return false;
        if (!place_grids(nvdb, first, &at, err)) return false;
    } while (at < nvdb->in.length);
    return true;
}

/* --- a grid's bytes ----------------------------------------------------------------------------- */

static bool unpack_zip(const uint8_t *from, uint64_t packed, uint8_t *to, uint64_t size)
{
    if (packed < 8 || get_u64(from) != packed - 8) return false;
    uLongf got = size;
    return uncompress(to, &got, from + 8, packed - 8) == Z_OK && got == size;
}

/* Chunks of a GiB, the last one shorter, each behind its packed length. */
static bool unpack_blosc(const uint8_t *from, uint64_t packed, uint8_t *to, uint64_t size)
{
    while (size > 0) {
        uint64_t chunk = size < CHUNK_MAX ? size : CHUNK_MAX, length;
        size_t holds;
        if (packed < 8 + BLOSC_HEADER || (length = get_u64(from)) > packed - 8 || length < BLOSC_HEADER) return false;
        /* blosc goes by the sizes in the chunk's own header */
        if (blosc_cbuffer_validate(from + 8, length, &holds) != 0 || holds != chunk) return false;
        if (blosc_decompress_ctx(from + 8, to, chunk, 1) != (int)chunk) return false;
        from += 8 + length;
        packed -= 8 + length;
        to += chunk;
        size -= chunk;
    }
    return packed == 0;
}

static bool unpack(NvdbFile *nvdb, const NvdbEntry *g, uint8_t *to, Err *err)
{
    if (g->codec == CODEC_NONE) return infile_read(&nvdb->in, g->at, g->size, to, err);
    uint8_t *packed = NEW(uint8_t, g->packed);
    bool ok = infile_read(&nvdb->in, g->at, g->packed, packed, err);
    if (ok && !(g->codec == CODEC_ZIP ? unpack_zip : unpack_blosc)(packed, g->packed, to, g->size))
        ok = fail(err, ERR_INPUT, "%.600s: a packed grid is damaged; write or copy the file again", nvdb->base.path);
    mem_free(packed);
    return ok;
}

static bool nvdb_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    NvdbFile *nvdb = (NvdbFile *)f;
    const NvdbEntry *g = &nvdb->grid[i];
    uint8_t *room = NEW(uint8_t, g->size + NVDB_ALIGNMENT);
    uint8_t *data = room + (NVDB_ALIGNMENT - (uintptr_t)room % NVDB_ALIGNMENT);
    NvdbGrid grid = {.path = f->path, .name = f->entry[i].name, .data = data, .size = g->size, .type = g->type};
    bool ok = unpack(nvdb, g, data, err) && nvdb_decode(&grid, out, err);
    mem_free(room);
    return ok;
}

static void nvdb_close(VolumeFile *f)
{
    NvdbFile *nvdb = (NvdbFile *)f;
    infile_close(&nvdb->in);
    mem_free(nvdb->grid);
}

const Format NVDB_FORMAT = {"NanoVDB", ".nvdb", sizeof(NvdbFile), nvdb_open, nvdb_read, nvdb_close};
