/* bricks.c: a scene's frame as a sparse grid. Boxes are halved while F may have both signs in them; what is left are the
 * 8^3 blocks whose cells may be crossed. Each box hands down the parts that reach it, so that a point of a compact kernel
 * costs nothing where it is not. */
#include "scene/scene_priv.h"

#include "base/thread.h"

#include <string.h>

enum { BLOCKS_MAX = 1 << 19, TILES_MAX = 1 << 23 };

/* A part of an element that may reach a box. */
typedef struct Part {
    int32_t element, part;
} Part;

typedef struct Blocks {
    int n, cap;
    int (*at)[4];        /* in blocks: x, y, z, side */
} Blocks;

typedef struct Search {
    const SceneFrame *f;
    int nblock[3];       /* the domain, in blocks */
    int npart, cappart;
    Part *part;          /* a stack: each box's behind its parent's */
    Blocks crossed, inside;
    double ntile;        /* blocks in `inside` */
    bool full;
} Search;

static void add_block(Blocks *b, int x, int y, int z, int side)
{
    RESERVE(b->at, b->cap, b->n + 1);
    int at[4] = {x, y, z, side};
    memcpy(b->at[b->n++], at, sizeof at);
}

/* F's interval in a ball, from the parts begin ... npart-1; those that reach the ball are put behind them. */
static void bound_parts(Search *s, int begin, Vec3 centre, double radius, double *low, double *high)
{
    const SceneFrame *f = s->f;
    int end = s->npart, element = NONE;
    Vec3 c = centre;
    double r = 0;
    *low = *high = -f->scene->iso;
    for (int i = begin; i < end; i++) {
        Part part = s->part[i];
        const Pose *ps = &f->pose[part.element];
        if (part.element != element) {
            element = part.element;
            c = centre;
            r = radius;
            pose_ball(ps, &c, &r);
        }
        double a, b, k = ps->e->strength;
        if (!part_bound(ps, part.part, c, r, &a, &b)) continue;
        *low += k > 0 ? k * a : k * b;
        *high += k > 0 ? k * b : k * a;
        RESERVE(s->part, s->cappart, s->npart + 1);
        s->part[s->npart++] = part;
    }
}

/* The box of side^3 blocks at block (x, y, z), and the samples that close its last cells. */
static void search_box(Search *s, int begin, int x, int y, int z, int side)
{
    if (x >= s->nblock[0] || y >= s->nblock[1] || z >= s->nblock[2] || s->full) return;
    const Scene *scene = s->f->scene;
    double half = 4.0 * side * scene->voxel, low, high, slack = 2 * scene->tolerance * scene->iso;
    Vec3 corner = v_axpy(scene->origin, 8 * scene->voxel, vec3(x, y, z)), centre = v_add(corner, vec3(half, half, half));
    int end = s->npart;
    bound_parts(s, begin, centre, half * sqrt(3) * (1 + 1e-9), &low, &high);
    if (high < -slack) {
        /* outside */
    } else if (low > slack) {
        add_block(&s->inside, x, y, z, side);
        s->ntile += (double)int_min(side, s->nblock[0] - x) * int_min(side, s->nblock[1] - y) * int_min(side, s->nblock[2] - z);
        s->full |= s->ntile > TILES_MAX;
    } else if (side == 1) {
        add_block(&s->crossed, x, y, z, 1);
        s->full |= s->crossed.n > BLOCKS_MAX;
    } else {
        for (int k = 0; k < 8; k++) search_box(s, end, x + side / 2 * (k & 1), y + side / 2 * (k >> 1 & 1), z + side / 2 * (k >> 2), side / 2);
    }
    s->npart = end;
}

static void search(Search *s)
{
    const Scene *scene = s->f->scene;
    int side = 1;
    for (int a = 0; a < 3; a++) {
        s->nblock[a] = (scene->n[a] + 7) / 8;
        while (side < s->nblock[a]) side *= 2;
    }
    for (int e = 0; e < scene->nelement; e++)
        for (int k = 0; k < scene->element[e].npart; k++) {
            RESERVE(s->part, s->cappart, s->npart + 1);
            s->part[s->npart++] = (Part){e, k};
        }
    search_box(s, 0, 0, 0, 0, side);
}

void scene_bound(const SceneFrame *f, Vec3 c, double radius, double *low, double *high)
{
    Search s = {.f = f};
    for (int e = 0; e < f->scene->nelement; e++)
        for (int k = 0; k < f->scene->element[e].npart; k++) {
            RESERVE(s.part, s.cappart, s.npart + 1);
            s.part[s.npart++] = (Part){e, k};
        }
    bound_parts(&s, 0, c, radius, low, high);
    mem_free(s.part);
}

