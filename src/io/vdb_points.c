/* vdb_points.c: OpenVDB's point grids (trees of ptdataidx32), read without OpenVDB: a tree as vdb_walk.c knows it, whose
 * leaves' buffers come in passes over all leaves:
 *
 *   0              the size of the leaf's offsets, 16 bits
 *   1              attributes: names and types (where they are not those of the leaf before), then sizes and flags
 *   2 ... n+1      for each attribute: the sizes of the pages its leaves' values are packed into
 *   n+2            the leaf's mask and offsets: where in the leaf's points each voxel's end
 *   n+3 ... 2n+2   for each attribute: the pages
 *
 * A place is its voxel's plus an offset of -0.5 to 0.5, in the grid's index space. Every count is checked against the
 * bytes that are there before anything is made for it. */
#include "io/bytes.h"
#include "io/points_priv.h"
#include "io/vdb_priv.h"

#include <blosc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ATTRIBUTES_MAX = 256, NAME_MAX_BYTES = 256, PAGE_MAX = 1 << 27, COORD_LIMIT = 1 << 20, SIDE_ROOT = 4096, OFFSETS_BYTES = GRID_CELLS * 4 };

typedef struct Attribute {
    char name[NAME_MAX_BYTES], type[64], codec[64];
} Attribute;

/* What a leaf holds of an attribute: `bytes` of its pages. */
typedef struct Piece {
    uint64_t bytes;
    uint32_t count; /* values; 1 where `uniform` */
    bool uniform, paged;
} Piece;

typedef struct Leaf {
    int at[3];
    uint32_t offset[GRID_CELLS]; /* where the voxel's points end, z fastest */
} Leaf;

typedef struct Page {
    int32_t packed, size; /* bytes; packed 0: stored as they are */
} Page;

typedef struct Pages {
    bool loose;           /* in files that are not compressed: no pages but each leaf's bytes, 0 before those that differ */
    int n, cap;
    Page *page;
} Pages;

typedef struct Cloud {
    const VdbTree *tree;
    const uint8_t *p, *end;
    const char *wrong;
    int nleaf, capleaf;
    Leaf *leaf;
    int nattribute;
    Attribute *attribute;
    Piece *piece;         /* [nleaf][nattribute] */
    Pages *pages;         /* [nattribute] */
} Cloud;

static Piece *piece_of(const Cloud *c, int leaf, int attribute) { return &c->piece[(size_t)leaf * (size_t)c->nattribute + (size_t)attribute]; }

static bool wrong(Cloud *c, const char *what)
{
    if (!c->wrong) c->wrong = what;
    return false;
}

static const uint8_t *take(Cloud *c, uint64_t n)
{
    if (c->wrong || n > (uint64_t)(c->end - c->p)) {
        wrong(c, "it is cut short");
        return NULL;
    }
    const uint8_t *p = c->p;
    c->p += n;
    return p;
}

static bool take_u32(Cloud *c, uint32_t *out)
{
    const uint8_t *p = take(c, 4);
    if (p) *out = get_u32(p);
    return p != NULL;
}

static bool take_u64(Cloud *c, uint64_t *out)
{
    const uint8_t *p = take(c, 8);
    if (p) *out = get_u64(p);
    return p != NULL;
}

static bool take_text(Cloud *c, char *to, size_t size)
{
    uint32_t n;
    if (!take_u32(c, &n)) return false;
    const uint8_t *p = take(c, n);
    if (!p) return false;
    if (n >= size) return wrong(c, "a name in it is too long");
    memcpy(to, p, n);
    to[n] = 0;
    return true;
}

/* --- the tree -------------------------------------------------------------------------------------------- */

static bool bit(const uint8_t *mask, int i) { return mask[i >> 3] >> (i & 7) & 1; }

static int count_bits(const uint8_t *mask, int bytes)
{
    int n = 0;
    for (int i = 0; i < bytes; i++) n += __builtin_popcount(mask[i]);
    return n;
}

