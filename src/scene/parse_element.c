#include "scene/parse.h"

#include <string.h>

enum { CORNERS_MAX = 1 << 20 };
#define LENGTH_LEAST 1e-6
#define LENGTH_MOST 1e6
#define NORM_LEAST 0.1  /* below it 3^(1/q) leaves no room for numbers */
#define NORM_MOST 100

/* --- values over time ---------------------------------------------------------------------------------- */

static bool parse_value(const Doc *d, const Place *at, const json_t *v, int width, double low, double high, double *out)
{
    if (width == 1) return doc_real(d, at, v, low, high, out);
    if (!doc_reals(d, at, v, width, low, high, out)) return false;
    if (width != 4) return true;
    double l = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3]);
    if (!(l > LENGTH_LEAST)) return doc_fail(d, at, "is no rotation: a quaternion, w first, must not be 0");
    for (int i = 0; i < 4; i++) out[i] /= l;
    return true;
}

static bool parse_key(const Doc *d, const Place *at, const json_t *v, double low, double high, Keys *k)
{
    if (!json_is_array(v) || json_array_size(v) != 2) return doc_fail(d, at, "must be a frame and a value in brackets");
    Place when = place_item(at, 0), what = place_item(at, 1);
    if (!doc_real(d, &when, json_array_get(v, 0), -1e9, 1e9, &k->frame[k->n])) return false;
    if (k->n > 0 && !(k->frame[k->n] > k->frame[k->n - 1])) return doc_fail(d, &when, "frames of keys must rise; sort them");
    if (!parse_value(d, &what, json_array_get(v, 1), k->width, low, high, k->value + (size_t)k->n * (size_t)k->width)) return false;
    k->n++;
    return true;
}

static int width_of(const json_t *v, int width) { return width ? width : json_is_array(v) ? 3 : 1; }

static bool parse_key_list(const Doc *d, const Place *at, const json_t *list, int width, double low, double high, Keys *k)
{
    size_t n = json_array_size(list);
    if (!json_is_array(list) || n < 1 || n > KEYS_MAX) return doc_fail(d, at, "must be a list of 1 to %d keys, [frame, value] each", KEYS_MAX);
    k->width = width_of(json_array_get(json_array_get(list, 0), 1), width);
    k->frame = NEW(double, n);
    k->value = NEW(double, n * (size_t)k->width);
    for (size_t i = 0; i < n; i++) {
        Place item = place_item(at, (int)i);
        if (!parse_key(d, &item, json_array_get(list, i), low, high, k)) return false;
    }
    return true;
}

bool parse_keys(const Doc *d, const Place *at, const json_t *v, int width, double low, double high, Keys *out)
{
    static const char *const known[] = {"keys", "interpolation", NULL};
    static const char *const eases[] = {"linear", "smooth", "step", NULL};
    *out = (Keys){0};
    if (!json_is_object(v)) {
        double value[4];
        width = width_of(v, width);
        if (!parse_value(d, at, v, width, low, high, value)) return false;
        *out = keys_constant(width, value);
        return true;
    }
    Place keys = place_key(at, "keys"), ease = place_key(at, "interpolation");
    int how = EASE_LINEAR;
    if (!doc_check_keys(d, at, v, known)) return false;
    const json_t *interpolation = json_object_get(v, "interpolation");
    if (interpolation && !doc_choice(d, &ease, interpolation, eases, &how)) return false;
    out->ease = (Ease)how;
    if (parse_key_list(d, &keys, json_object_get(v, "keys"), width, low, high, out)) return true;
    keys_free(out);
    return false;
}

/* --- shapes ----------------------------------------------------------------------------------------------- */

static double draw(uint64_t *state)
{
    uint64_t x = *state += 0x9e3779b97f4a7c15ULL; /* splitmix64 */
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ x >> 27) * 0x94d049bb133111ebULL;
    return (double)((x ^ x >> 31) >> 11) / 9007199254740992.0;
}

/* {"random": 10000, "seed": 1, "box": [[x, y, z], [x, y, z]]} */
static bool parse_random(const Doc *d, const Place *at, const json_t *v, Element *e)
{
    static const char *const known[] = {"random", "seed", "box", NULL};
    Place random = place_key(at, "random"), seed = place_key(at, "seed"), box = place_key(at, "box");
    Place low = place_item(&box, 0), high = place_item(&box, 1);
    double count, first = 0;
    Vec3 lo, hi;
    const json_t *corners = json_object_get(v, "box"), *start = json_object_get(v, "seed");
    if (!doc_check_keys(d, at, v, known)) return false;
    if (!doc_real(d, &random, json_object_get(v, "random"), 1, CORNERS_MAX, &count)) return false;
    if (start && !doc_real(d, &seed, start, 0, 1e15, &first)) return false;
    if (!json_is_array(corners) || json_array_size(corners) != 2) return doc_fail(d, &box, "must be two opposite corners, [[x, y, z], [x, y, z]]");
    if (!doc_point(d, &low, json_array_get(corners, 0), &lo) || !doc_point(d, &high, json_array_get(corners, 1), &hi)) return false;
    e->ncorner = e->npart = (int)count;
    e->corner = NEW(Vec3, e->ncorner);
    uint64_t state = (uint64_t)first;
    for (int i = 0; i < e->ncorner; i++)
        for (int a = 0; a < 3; a++) {
            double t = draw(&state);
            v_set(&e->corner[i], a, v_get(lo, a) + t * (v_get(hi, a) - v_get(lo, a)));
        }
    return true;
}