/* --- samples ------------------------------------------------------------------------------------------------- */

typedef struct FillJob {
    const SceneFrame *f;
    Grid *grid;
} FillJob;

static void fill_blocks(void *ctx, int begin, int end)
{
    const FillJob *job = ctx;
    const Scene *s = job->f->scene;
    for (int b = begin; b < end; b++) {
        const int *o = job->grid->origin[b];
        float *value = job->grid->value + (size_t)b * GRID_CELLS;
        for (int first = 0; first < GRID_CELLS; first += LANES) {
            Vec3 p[LANES];
            double F[LANES];
            for (int i = 0; i < LANES; i++) p[i] = affine_to_world(&job->grid->xform, vec3(o[0] + (i & 7), o[1] + ((first + i) >> 3 & 7), o[2] + (first >> 6)));
            scene_sample(job->f, LANES, p, F, NULL);
            for (int i = 0; i < LANES; i++) {
                bool in = o[0] + (i & 7) < s->n[0] && o[1] + ((first + i) >> 3 & 7) < s->n[1] && o[2] + (first >> 6) < s->n[2];
                value[first + i] = in ? (float)-F[i] : job->grid->background[0];
            }
        }
    }
}

/* The crossed blocks, their neighbours, and the domain's two corners, which tell every format how large it is. */
static void add_blocks(const Search *s, Grid *g)
{
    for (int i = 0; i < s->crossed.n; i++)
        for (int k = 0; k < 27; k++) {
            int at[3] = {s->crossed.at[i][0] + k % 3 - 1, s->crossed.at[i][1] + k / 3 % 3 - 1, s->crossed.at[i][2] + k / 9 - 1};
            bool in = true;
            for (int a = 0; a < 3; a++) in &= at[a] >= 0 && at[a] < s->nblock[a];
            if (in) grid_add_block(g, 8 * at[0], 8 * at[1], 8 * at[2]);
        }
    grid_add_block(g, 0, 0, 0);
    grid_add_block(g, g->hi[0], g->hi[1], g->hi[2]);
}

/* What reaches beyond the domain is a block, so that what is active is the domain. */
static void add_inside(Grid *g, int x, int y, int z, float value)
{
    if (grid_block(g, x, y, z)) return;
    if (x + 7 <= g->hi[0] && y + 7 <= g->hi[1] && z + 7 <= g->hi[2]) {
        grid_add_tile(g, (GridTile){{x, y, z}, 3, {value, 0, 0}});
        return;
    }
    float *to = grid_add_block(g, x, y, z);
    for (int c = 0; c < GRID_CELLS; c++) to[c] = x + (c & 7) <= g->hi[0] && y + (c >> 3 & 7) <= g->hi[1] && z + (c >> 6) <= g->hi[2] ? value : g->background[0];
}

/* Blocks that are all inside take the least sample of the frame, so that the field never falls on the way in. */
static void add_tiles(const Search *s, Grid *g)
{
    float least = -g->background[0];
    for (size_t i = 0; i < (size_t)g->nblock * GRID_CELLS; i++) least = g->value[i] < least ? g->value[i] : least;
    for (int i = 0; i < s->inside.n; i++) {
        const int *box = s->inside.at[i];
        for (int z = box[2]; z < int_min(box[2] + box[3], s->nblock[2]); z++)
            for (int y = box[1]; y < int_min(box[1] + box[3], s->nblock[1]); y++)
                for (int x = box[0]; x < int_min(box[0] + box[3], s->nblock[0]); x++)
                    add_inside(g, 8 * x, 8 * y, 8 * z, least);
    }
}

bool scene_fill_grid(const SceneFrame *f, bool parallel, Grid *g, Err *err)
{
    const Scene *s = f->scene;
    Search find = {.f = f};
    search(&find);
    bool ok = !find.full || fail(err, ERR_RESOURCE, "%.400s: frame %.0f: the surface needs more than %d blocks of 8^3 samples, or has more than %d within; make \"voxel\" larger or \"domain\" smaller", s->path, f->frame, BLOCKS_MAX, TILES_MAX);
    if (ok) {
        for (int a = 0; a < 3; a++) {
            g->xform.m[a][a] = s->voxel;
            g->hi[a] = s->n[a] - 1;
        }
        affine_invert(&g->xform);
        g->xform.t = s->origin;
        g->background[0] = (float)s->iso;
        add_blocks(&find, g);
        FillJob job = {f, g};
        if (parallel) parallel_for(g->nblock, 4, fill_blocks, &job);
        else fill_blocks(&job, 0, g->nblock);
        add_tiles(&find, g);
    }
    mem_free(find.part);
    mem_free(find.crossed.at);
    mem_free(find.inside.at);
    return ok;
}
