#include "topology/iso.h"

#include "base/sets.h"
#include "base/thread.h"
#include "topology/cell.h"

#define EDGE_MARGIN 0.02 /* crossings keep this share of a grid edge away from its ends: no two coincide */

enum { LOCAL = BRICK_SIDE * BRICK_SIDE * BRICK_SIDE, GRAIN_BRICKS = 16, GRAIN_CELLS = 1024 };

/* --- cut edges and loops, the bricks in parallel ---------------------------------------------------------------- */

/* What is known of a crossed brick before its cells and edges have numbers. An edge is its lower sample's brick's; the brick
 * of a cut one is crossed. */
typedef struct Scan {
    uint8_t crossed[8][8];     /* [z][y] cells, a bit each */
    uint8_t cut[8][8][3];      /* [z][y][axis] edges, a bit each */
    uint16_t before[8][8][3];  /* the brick's cut edges in the rows before */
    int ncell, nedge;
    int first_cell, first_edge;
    int above[8];              /* the brick itself and its upper neighbours, by x + 2 y + 4 z */
} Scan;

typedef struct Builder {
    IsoSurface *iso;
    Scan *scan;                /* [ncrossed] */
    CellTopology *topology;    /* [ncell] */
    CellTopology plain[256];   /* of cells whose corner c is inside where bit c is set: that alone decides where there is one loop */
} Builder;

/* Which of the 9^3 samples of a brick's cells are inside: a bit each, a row along x. */
static void find_inside(const Field *f, int brick, unsigned row[9][9])
{
    const float *v = f->value + (size_t)brick * BRICK_SAMPLES + 1 + BRICK_SPAN + BRICK_SPAN * BRICK_SPAN;
    for (int z = 0; z < 9; z++)
        for (int y = 0; y < 9; y++) {
            const float *s = v + BRICK_SPAN * (y + BRICK_SPAN * z);
            row[z][y] = 0;
            for (int x = 0; x < 9; x++) row[z][y] |= (unsigned)(f->sign * ((double)s[x] - f->iso) > 0) << x;
        }
}

static void find_above(const Field *f, int brick, int above[8])
{
    const int *o = f->origin[brick];
    for (int n = 0; n < 8; n++) above[n] = field_brick(f, o[0] + 8 * (n & 1), o[1] + 8 * (n >> 1 & 1), o[2] + 8 * (n >> 2));
}

static void scan_brick(const Field *f, int brick, Scan *s)
{
    unsigned row[9][9];
    find_inside(f, brick, row);
    find_above(f, brick, s->above);
    s->ncell = s->nedge = 0;
    for (int z = 0; z < 8; z++)
        for (int y = 0; y < 8; y++) {
            unsigned r = row[z][y], any = r | row[z][y + 1] | row[z + 1][y] | row[z + 1][y + 1];
            unsigned all = r & row[z][y + 1] & row[z + 1][y] & row[z + 1][y + 1];
            unsigned cut[3] = {r ^ r >> 1, r ^ row[z][y + 1], r ^ row[z + 1][y]};
            s->crossed[z][y] = (uint8_t)((any | any >> 1) & ~(all & all >> 1));
            s->ncell += __builtin_popcount(s->crossed[z][y]);
            for (int axis = 0; axis < 3; axis++) {
                s->cut[z][y][axis] = (uint8_t)cut[axis];
                s->before[z][y][axis] = (uint16_t)s->nedge;
                s->nedge += __builtin_popcount(s->cut[z][y][axis]);
            }
        }
}

static void scan_block(void *ctx, int begin, int end)
{
    Builder *b = ctx;
    for (int k = begin; k < end; k++) scan_brick(b->iso->field, k, &b->scan[k]);
}

static void number_bricks(Builder *b)
{
    IsoSurface *iso = b->iso;
    for (int k = 0; k < iso->field->ncrossed; k++) {
        b->scan[k].first_cell = iso->ncell;
        b->scan[k].first_edge = iso->nedge;
        iso->ncell += b->scan[k].ncell;
        iso->nedge += b->scan[k].nedge;
    }
}

static void find_plain(CellTopology plain[256])
{
    for (int bits = 0; bits < 256; bits++) {
        double F[8];
        for (int c = 0; c < 8; c++) F[c] = bits >> c & 1 ? 1 : -1;
        plain[bits] = cell_topology(F);
    }
}

static bool is_plain(const CellTopology *t) { return t->nloop == 1 && !t->ambiguous; }

