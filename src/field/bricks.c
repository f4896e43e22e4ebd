/* bricks.c: the samples of bricks: out of the grid, and where they are kept. */
#include "field/field_priv.h"

#include <pthread.h>
#include <sched.h>
#include <string.h>

enum { SPARES = 2 };

/* --- out of the grid ------------------------------------------------------------------------------------------- */

/* The 27 blocks about a brick; where there is none, a row of a constant stands for all of its rows (a tile is a whole number of blocks). */
typedef struct Blocks {
    const float *row[27];   /* the first */
    int step[27];           /* from row to row: 8 or 0 */
    float constant[27][8];
} Blocks;

static void find_blocks(const Grid *g, const int o[3], Blocks *out)
{
    for (int n = 0; n < 27; n++) {
        int x = o[0] + 8 * (n % 3 - 1), y = o[1] + 8 * (n / 3 % 3 - 1), z = o[2] + 8 * (n / 9 - 1);
        const float *block = grid_block(g, x, y, z);
        out->row[n] = block ? block : out->constant[n];
        out->step[n] = block ? 8 : 0;
        if (block) continue;
        float c = grid_at(g, x, y, z, 0);
        for (int k = 0; k < 8; k++) out->constant[n][k] = c;
    }
}

/* Along an axis a brick's span is the last sample of the block before, all of the block, and two of the next. */
static const struct { int from, n; } SPAN_PART[3] = {{7, 1}, {0, 8}, {0, 2}};

static void cut_to_box(const Field *f, const int o[3], float *v)
{
    const float outside = (float)(f->iso - f->sign * f->far);
    int from = int_max(f->lo[0] - (o[0] - 1), 0), to = int_min(f->hi[0] - (o[0] - 1) + 1, BRICK_SPAN); /* of a row, within */
    for (int z = o[2] - 1; z < o[2] + 10; z++)
        for (int y = o[1] - 1; y < o[1] + 10; y++, v += BRICK_SPAN) {
            bool within = y >= f->lo[1] && y <= f->hi[1] && z >= f->lo[2] && z <= f->hi[2] && from < to;
            for (int x = 0; x < (within ? from : BRICK_SPAN); x++) v[x] = outside;
            for (int x = int_max(to, 0); within && x < BRICK_SPAN; x++) v[x] = outside;
        }
}

void brick_gather(const Field *f, const Grid *g, const int o[3], float *out)
{
    Blocks blocks;
    float *v = out;
    find_blocks(g, o, &blocks);
    for (int k = 0; k < 3; k++)
        for (int z = 0; z < SPAN_PART[k].n; z++)
            for (int j = 0; j < 3; j++) {
                int n = 9 * k + 3 * j, row = 8 * (SPAN_PART[k].from + z) + SPAN_PART[j].from;
                const int *step = blocks.step + n;
                const float *before = blocks.row[n] + step[0] * row, *at = blocks.row[n + 1] + step[1] * row, *after = blocks.row[n + 2] + step[2] * row;
                for (int y = 0; y < SPAN_PART[j].n; y++, v += BRICK_SPAN, before += step[0], at += step[1], after += step[2]) {
                    v[0] = before[7];
                    memcpy(v + 1, at, 8 * sizeof *v);
                    v[9] = after[0];
                    v[10] = after[1];
                }
            }
    if (!field_in_box(f, o[0] - 1, o[1] - 1, o[2] - 1) || !field_in_box(f, o[0] + 9, o[1] + 9, o[2] + 9)) cut_to_box(f, o, out);
}

void brick_ask(const Field *f, int brick)
{
    uint8_t *state = &f->gathered[brick - f->ncrossed], waits = BRICK_WAITS;
    if (__atomic_compare_exchange_n(state, &waits, BRICK_BEGUN, false, __ATOMIC_ACQUIRE, __ATOMIC_ACQUIRE)) {
        brick_gather(f, &f->source, f->origin[brick], brick_samples(f, brick));
        __atomic_store_n(state, BRICK_GATHERED, __ATOMIC_RELEASE);
    } else {
        while (__atomic_load_n(state, __ATOMIC_ACQUIRE) != BRICK_GATHERED) sched_yield(); /* another thread's: a microsecond */
    }
}

/* --- where they are kept ---------------------------------------------------------------------------------------- */

/* What fields that are gone have left for those to come. By far the largest blocks of memory, of a size that hardly changes, a few at a
 * time: given back they would be cut up for what comes between. */
static struct {
    pthread_mutex_t lock;
    int capbrick[SPARES];
    float *value[SPARES]; /* NULL: none */
} spare = {.lock = PTHREAD_MUTEX_INITIALIZER};

/* The smallest spare room that is large enough, or new room with a little to grow into. */
void bricks_take_room(Field *f)
{
    int at = NONE;
    pthread_mutex_lock(&spare.lock);
    for (int i = 0; i < SPARES; i++)
        if (spare.value[i] && spare.capbrick[i] >= f->nbrick && (at == NONE || spare.capbrick[i] < spare.capbrick[at])) at = i;
    if (at != NONE) {
        f->value = spare.value[at];
        f->capbrick = spare.capbrick[at];
        spare.value[at] = NULL;
    }
    pthread_mutex_unlock(&spare.lock);
    if (f->value) return;
    f->capbrick = f->nbrick + f->nbrick / 16;
    f->value = mem_alloc((size_t)f->capbrick, BRICK_SAMPLES * sizeof *f->value);
}

/* In place of the smallest spare one, if that is smaller. */
void bricks_leave_room(Field *f)
{
    int at = 0;
    float *gone = f->value;
    pthread_mutex_lock(&spare.lock);
    for (int i = 0; i < SPARES; i++) {
        if (!spare.value[i]) spare.capbrick[i] = 0;
        if (spare.capbrick[i] < spare.capbrick[at]) at = i;
    }
    if (f->capbrick > spare.capbrick[at]) {
        gone = spare.value[at];
        spare.value[at] = f->value;
        spare.capbrick[at] = f->capbrick;
    }
    pthread_mutex_unlock(&spare.lock);
    mem_free(gone);
}
