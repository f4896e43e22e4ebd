#include "scene/parse.h"

#include <string.h>
#include <strings.h>

enum { ELEMENTS_MAX = 100000, SAMPLES_MAX = 1 << 14, FRAMES_MAX = 10 * 1000 * 1000 };

bool scene_is_known(const char *path)
{
    size_t n = strlen(path);
    return n > 5 && path[n - 6] != '/' && strcasecmp(path + n - 5, ".json") == 0;
}

static bool parse_frames(const Doc *d, Scene *s)
{
    Place at = place_key(NULL, "frames");
    const json_t *v = json_object_get(d->root, "frames");
    double range[2];
    if (!v) return doc_fail(d, &at, "is missing; give the first and the last frame, such as [1, 48]");
    if (!doc_reals(d, &at, v, 2, 0, FRAMES_MAX, range)) return false;
    if (range[0] != floor(range[0]) || range[1] != floor(range[1]) || range[0] > range[1]) return doc_fail(d, &at, "must be two whole numbers, the first not above the last");
    s->first = (int64_t)range[0];
    s->last = (int64_t)range[1];
    return true;
}

/* Samples stand at every voxel from the domain's least corner to its greatest; what is left over is cut off. */
static bool parse_domain(const Doc *d, Scene *s)
{
    Place at = place_key(NULL, "domain"), low = place_item(&at, 0), high = place_item(&at, 1), voxel = place_key(NULL, "voxel");
    const json_t *v = json_object_get(d->root, "domain"), *h = json_object_get(d->root, "voxel");
    Vec3 hi;
    if (!json_is_array(v) || json_array_size(v) != 2) return doc_fail(d, &at, "must be two opposite corners, [[x, y, z], [x, y, z]]");
    if (!doc_point(d, &low, json_array_get(v, 0), &s->origin) || !doc_point(d, &high, json_array_get(v, 1), &hi)) return false;
    if (!h) return doc_fail(d, &voxel, "is missing; give the distance between samples");
    if (!doc_real(d, &voxel, h, 1e-6, 1e6, &s->voxel)) return false;
    for (int a = 0; a < 3; a++) {
        double n = floor((v_get(hi, a) - v_get(s->origin, a)) / s->voxel + 1e-6) + 1;
        if (!(n >= 2)) return doc_fail(d, &at, "must be a voxel or more wide in every direction, the least corner first");
        if (n > SAMPLES_MAX) return doc_fail(d, &voxel, "makes %.0f samples along one side of the domain; %d are the most, so make it larger", n, SAMPLES_MAX);
        s->n[a] = (int)n;
    }
    return true;
}

static bool parse_optional(const Doc *d, Scene *s)
{
    const struct {
        const char *key;
        double low, high, fallback;
        double *to;
    } field[] = {
        {"fps", 0.001, 100000, 24, &s->fps},
        {"iso", 1e-6, 1e6, 1, &s->iso},
        {"tolerance", 1e-9, 0.1, 1e-2, &s->tolerance},
    };
    for (size_t i = 0; i < sizeof field / sizeof *field; i++) {
        const json_t *v = json_object_get(d->root, field[i].key);
        Place at = place_key(NULL, field[i].key);
        *field[i].to = field[i].fallback;
        if (v && !doc_real(d, &at, v, field[i].low, field[i].high, field[i].to)) return false;
    }
    return true;
}

static bool parse_elements(const Doc *d, Scene *s)
{
    Place at = place_key(NULL, "elements");
    const json_t *v = json_object_get(d->root, "elements");
    size_t n = json_array_size(v);
    if (!json_is_array(v) || n < 1 || n > ELEMENTS_MAX) return doc_fail(d, &at, "must be a list of 1 to %d elements", ELEMENTS_MAX);
    s->element = NEW(Element, n);
    for (size_t i = 0; i < n; i++) {
        Place item = place_item(&at, (int)i);
        s->nelement++;
        if (!parse_element(d, &item, json_array_get(v, i), &s->element[i])) return false;
    }
    return true;
}

bool scene_load(const char *path, Scene *out, Err *err)
{
    static const char *const known[] = {"comment", "frames", "fps", "domain", "voxel", "iso", "tolerance", "elements", NULL};
    Doc d;
    *out = (Scene){0};
    if (!doc_open(&d, path, err)) return false;
    out->path = mem_text(path);
    bool ok = doc_check_keys(&d, NULL, d.root, known) && parse_frames(&d, out) && parse_domain(&d, out) && parse_optional(&d, out) && parse_elements(&d, out);
    doc_close(&d);
    if (!ok) scene_free(out);
    return ok;
}

void scene_free(Scene *s)
{
    for (int i = 0; i < s->nelement; i++) element_free(&s->element[i]);
    mem_free(s->element);
    mem_free(s->path);
    *s = (Scene){0};
}