/* A node's tile values, which say nothing about points: stepped over. `log2side`: of the node. */
static bool skip_values(Cloud *c, const uint8_t *mask, int count)
{
    enum { PLAIN, MINUS, ONE, MASKED, MASKED_ONE, MASKED_TWO, ALL };
    const uint8_t *how = take(c, 1);
    if (!how) return false;
    if (*how > ALL) return wrong(c, "a node's kind of mask is not known");
    uint64_t told = *how == ONE || *how == MASKED_ONE ? 1 : *how == MASKED_TWO ? 2 : 0;
    if (!take(c, told * 4 + (*how >= MASKED && *how <= MASKED_TWO ? (uint64_t)count / 8 : 0))) return false;
    bool all = !(c->tree->compression & VDB_COMPRESS_ACTIVE) || *how == ALL;
    uint64_t want = 4 * (uint64_t)(all ? count : count_bits(mask, count / 8)), length;
    if (!(c->tree->compression & (VDB_COMPRESS_BLOSC | VDB_COMPRESS_ZIP))) return take(c, want) != NULL;
    if (!take_u64(c, &length)) return false;
    if ((int64_t)length > 0) return take(c, length) != NULL;
    return -length == want ? take(c, want) != NULL : wrong(c, "a chunk has another size than its samples");
}

/* An inner node at `at` whose children have sides of 2^child samples. */
static bool walk_node(Cloud *c, const int at[3], int log2n, int child)
{
    int count = 1 << 3 * log2n;
    const uint8_t *children = take(c, (uint64_t)count / 8), *values = take(c, (uint64_t)count / 8);
    if (!children || !values || !skip_values(c, values, count)) return false;
    for (int i = 0; i < count; i++) {
        if (!bit(children, i)) continue;
        const int to[3] = {at[0] + ((i >> 2 * log2n) << child), at[1] + ((i >> log2n & ((1 << log2n) - 1)) << child), at[2] + ((i & ((1 << log2n) - 1)) << child)};
        if (child > 3) {
            if (!walk_node(c, to, 4, 3)) return false;
            continue;
        }
        if (!take(c, GRID_CELLS / 8)) return false;
        RESERVE(c->leaf, c->capleaf, c->nleaf + 1);
        memcpy(c->leaf[c->nleaf++].at, to, sizeof to);
    }
    return true;
}

static bool walk_tree(Cloud *c)
{
    uint32_t nbuffer, background, ntile, nchild;
    if (!take_u32(c, &nbuffer) || !take_u32(c, &background) || !take_u32(c, &ntile) || !take_u32(c, &nchild)) return false;
    if (nbuffer != 1) return wrong(c, "it has several buffers, as only old files had");
    if (!take(c, (uint64_t)ntile * 17)) return false;
    for (uint32_t i = 0; i < nchild; i++) {
        const uint8_t *p = take(c, 12);
        if (!p) return false;
        int at[3];
        for (int a = 0; a < 3; a++) {
            at[a] = (int)get_u32(p + 4 * a);
            if (at[a] % SIDE_ROOT != 0) return wrong(c, "a node lies off the raster");
            if (at[a] < -COORD_LIMIT || at[a] >= COORD_LIMIT) return wrong(c, "points lie beyond +-2^20 voxels from the origin");
        }
        if (!walk_node(c, at, 5, 7)) return false;
    }
    return true;
}

/* --- attributes ---------------------------------------------------------------------------------------------- */

static bool take_metadata(Cloud *c)
{
    uint32_t count, n;
    char text[NAME_MAX_BYTES];
    if (!take_u32(c, &count)) return false;
    for (uint32_t i = 0; i < count; i++)
        if (!take_text(c, text, sizeof text) || !take_text(c, text, sizeof text) || !take_u32(c, &n) || !take(c, n)) return false;
    return true;
}