/* Where the cut edges of a row along x are cut: they leave samples v along an axis, `step` samples to the next one. */
static void place_edges(const IsoSurface *iso, const float *v, int step, Vec3 corner, int axis, unsigned cut, Vec3 *pos)
{
    const Field *f = iso->field;
    for (int x = 0; cut >> x; x++) {
        if (!(cut >> x & 1)) continue;
        double F0 = f->sign * ((double)v[x] - f->iso), F1 = f->sign * ((double)v[x + step] - f->iso);
        Vec3 p = vec3(corner.x + x, corner.y, corner.z);
        v_set(&p, axis, v_get(p, axis) + real_clamp(F0 / (F0 - F1), EDGE_MARGIN, 1 - EDGE_MARGIN));
        *pos++ = p;
    }
}

static void find_cells(Builder *b, int brick)
{
    IsoSurface *iso = b->iso;
    const Field *f = iso->field;
    const Scan *s = &b->scan[brick];
    const int *o = f->origin[brick], step[3] = {1, BRICK_SPAN, BRICK_SPAN * BRICK_SPAN};
    int cell = s->first_cell;
    for (int row = 0; row < 64; row++) {
        int y = row & 7, z = row >> 3;
        const float *v = f->value + (size_t)brick * BRICK_SAMPLES + 1 + BRICK_SPAN * (y + 1 + BRICK_SPAN * (z + 1));
        for (int axis = 0; axis < 3; axis++)
            place_edges(iso, v, step[axis], vec3(o[0], o[1] + y, o[2] + z), axis, s->cut[z][y][axis], iso->edge_pos + s->first_edge + s->before[z][y][axis]);
        for (int x = 0; x < 8; x++) {
            int local = 8 * row + x;
            bool crossed = s->crossed[z][y] >> x & 1;
            iso->cell_index[brick * LOCAL + local] = crossed ? cell : NONE;
            if (!crossed) continue;
            double F[8];
            int bits = 0;
            field_cell(f, brick, o[0] + x, o[1] + y, o[2] + z, F);
            for (int c = 0; c < 8; c++) bits |= (F[c] > 0) << c;
            iso->cell_at[cell] = brick * LOCAL + local;
            b->topology[cell++] = is_plain(&b->plain[bits]) ? b->plain[bits] : cell_topology(F);
        }
    }
}

static void cell_block(void *ctx, int begin, int end)
{
    for (int k = begin; k < end; k++) find_cells(ctx, k);
}

/* Loops, and where their edges go. */
static void number_loops(Builder *b)
{
    IsoSurface *iso = b->iso;
    int nuse = 0;
    iso->cell_loop = NEW(int32_t, iso->ncell + 1);
    for (int c = 0; c < iso->ncell; c++) {
        iso->cell_loop[c] = iso->nloop;
        iso->nloop += b->topology[c].nloop;
        iso->ambiguous_cells += b->topology[c].ambiguous;
        iso->tunnels += b->topology[c].tunnel[0] != NONE;
    }
    iso->cell_loop[iso->ncell] = iso->nloop;
    iso->loop_start = NEW(int32_t, iso->nloop + 1);
    for (int c = 0, n = 0; c < iso->ncell; c++)
        for (int l = 0; l < b->topology[c].nloop; l++) {
            iso->loop_start[n++] = nuse;
            nuse += b->topology[c].start[l + 1] - b->topology[c].start[l];
        }
    iso->loop_start[iso->nloop] = nuse;
    iso->loop_mate = NEW(int32_t, iso->nloop);
    iso->loop_plain = NEW(uint8_t, iso->nloop);
    iso->loop_edge = NEW(int32_t, nuse);
}

/* The number of the cut edge that leaves local sample (x, y, z), each 0 ... 8, of a brick along an axis. */
static int edge_of(const Builder *b, int brick, int x, int y, int z, int axis)
{
    int owner = b->scan[brick].above[x >> 3 | y >> 3 << 1 | z >> 3 << 2];
    ASSERT(owner != NONE && owner < b->iso->field->ncrossed);
    const Scan *s = &b->scan[owner];
    unsigned below = s->cut[z & 7][y & 7][axis] & ((1u << (x & 7)) - 1);
    return s->first_edge + s->before[z & 7][y & 7][axis] + __builtin_popcount(below);
}

