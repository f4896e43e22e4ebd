#include "mesh/star.h"

#include "base/thread.h"
#include "mesh/orient.h"

#include <string.h>

enum { GRAIN = 1024, SLOTS = 12, BYTES = 8 };

typedef struct Stars {
    const TriSoup *soup;
    const uint8_t *look;
    uint8_t *count;           /* [nvert] triangles around; SLOTS + 1: too many */
    uint32_t (*slot)[SLOTS];  /* [nvert] 4 * triangle + which corner of it the vertex is, in the order asked for */
    uint8_t *sure, *later;
} Stars;

/* One vertex with its triangles, each from a corner to the next one. */
typedef struct Fan {
    int n;
    int32_t from[SLOTS], to[SLOTS];
    int next[SLOTS];                /* the triangle that begins where this one ends */
    double arm[SLOTS][3];           /* to the corner where it begins */
} Fan;

int soup_nvert(const TriSoup *s)
{
    int32_t last = NONE;
    for (int i = 0; i < 3 * s->ntri; i++) last = s->tri[i] > last ? s->tri[i] : last;
    return last + 1;
}

static void fan_gather(Fan *f, const Stars *st, int v)
{
    static const uint8_t AFTER[3] = {1, 2, 0}, BEFORE[3] = {2, 0, 1};
    const TriSoup *s = st->soup;
    const Vec3 p = s->pos[v];
    f->n = st->count[v];
    for (int j = 0; j < f->n; j++) {
        const uint32_t slot = st->slot[v][j];
        const int32_t *c = s->tri + 3 * (slot / 4);
        f->from[j] = c[AFTER[slot % 4]];
        f->to[j] = c[BEFORE[slot % 4]];
        const Vec3 q = s->pos[f->from[j]];
        f->arm[j][0] = q.x - p.x, f->arm[j][1] = q.y - p.y, f->arm[j][2] = q.z - p.z;
    }
}

/* Where the first byte of the word is that equals one; past its end: none does. */
static int find_byte(uint64_t word, uint8_t byte)
{
    const uint64_t ONES = 0x0101010101010101, x = word ^ byte * ONES, zero = (x - ONES) & ~x & ONES << 7;
    return zero ? __builtin_ctzll(zero) / 8 : BYTES;
}

static int find_from(const Fan *f, int32_t v)
{
    int j = 0;
    while (j < f->n && f->from[j] != v) j++;
    return j;
}

/* Does each triangle end where one begins, each time another? */
static bool fan_closes(Fan *f)
{
    unsigned begun = 0;
    uint64_t low = 0;
    for (int j = 0; j < int_min(f->n, BYTES); j++) low |= (uint64_t)(uint8_t)f->from[j] << 8 * j;
    for (int j = 0; j < f->n; j++) {
        int i = find_byte(low, (uint8_t)f->to[j]);
        if (i >= f->n || f->from[i] != f->to[j]) i = find_from(f, f->to[j]);
        f->next[j] = i;
        begun |= 1u << i;
    }
    return begun == (1u << f->n) - 1;
}

/* Along an axis with X and Y across it: all triangles certainly turn from X to Y, and once around in all. The signs of the arms'
 * components are exact. */
static bool fan_turns_once(const Fan *f, int X, int Y)
{
    int ahead = 0, up = 0;
    for (int j = 0; j < f->n; j++) {
        const double *a = f->arm[j], *b = f->arm[f->next[j]];
        double xy = a[X] * b[Y], yx = a[Y] * b[X];
        ahead += xy - yx > ORIENT2_ERROR * (fabs(xy) + fabs(yx));
        up += (a[Y] < 0) & (b[Y] >= 0);
    }
    return up == 1 && ahead == f->n;
}

static bool fan_is_sure(Fan *f)
{
    if (f->n < 3 || !fan_closes(f)) return false;
    const double *a = f->arm[0], *b = f->arm[f->next[0]];
    const double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double x = fabs(n[0]), y = fabs(n[1]), z = fabs(n[2]);
    int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    for (int k = 0; k < 3; k++, axis = (axis + 1) % 3) {
        int X = (axis + 1) % 3, Y = (axis + 2) % 3;
        if (n[axis] > 0 ? fan_turns_once(f, X, Y) : fan_turns_once(f, Y, X)) return true;
    }
    return false;
}

/* Two triangles at an edge meet at both of its ends: they count at the greater one alone. */
static void fan_count_later(const Fan *f, const Stars *st, int v)
{
    const uint32_t *slot = st->slot[v];
    uint8_t look[SLOTS], twice[SLOTS] = {0};
    for (int j = 0; j < f->n; j++) look[j] = !st->look || st->look[slot[j] / 4];
    for (int j = 0; j < f->n; j++) {
        int k = f->next[j];
        twice[j < k ? j : k] += (uint8_t)((v < f->to[j]) & (look[j] | look[k]));
    }
    for (int j = f->n - 1, looked = 0; j >= 0; j--) {
        int behind = look[j] ? f->n - 1 - j : looked;
        st->later[3 * (size_t)(slot[j] / 4) + slot[j] % 4] = (uint8_t)(behind - twice[j]);
        looked += look[j];
    }
}

static void star_block(void *ctx, int begin, int end)
{
    Stars *st = ctx;
    for (int v = begin; v < end; v++) {
        Fan f;
        st->sure[v] = 0;
        if (st->count[v] == 0 || st->count[v] > SLOTS) continue;
        fan_gather(&f, st, v);
        st->sure[v] = fan_is_sure(&f);
        if (st->later && st->sure[v]) fan_count_later(&f, st, v);
    }
}

void stars_find(const TriSoup *s, int n, const int32_t *order, const uint8_t *look, uint8_t *sure, uint8_t *later)
{
    int nvert = soup_nvert(s);
    Stars st = {s, look, NEW0(uint8_t, nvert), mem_alloc((size_t)nvert, sizeof *st.slot), sure, later};
    if (later) memset(later, LATER_UNSURE, 3 * (size_t)s->ntri);
    for (int i = 0; i < n; i++)
        for (uint32_t k = 0; k < 3; k++) {
            int v = s->tri[3 * order[i] + (int)k], at = st.count[v];
            if (at > SLOTS) continue;
            if (at < SLOTS) st.slot[v][at] = 4 * (uint32_t)order[i] + k;
            st.count[v] = (uint8_t)(at + 1);
        }
    parallel_for(nvert, GRAIN, star_block, &st);
    mem_free(st.count);
    mem_free(st.slot);
}
