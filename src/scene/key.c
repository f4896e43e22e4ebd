#include "scene/scene_priv.h"

#include <string.h>

Keys keys_constant(int width, const double *value)
{
    Keys k = {.n = 1, .width = width, .frame = NEW0(double, 1), .value = NEW(double, width)};
    memcpy(k.value, value, (size_t)width * sizeof *value);
    return k;
}

void keys_free(Keys *k)
{
    mem_free(k->frame);
    mem_free(k->value);
    *k = (Keys){0};
}

/* From a to b on the great circle; the shorter of the two ways. */
static void slerp(const double *a, const double *b, double t, double *out)
{
    double c = 0, wa = 1 - t, wb = t;
    for (int i = 0; i < 4; i++) c += a[i] * b[i];
    double turn = c < 0 ? -1 : 1, angle = acos(real_min(fabs(c), 1));
    if (angle > 1e-4) {
        wa = sin((1 - t) * angle) / sin(angle);
        wb = sin(t * angle) / sin(angle);
    }
    for (int i = 0; i < 4; i++) out[i] = wa * a[i] + wb * turn * b[i];
}

/* The last key at or before the frame, which is not before the first key nor after the last. */
static int key_before(const Keys *k, double frame)
{
    int lo = 0, hi = k->n - 1;
    while (lo < hi) {
        int mid = (lo + hi + 1) / 2;
        if (k->frame[mid] <= frame) lo = mid;
        else hi = mid - 1;
    }
    return lo;
}

void keys_at(const Keys *k, double frame, double *out)
{
    ASSERT(k->n > 0);
    int i = frame <= k->frame[0] ? 0 : key_before(k, frame);
    const double *a = k->value + (size_t)i * (size_t)k->width, *b = a + k->width;
    double t = 0;
    if (i + 1 < k->n && frame > k->frame[i]) t = (frame - k->frame[i]) / (k->frame[i + 1] - k->frame[i]);
    if (k->ease == EASE_SMOOTH) t = t * t * (3 - 2 * t);
    if (t == 0 || k->ease == EASE_STEP) memcpy(out, a, (size_t)k->width * sizeof *out);
    else if (k->width == 4) slerp(a, b, t, out);
    else
        for (int c = 0; c < k->width; c++) out[c] = a[c] + t * (b[c] - a[c]);
}