static void fill_loops(const Builder *b, int cell)
{
    IsoSurface *iso = b->iso;
    const CellTopology *t = &b->topology[cell];
    int brick = iso->cell_at[cell] / LOCAL, local = iso->cell_at[cell] % LOCAL, first = iso->cell_loop[cell];
    int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    for (int l = 0; l < t->nloop; l++) {
        int32_t *edge = iso->loop_edge + iso->loop_start[first + l];
        iso->loop_mate[first + l] = l == t->tunnel[0] ? first + t->tunnel[1] : l == t->tunnel[1] ? first + t->tunnel[0] : NONE;
        iso->loop_plain[first + l] = is_plain(t);
        for (int k = t->start[l]; k < t->start[l + 1]; k++) {
            int c = CELL_EDGE_CORNER[t->edge[k]];
            *edge++ = edge_of(b, brick, x + (c & 1), y + (c >> 1 & 1), z + (c >> 2), t->edge[k] >> 2);
        }
    }
}

static void loop_block(void *ctx, int begin, int end)
{
    for (int c = begin; c < end; c++) fill_loops(ctx, c);
}

static void find_loops(IsoSurface *iso)
{
    int n = iso->field->ncrossed;
    Builder b = {.iso = iso, .scan = NEW(Scan, n)};
    ASSERT((int64_t)n * LOCAL < INT32_MAX / 3);
    parallel_for(n, GRAIN_BRICKS, scan_block, &b);
    number_bricks(&b);
    find_plain(b.plain);
    b.topology = NEW(CellTopology, iso->ncell);
    iso->cell_index = NEW(int32_t, (size_t)n * LOCAL);
    iso->cell_at = NEW(int32_t, iso->ncell);
    iso->edge_pos = NEW(Vec3, iso->nedge);
    parallel_for(n, GRAIN_BRICKS, cell_block, &b);
    number_loops(&b);
    parallel_for(iso->ncell, GRAIN_CELLS, loop_block, &b);
    mem_free(b.scan);
    mem_free(b.topology);
}

/* --- components ----------------------------------------------------------------------------------------------- */

static void find_components(IsoSurface *iso)
{
    int32_t *up = iso->edge_comp = NEW(int32_t, iso->nedge);
    for (int e = 0; e < iso->nedge; e++) up[e] = e;
    for (int l = 0; l < iso->nloop; l++) {
        int first = iso->loop_edge[iso->loop_start[l]];
        for (int k = iso->loop_start[l] + 1; k < iso->loop_start[l + 1]; k++) set_join(up, first, iso->loop_edge[k]);
        if (iso->loop_mate[l] != NONE) set_join(up, first, iso->loop_edge[iso->loop_start[iso->loop_mate[l]]]);
    }
    /* a root is the smallest of its component, so it is numbered before its members are looked up */
    for (int e = 0; e < iso->nedge; e++) {
        int r = set_root(up, e);
        if (r == e) iso->ncomp++;
    }
    int32_t *number = NEW(int32_t, iso->nedge);
    for (int e = 0, n = 0; e < iso->nedge; e++) {
        int r = set_root(up, e);
        number[e] = r == e ? n++ : number[r];
    }
    mem_free(up);
    iso->edge_comp = number;
    iso->loop_comp = NEW(int32_t, iso->nloop);
    for (int l = 0; l < iso->nloop; l++) iso->loop_comp[l] = number[iso->loop_edge[iso->loop_start[l]]];
}

static void count_euler(IsoSurface *iso)
{
    iso->comp_euler = NEW0(int32_t, iso->ncomp);
    iso->comp_loops = NEW0(int32_t, iso->ncomp);
    int32_t *sides = NEW0(int32_t, iso->ncomp);
    for (int e = 0; e < iso->nedge; e++) iso->comp_euler[iso->edge_comp[e]]++;
    for (int l = 0; l < iso->nloop; l++) {
        int c = iso_loop_component(iso, l);
        sides[c] += iso->loop_start[l + 1] - iso->loop_start[l];
        iso->comp_euler[c] += iso->loop_mate[l] == NONE;
        iso->comp_loops[c]++;
    }
    for (int c = 0; c < iso->ncomp; c++) iso->comp_euler[c] -= sides[c] / 2;
    mem_free(sides);
}

static Vec3 loop_mean(const IsoSurface *iso, int loop)
{
    Vec3 mean = vec3(0, 0, 0);
    int n = iso->loop_start[loop + 1] - iso->loop_start[loop];
    for (int k = iso->loop_start[loop]; k < iso->loop_start[loop + 1]; k++) mean = v_axpy(mean, 1.0 / n, iso->edge_pos[iso->loop_edge[k]]);
    return mean;
}