/* A list of points, or of lists of `per` points each. */
static bool parse_corners(const Doc *d, const Place *at, const json_t *v, int per, Element *e)
{
    size_t n = json_array_size(v);
    if (!json_is_array(v) || n < 1 || n > CORNERS_MAX) return doc_fail(d, at, "must be a list of 1 to %d %s", CORNERS_MAX, per == 1 ? "points, [x, y, z] each" : per == 2 ? "pairs of points" : "triples of points");
    e->corner = NEW(Vec3, n * (size_t)per);
    for (size_t i = 0; i < n; i++) {
        Place item = place_item(at, (int)i);
        const json_t *part = json_array_get(v, i);
        if (per > 1 && (!json_is_array(part) || json_array_size(part) != (size_t)per)) return doc_fail(d, &item, "must be %d points, [x, y, z] each, in brackets", per);
        for (int k = 0; k < per; k++) {
            Place corner = place_item(&item, k);
            if (!doc_point(d, per > 1 ? &corner : &item, per > 1 ? json_array_get(part, (size_t)k) : part, &e->corner[e->ncorner])) return false;
            e->ncorner++;
        }
    }
    e->npart = (int)n;
    return true;
}

static const char *const SHAPES[] = {"points", "segments", "triangles", "polyline", NULL};

static bool parse_shape(const Doc *d, const Place *at, const json_t *object, Element *e)
{
    static const int per[] = {1, 2, 3, 1};
    int shape = NONE;
    for (int s = 0; SHAPES[s]; s++) {
        if (!json_object_get(object, SHAPES[s])) continue;
        Place where = place_key(at, SHAPES[s]);
        if (shape != NONE) return doc_fail(d, &where, "an element has one shape, and this one has \"%s\" already; make it two elements", SHAPES[shape]);
        shape = s;
    }
    if (shape == NONE) return doc_fail(d, at, "it has no shape; give \"points\", \"segments\", \"triangles\" or \"polyline\"");
    Place where = place_key(at, SHAPES[shape]);
    const json_t *v = json_object_get(object, SHAPES[shape]);
    e->shape = (Shape)shape;
    if (e->shape == SHAPE_POINTS && json_is_object(v)) return parse_random(d, &where, v, e);
    if (!parse_corners(d, &where, v, per[shape], e)) return false;
    if (e->shape == SHAPE_POLYLINE) {
        if (e->ncorner < 2) return doc_fail(d, &where, "a polyline has two points or more");
        e->npart = 1;
    }
    return true;
}

/* --- placement and warps -------------------------------------------------------------------------------------- */

/* [w, x, y, z], or {"axis": [x, y, z], "degrees": ...}, or keys of the former. */
static bool parse_rotate(const Doc *d, const Place *at, const json_t *v, Element *e)
{
    static const char *const known[] = {"axis", "degrees", NULL};
    if (!json_object_get(v, "axis") && !json_object_get(v, "degrees")) return parse_keys(d, at, v, 4, -1e6, 1e6, &e->rotate);
    Place axis = place_key(at, "axis"), degrees = place_key(at, "degrees");
    if (!doc_check_keys(d, at, v, known) || !doc_point(d, &axis, json_object_get(v, "axis"), &e->axis)) return false;
    if (!(v_len(e->axis) > LENGTH_LEAST)) return doc_fail(d, &axis, "must not be 0");
    return parse_keys(d, &degrees, json_object_get(v, "degrees"), 1, -1e6, 1e6, &e->degrees);
}