/* Types by position, then names with their positions, groups, metadata. */
static bool take_descriptor(Cloud *c, Attribute *to, int *count)
{
    uint64_t n, at, ngroup;
    char name[NAME_MAX_BYTES];
    if (!take_u64(c, &n)) return false;
    if (n > ATTRIBUTES_MAX) return wrong(c, "it has more than 256 attributes");
    *count = (int)n;
    for (uint64_t i = 0; i < n; i++) {
        to[i].name[0] = 0;
        if (!take_text(c, to[i].type, sizeof to[i].type) || !take_text(c, to[i].codec, sizeof to[i].codec)) return false;
    }
    for (uint64_t i = 0; i < n; i++) {
        if (!take_text(c, name, sizeof name) || !take_u64(c, &at)) return false;
        if (at >= n) return wrong(c, "an attribute has a place that is not there");
        memcpy(to[at].name, name, sizeof name);
    }
    if (!take_u64(c, &ngroup)) return false;
    for (uint64_t i = 0; i < ngroup; i++)
        if (!take_text(c, name, sizeof name) || !take_u64(c, &at)) return false;
    return take_metadata(c);
}

static bool same_attributes(const Attribute *a, const Attribute *b, int n)
{
    for (int i = 0; i < n; i++)
        if (strcmp(a[i].name, b[i].name) != 0 || strcmp(a[i].type, b[i].type) != 0 || strcmp(a[i].codec, b[i].codec) != 0) return false;
    return true;
}

static bool take_attributes(Cloud *c, int leaf)
{
    const uint8_t *header = take(c, 1);
    Attribute *fresh = NEW0(Attribute, ATTRIBUTES_MAX);
    int n = 0;
    uint64_t more = 0;
    bool ok = header && take_descriptor(c, fresh, &n);
    if (ok && *header > 3) ok = wrong(c, "its leaves have headers of a kind that is not known");
    if (ok && *header & 2) ok = take_u64(c, &more) && take(c, more);
    if (ok && leaf == 0) {
        c->attribute = fresh;
        c->nattribute = n;
        return true;
    }
    if (ok && (n != c->nattribute || !same_attributes(fresh, c->attribute, n))) ok = wrong(c, "its leaves have different attributes; write them with the same");
    mem_free(fresh);
    return ok;
}

static bool take_piece(Cloud *c, Piece *to)
{
    enum { STRIDED = 1, UNIFORM = 2, PAGED = 8, KNOWN = 15 };
    uint64_t bytes;
    if (!take_u64(c, &bytes)) return false;
    const uint8_t *flags = take(c, 2);
    if (!flags || !take_u32(c, &to->count)) return false;
    if (flags[1] > KNOWN) return wrong(c, "an attribute is stored in a way that is not known");
    if (flags[1] & STRIDED && !take(c, 4)) return false;
    if (bytes < 6) return wrong(c, "an attribute has an impossible size");
    to->bytes = bytes - 6;
    to->uniform = flags[1] & UNIFORM;
    to->paged = flags[1] & PAGED;
    return true;
}

/* Pass 1. The leaves after the first share its attributes where its header says so. */
static bool take_pieces(Cloud *c)
{
    bool shared = false;
    for (int l = 0; l < c->nleaf; l++) {
        bool first = l == 0;
        if (!shared) {
            if (c->p < c->end) shared = *c->p & 1;
            if (!take_attributes(c, l)) return false;
        }
        if (first) {
            /* each has 14 bytes or more in the file */
            if ((uint64_t)c->nleaf * (uint64_t)c->nattribute > (uint64_t)(c->end - c->p) / 14) return wrong(c, "it is cut short");
            c->piece = mem_zero((size_t)c->nleaf * (size_t)c->nattribute, sizeof *c->piece);
            c->pages = NEW0(Pages, c->nattribute);
        }
        for (int a = 0; a < c->nattribute; a++)
            if (!take_piece(c, piece_of(c, l, a))) return false;
    }
    return true;
}

/* --- pages ------------------------------------------------------------------------------------------------------- */