/* Volumes by the divergence theorem over fans about the loops' means, boxes over the cut edges. */
static void measure_components(IsoSurface *iso)
{
    iso->comp_volume = NEW0(double, iso->ncomp);
    iso->comp_box = mem_alloc((size_t)iso->ncomp, sizeof *iso->comp_box);
    for (int c = 0; c < iso->ncomp; c++) iso->comp_box[c][0] = vec3(1e30, 1e30, 1e30), iso->comp_box[c][1] = vec3(-1e30, -1e30, -1e30);
    for (int e = 0; e < iso->nedge; e++) {
        Vec3 *box = iso->comp_box[iso->edge_comp[e]], p = iso->edge_pos[e];
        box[0] = vec3(real_min(box[0].x, p.x), real_min(box[0].y, p.y), real_min(box[0].z, p.z));
        box[1] = vec3(real_max(box[1].x, p.x), real_max(box[1].y, p.y), real_max(box[1].z, p.z));
    }
    for (int l = 0; l < iso->nloop; l++) {
        int c = iso_loop_component(iso, l), from = iso->loop_start[l], to = iso->loop_start[l + 1];
        Vec3 o = iso->comp_box[c][0], mean = v_sub(loop_mean(iso, l), o);
        for (int k = from; k < to; k++) {
            Vec3 a = v_sub(iso->edge_pos[iso->loop_edge[k]], o), b = v_sub(iso->edge_pos[iso->loop_edge[k + 1 < to ? k + 1 : from]], o);
            iso->comp_volume[c] += v_dot(a, v_cross(b, mean)) / 6;
        }
    }
}

void iso_build(IsoSurface *iso, const Field *field)
{
    *iso = (IsoSurface){.field = field};
    find_loops(iso);
    find_components(iso);
    count_euler(iso);
    measure_components(iso);
}

void iso_free(IsoSurface *iso)
{
    mem_free(iso->edge_comp);
    mem_free(iso->edge_pos);
    mem_free(iso->comp_volume);
    mem_free(iso->comp_box);
    mem_free(iso->cell_at);
    mem_free(iso->cell_loop);
    mem_free(iso->loop_start);
    mem_free(iso->loop_edge);
    mem_free(iso->loop_mate);
    mem_free(iso->loop_comp);
    mem_free(iso->loop_plain);
    mem_free(iso->cell_index);
    mem_free(iso->comp_euler);
    mem_free(iso->comp_loops);
    *iso = (IsoSurface){0};
}

/* --- places --------------------------------------------------------------------------------------------------- */

static int cell_of_index(const IsoSurface *iso, Vec3 q)
{
    int at[3], b = field_brick_of(iso->field, q, at);
    return b == NONE || b >= iso->field->ncrossed ? NONE : iso->cell_index[b * LOCAL + ((at[2] & 7) * 8 + (at[1] & 7)) * 8 + (at[0] & 7)];
}

int iso_cell_beside(const IsoSurface *iso, int cell, int dx, int dy, int dz)
{
    const Field *f = iso->field;
    int brick = iso->cell_at[cell] / LOCAL, local = iso->cell_at[cell] % LOCAL;
    int x = (local & 7) + dx, y = (local >> 3 & 7) + dy, z = (local >> 6) + dz;
    if ((x | y | z) & ~7) {
        const int *o = f->origin[brick];
        brick = field_brick(f, o[0] + x, o[1] + y, o[2] + z);
    }
    return brick == NONE || brick >= f->ncrossed ? NONE : iso->cell_index[brick * LOCAL + ((z & 7) * 8 + (y & 7)) * 8 + (x & 7)];
}

/* Marks n cells from x on of a row through three bricks, whose first cell has the local number `row`; x is 0 at the middle brick. */
static void mark_row(const IsoSurface *iso, const int beside[3], int x, int row, int n, uint8_t *mark)
{
    for (int i = x; i < x + n; i++) {
        int brick = beside[(i >> 3) + 1], c = brick == NONE ? NONE : iso->cell_index[brick * LOCAL + row + (i & 7)];
        if (c != NONE) mark[c] = 1;
    }
}