/* {"twist": amount, "axis": "z"} */
static bool parse_warp(const Doc *d, const Place *at, const json_t *v, Warp *w)
{
    static const char *const known[] = {"twist", "bend", "taper", "axis", NULL}, *const axes[] = {"x", "y", "z", NULL};
    static const double most[] = {1e5, 1e5, 1e3};
    if (!json_is_object(v)) return doc_fail(d, at, "must be an object such as {\"twist\": 90, \"axis\": \"z\"}");
    if (!doc_check_keys(d, at, v, known)) return false;
    Place axis = place_key(at, "axis");
    if (!doc_choice(d, &axis, json_object_get(v, "axis"), axes, &w->axis)) return false;
    int kind = NONE;
    for (int k = 0; k < 3; k++) {
        const json_t *amount = json_object_get(v, known[k]);
        if (!amount) continue;
        Place where = place_key(at, known[k]);
        if (kind != NONE) return doc_fail(d, &where, "a warp is one of twist, bend and taper; list them one by one");
        kind = k;
        if (!parse_keys(d, &where, amount, 1, -most[k], most[k], &w->amount)) return false;
    }
    if (kind == NONE) return doc_fail(d, at, "names no \"twist\", \"bend\" or \"taper\"; give one of them");
    w->kind = (WarpKind)kind;
    return true;
}

static bool parse_warps(const Doc *d, const Place *at, const json_t *v, Element *e)
{
    if (!json_is_array(v) || json_array_size(v) > WARPS_MAX) return doc_fail(d, at, "must be a list of at most %d warps", WARPS_MAX);
    for (size_t i = 0; i < json_array_size(v); i++) {
        Place item = place_item(at, (int)i);
        e->nwarp++;
        if (!parse_warp(d, &item, json_array_get(v, i), &e->warp[i])) return false;
    }
    return true;
}

/* --- an element --------------------------------------------------------------------------------------------------- */

static bool parse_numbers(const Doc *d, const Place *at, const json_t *o, Element *e)
{
    static const char *const kernels[] = {"inverse-square", "compact", NULL};
    Place kernel = place_key(at, "kernel"), norm = place_key(at, "norm"), strength = place_key(at, "strength");
    const json_t *v;
    int kind = KERNEL_INVERSE_SQUARE;
    e->norm = 2;
    e->strength = 1;
    if ((v = json_object_get(o, "kernel")) && !doc_choice(d, &kernel, v, kernels, &kind)) return false;
    if ((v = json_object_get(o, "norm")) && !doc_real(d, &norm, v, NORM_LEAST, NORM_MOST, &e->norm)) return false;
    if ((v = json_object_get(o, "strength")) && !doc_real(d, &strength, v, -LENGTH_MOST, LENGTH_MOST, &e->strength)) return false;
    if (!(fabs(e->strength) >= LENGTH_LEAST)) return doc_fail(d, &strength, "must not be 0; take the element out");
    e->kernel = (KernelKind)kind;
    return true;
}

static bool parse_motion(const Doc *d, const Place *at, const json_t *o, Element *e)
{
    static const double one = 1, zero[3] = {0, 0, 0}, straight[4] = {1, 0, 0, 0};
    const struct {
        const char *key;
        int width;
        double low, high;
        Keys *to;
        const double *fallback; /* NULL: needed */
    } field[] = {
        {"radius", 1, LENGTH_LEAST, LENGTH_MOST, &e->radius, NULL},
        {"translate", 3, -LENGTH_MOST, LENGTH_MOST, &e->translate, zero},
        {"scale", 0, 1e-3, 1e3, &e->scale, &one},
    };
    for (size_t i = 0; i < sizeof field / sizeof *field; i++) {
        const json_t *v = json_object_get(o, field[i].key);
        Place where = place_key(at, field[i].key);
        if (!v && !field[i].fallback) return doc_fail(d, &where, "is missing; give the distance at which the element's field is 1");
        if (!v) *field[i].to = keys_constant(int_max(field[i].width, 1), field[i].fallback);
        else if (!parse_keys(d, &where, v, field[i].width, field[i].low, field[i].high, field[i].to)) return false;
    }
    Place rotate = place_key(at, "rotate"), warp = place_key(at, "warp");
    const json_t *turn = json_object_get(o, "rotate"), *warps = json_object_get(o, "warp");
    if (!turn) e->rotate = keys_constant(4, straight);
    else if (!parse_rotate(d, &rotate, turn, e)) return false;
    return !warps || parse_warps(d, &warp, warps, e);
}

bool parse_element(const Doc *d, const Place *at, const json_t *object, Element *e)
{
    static const char *const known[] = {"comment", "points", "segments", "triangles", "polyline", "kernel", "norm", "strength", "radius", "translate", "rotate", "scale", "warp", NULL};
    *e = (Element){0};
    if (!json_is_object(object)) return doc_fail(d, at, "must be an object, { ... }");
    return doc_check_keys(d, at, object, known) && parse_shape(d, at, object, e) && parse_numbers(d, at, object, e) && parse_motion(d, at, object, e);
}

void element_free(Element *e)
{
    mem_free(e->corner);
    keys_free(&e->radius);
    keys_free(&e->translate);
    keys_free(&e->rotate);
    keys_free(&e->degrees);
    keys_free(&e->scale);
    for (int k = 0; k < e->nwarp; k++) keys_free(&e->warp[k].amount);
}