static bool take_page_sizes(Cloud *c, int attribute)
{
    Pages *to = &c->pages[attribute];
    uint64_t left = 0; /* of the last page */
    to->loose = !piece_of(c, 0, attribute)->paged;
    for (int l = 0; l < c->nleaf; l++) {
        const Piece *piece = piece_of(c, l, attribute);
        if (piece->paged == to->loose) return wrong(c, "an attribute is stored in two ways");
        if (to->loose) continue;
        if (left == 0) {
            uint32_t packed, size;
            if (!take_u32(c, &packed)) return false;
            Page page = {(int32_t)packed, 0};
            if (page.packed > 0) {
                if (!take_u32(c, &size)) return false;
                page.size = (int32_t)size;
            } else {
                page.size = page.packed == INT32_MIN ? 0 : -page.packed;
                page.packed = 0;
            }
            if (page.size <= 0 || page.size > PAGE_MAX) return wrong(c, "a page has an impossible size");
            RESERVE(to->page, to->cap, to->n + 1);
            to->page[to->n++] = page;
            left = (uint64_t)page.size;
        }
        if (piece->bytes > left) return wrong(c, "an attribute reaches beyond its page");
        left -= piece->bytes;
    }
    return left == 0 || wrong(c, "a page is longer than what it holds");
}

/* blosc pads what is short to 128 bytes; no more than a chunk's header claims is unpacked, and that is bounded. */
static bool unpack(Cloud *c, const uint8_t *from, size_t packed, size_t size, uint8_t *to)
{
    enum { HEADER = 16, PADDED = 128 };
    size_t most = size > PADDED ? size : PADDED;
    if (packed < HEADER || get_u32(from + 12) != packed || get_u32(from + 4) < size || get_u32(from + 4) > most)
        return wrong(c, "a blosc chunk has another size than its values");
    uint8_t *all = NEW(uint8_t, most);
    int got = blosc_decompress_ctx(from, all, most, 1);
    bool ok = got >= 0 && (size_t)got >= size;
    if (ok) memcpy(to, all, size);
    mem_free(all);
    return ok || wrong(c, "a blosc chunk is damaged");
}

static uint8_t *take_loose(Cloud *c, int attribute, bool wanted)
{
    uint64_t all = 0, at = 0;
    for (int l = 0; l < c->nleaf; l++) {
        if (piece_of(c, l, attribute)->bytes > (uint64_t)(c->end - c->p) - all) {
            wrong(c, "it is cut short");
            return NULL;
        }
        all += piece_of(c, l, attribute)->bytes;
    }
    uint8_t *to = wanted ? NEW(uint8_t, all) : NULL;
    for (int l = 0; l < c->nleaf; l++) {
        const Piece *piece = piece_of(c, l, attribute);
        const uint8_t *packed = piece->uniform ? NULL : take(c, 1);
        if (packed && *packed) wrong(c, "an attribute is packed in a way that is not known");
        const uint8_t *from = take(c, piece->bytes);
        if (from && wanted) memcpy(to + at, from, piece->bytes);
        at += piece->bytes;
    }
    return to;
}

/* The attribute's bytes, leaf by leaf; NULL where they are only stepped over, or wrong. */
static uint8_t *take_pages(Cloud *c, int attribute, bool wanted)
{
    const Pages *pages = &c->pages[attribute];
    if (pages->loose) return take_loose(c, attribute, wanted);
    uint64_t all = 0, at = 0, stored = 0;
    for (int i = 0; i < pages->n; i++) {
        all += (uint64_t)pages->page[i].size;
        stored += (uint64_t)(pages->page[i].packed ? pages->page[i].packed : pages->page[i].size);
    }
    /* blosc packs at most some 255 to 1 */
    if (stored > (uint64_t)(c->end - c->p) || all > 256 * stored + 4096) {
        wrong(c, "it is cut short");
        return NULL;
    }
    uint8_t *to = wanted ? NEW(uint8_t, all) : NULL;
    for (int i = 0; i < pages->n; i++) {
        Page page = pages->page[i];
        const uint8_t *from = take(c, (uint64_t)(page.packed ? page.packed : page.size));
        if (from && wanted && !page.packed) memcpy(to + at, from, (size_t)page.size);
        if (!from || (wanted && page.packed && !unpack(c, from, (size_t)page.packed, (size_t)page.size, to + at))) {
            mem_free(to);
            return NULL;
        }
        at += (uint64_t)page.size;
    }
    return to;
}