void iso_mark_beside(const IsoSurface *iso, int cell, int reach, uint8_t *mark)
{
    const Field *f = iso->field;
    int brick = iso->cell_at[cell] / LOCAL, local = iso->cell_at[cell] % LOCAL, known = NONE, beside[3];
    const int *o = f->origin[brick], x = local & 7, y = local >> 3 & 7, z = local >> 6;
    ASSERT(reach <= 8);
    for (int k = z - reach; k <= z + reach; k++)
        for (int j = y - reach; j <= y + reach; j++) {
            int at = (k >> 3) * 3 + (j >> 3) + 4; /* which bricks the row is in */
            for (int i = 0; i < 3 && at != known; i++) {
                int b = field_brick(f, o[0] + 8 * (i - 1), o[1] + j, o[2] + k);
                beside[i] = b != NONE && b < f->ncrossed ? b : NONE;
            }
            known = at;
            mark_row(iso, beside, x - reach, 8 * (8 * (k & 7) + (j & 7)), 2 * reach + 1, mark);
        }
}

int iso_cell_at(const IsoSurface *iso, Vec3 p) { return cell_of_index(iso, affine_to_index(&iso->field->xform, p)); }

/* Rounding puts a point that lies on a cell's face beside the cell: look a little around. */
int iso_cell_near(const IsoSurface *iso, Vec3 p)
{
    const double d = 1e-3;
    Vec3 q = affine_to_index(&iso->field->xform, p);
    int c = cell_of_index(iso, q);
    for (int k = 0; c == NONE && k < 27; k++) c = cell_of_index(iso, v_add(q, vec3(d * (k % 3 - 1), d * (k / 3 % 3 - 1), d * (k / 9 - 1))));
    return c;
}

void iso_mark_cells(const IsoSurface *iso, Vec3 a, Vec3 b, Vec3 c, uint8_t *hit)
{
    double longest = sqrt(real_max(v_len2(v_sub(b, a)), real_max(v_len2(v_sub(c, b)), v_len2(v_sub(a, c)))));
    int n = int_clamp((int)(longest / iso->field->voxel) + 1, 1, 16);
    Vec3 p = affine_to_index(&iso->field->xform, a), q = affine_to_index(&iso->field->xform, b), r = affine_to_index(&iso->field->xform, c);
    Vec3 u = v_scale(v_sub(q, p), 1.0 / n), w = v_scale(v_sub(r, p), 1.0 / n);
    for (int i = 0; i <= n; i++)
        for (int j = 0; j <= n - i; j++) {
            int cell = cell_of_index(iso, v_axpy(v_axpy(p, i, u), j, w));
            if (cell != NONE) __atomic_store_n(&hit[cell], 1, __ATOMIC_RELAXED);
        }
}

/* From an index-space point to the nearest of a loop's crossings and their mean; squared. */
static double distance_to_loop(const IsoSurface *iso, int loop, Vec3 p)
{
    double best = v_len2(v_sub(loop_mean(iso, loop), p));
    for (int k = iso->loop_start[loop]; k < iso->loop_start[loop + 1]; k++) best = real_min(best, v_len2(v_sub(iso->edge_pos[iso->loop_edge[k]], p)));
    return best;
}

int iso_loop_in(const IsoSurface *iso, int cell, Vec3 p)
{
    int first = iso->cell_loop[cell], last = iso->cell_loop[cell + 1], nearest = first;
    if (last == first + 1) return first;
    double best = 1e300;
    Vec3 q = affine_to_index(&iso->field->xform, p);
    for (int l = first; l < last; l++) {
        double d = distance_to_loop(iso, l, q);
        if (d < best) best = d, nearest = l;
    }
    return nearest;
}

int iso_loop_at(const IsoSurface *iso, Vec3 p)
{
    int cell = iso_cell_near(iso, p);
    return cell == NONE ? NONE : iso_loop_in(iso, cell, p);
}

int iso_component_at(const IsoSurface *iso, Vec3 p, bool *sure)
{
    int c = iso_cell_near(iso, p);
    *sure = true;
    if (c == NONE) return NONE;
    int first = iso->cell_loop[c], comp = iso_loop_component(iso, first);
    for (int l = first + 1; l < iso->cell_loop[c + 1]; l++)
        if (iso_loop_component(iso, l) != comp) *sure = false;
    return *sure ? comp : iso_loop_component(iso, iso_loop_in(iso, c, p));
}

bool iso_is_home(const void *ctx, int32_t home, Vec3 p)
{
    bool sure;
    return iso_component_at(ctx, p, &sure) == home;
}