static bool take_offsets(Cloud *c, Leaf *leaf)
{
    enum { STORED = 0xffff };
    const uint8_t *head = take(c, GRID_CELLS / 8 + 2);
    if (!head) return false;
    size_t packed = get_u16(head + GRID_CELLS / 8);
    const uint8_t *from = take(c, packed == STORED ? OFFSETS_BYTES : packed);
    uint8_t bytes[OFFSETS_BYTES];
    if (!from) return false;
    if (packed == STORED) memcpy(bytes, from, OFFSETS_BYTES);
    else if (!unpack(c, from, packed, OFFSETS_BYTES, bytes)) return false;
    for (int i = 0; i < GRID_CELLS; i++) {
        leaf->offset[i] = get_u32(bytes + 4 * i);
        if (i && leaf->offset[i] < leaf->offset[i - 1]) return wrong(c, "a leaf's offsets go back");
    }
    return true;
}

/* --- from bytes to points --------------------------------------------------------------------------------------- */

static int find_attribute(const Cloud *c, const char *name)
{
    for (int a = 0; a < c->nattribute; a++)
        if (strcmp(c->attribute[a].name, name) == 0) return a;
    return NONE;
}

/* Bytes of one value of a type and codec that are read, or 0. */
static size_t value_size(const Attribute *a)
{
    bool vec = strcmp(a->type, "vec3s") == 0;
    if (strcmp(a->codec, "null") == 0) return vec ? 12 : strcmp(a->type, "float") == 0 ? 4 : 0;
    if (vec && strcmp(a->codec, "fxpt16") == 0) return 6;
    if (vec && strcmp(a->codec, "fxpt8") == 0) return 3;
    return 0;
}

static double component(const uint8_t *p, size_t size, int k)
{
    if (size == 3) return p[k] / 255.0 - 0.5;
    if (size == 6) return get_u16(p + 2 * k) / 65535.0 - 0.5;
    return (double)get_f32(p + 4 * k);
}

/* Points of all leaves, held to what their attribute holds. */
static bool count_points(Cloud *c, int attribute, size_t size, int *out)
{
    uint64_t n = 0;
    for (int l = 0; l < c->nleaf; l++) {
        const Piece *piece = piece_of(c, l, attribute);
        if (piece->count != c->leaf[l].offset[GRID_CELLS - 1]) return wrong(c, "a leaf has another number of values than of points");
        if (piece->bytes != size * (piece->uniform ? 1 : (uint64_t)piece->count)) return wrong(c, "an attribute has another size than its values");
        n += piece->count;
    }
    if (n > INT32_MAX / 2) return wrong(c, "it has more than 2^30 points");
    *out = (int)n;
    return true;
}

static void place_points(const Cloud *c, int attribute, size_t size, const uint8_t *bytes, PointSet *out)
{
    int n = 0;
    for (int l = 0; l < c->nleaf; l++) {
        const Piece *piece = piece_of(c, l, attribute);
        const Leaf *leaf = &c->leaf[l];
        uint32_t i = 0;
        for (int v = 0; v < GRID_CELLS; v++)
            for (; i < leaf->offset[v]; i++) {
                const uint8_t *p = bytes + (piece->uniform ? 0 : i * size);
                Vec3 voxel = vec3(leaf->at[0] + (v >> 6), leaf->at[1] + (v >> 3 & 7), leaf->at[2] + (v & 7));
                Vec3 in = vec3(component(p, size, 0), component(p, size, 1), component(p, size, 2));
                out->place[n++] = affine_to_world(&c->tree->xform, v_add(voxel, in));
            }
        bytes += piece->bytes;
    }
}

static void read_radii(const Cloud *c, int attribute, const uint8_t *bytes, PointSet *out)
{
    int n = 0;
    for (int l = 0; l < c->nleaf; l++) {
        const Piece *piece = piece_of(c, l, attribute);
        for (uint32_t i = 0; i < piece->count; i++) out->radius[n++] = get_f32(bytes + (piece->uniform ? 0 : i * 4));
        bytes += piece->bytes;
    }
}

static bool take_values(Cloud *c, PointSet *out)
{
    int place = find_attribute(c, "P"), radius = find_attribute(c, "pscale"), n;
    if (radius == NONE) radius = find_attribute(c, "radius");
    if (radius != NONE && (strcmp(c->attribute[radius].type, "float") != 0 || !value_size(&c->attribute[radius]))) radius = NONE;
    if (place == NONE) return wrong(c, "it has no attribute P");
    size_t size = value_size(&c->attribute[place]);
    if (size < 3 || size == 4) return wrong(c, "its attribute P is stored in a way that is not read; write it uncompressed");
    if (!count_points(c, place, size, &out->n) || (radius != NONE && !count_points(c, radius, 4, &n))) return false;
    out->place = NEW(Vec3, out->n);
    if (radius != NONE) out->radius = NEW(float, out->n);
    for (int a = 0; a < c->nattribute; a++) {
        bool wanted = a == place || a == radius;
        uint8_t *bytes = take_pages(c, a, wanted);
        if (c->wrong) {
            mem_free(bytes);
            return false;
        }
        if (a == place) place_points(c, place, size, bytes, out);
        if (a == radius) read_radii(c, radius, bytes, out);
        mem_free(bytes);
    }
    return true;
}

static bool take_all(Cloud *c, PointSet *out)
{
    if (!walk_tree(c)) return false;
    const uint8_t *passes = take(c, 2);
    if (!passes || !take(c, 2 * (uint64_t)c->nleaf)) return false;
    if (c->nleaf == 0) return true;
    if (!take_pieces(c)) return false;
    if (get_u16(passes) != 4 + 2 * c->nattribute) return wrong(c, "it has another number of passes than its attributes need");
    for (int a = 0; a < c->nattribute; a++)
        if (!take_page_sizes(c, a)) return false;
    for (int l = 0; l < c->nleaf; l++)
        if (!take_offsets(c, &c->leaf[l])) return false;
    return take_values(c, out);
}

static bool read_cloud(const VdbTree *tree, PointSet *out, Err *err)
{
    Cloud c = {.tree = tree, .p = tree->data + tree->tree_at, .end = tree->data + tree->size};
    bool ok = take_all(&c, out);
    if (!ok) fail(err, ERR_INPUT, "%.400s: point grid '%.100s' cannot be read: %s; write or copy the file again", tree->path, tree->name, c.wrong);
    for (int a = 0; c.pages && a < c.nattribute; a++) mem_free(c.pages[a].page);
    mem_free(c.pages);
    mem_free(c.piece);
    mem_free(c.attribute);
    mem_free(c.leaf);
    out->voxel = cbrt(fabs(affine_det(&tree->xform)));
    return ok;
}

/* --- which grid ---------------------------------------------------------------------------------------------------- */

static bool is_point_grid(const VdbEntry *e) { return strncmp(e->type, "Tree_ptdataidx32_5_4_3", 22) == 0 && !e->parent[0]; }

static int choose_grid(const VdbToc *toc, const char *name, Err *err)
{
    int found = NONE, count = 0;
    for (int i = 0; i < toc->nentry; i++) {
        if (!is_point_grid(&toc->entry[i]) || (name && strcmp(toc->entry[i].name, name) != 0)) continue;
        if (found == NONE) found = i;
        count++;
    }
    if (count == 1 || (count && name)) return found;
    if (count) fail(err, ERR_INPUT, "%.400s: has several point grids; name one with --points", toc->in.path);
    else if (name) fail(err, ERR_INPUT, "%.400s: has no point grid '%.100s'; twinmesh info lists its grids", toc->in.path, name);
    else fail(err, ERR_INPUT, "%.400s: has no point grid; twinmesh info lists its grids", toc->in.path);
    return NONE;
}

bool vdb_read_points(const char *path, const char *grid, PointSet *out, Err *err)
{
    VdbToc toc;
    if (!vdb_toc_open(&toc, path, err)) return false;
    int i = choose_grid(&toc, grid, err);
    bool ok = false;
    if (i != NONE) {
        const VdbEntry *e = &toc.entry[i];
        VdbTree t = {.path = path, .name = e->name, .version = toc.version, .kind = e->kind, .size = (size_t)(e->end - e->at)};
        t.data = NEW(uint8_t, t.size);
        ok = infile_read(&toc.in, e->at, t.size, t.data, err) && vdb_walk_header(&t, true, err) && read_cloud(&t, out, err);
        vdb_tree_free(&t);
    }
    vdb_toc_close(&toc);
    return ok;
}
