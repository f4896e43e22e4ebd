/* Scene files: what is taken must be a field that can be evaluated anywhere, and sampled where its domain is small. */
#include "fuzz.h"

#include "scene/scene.h"

enum { SAMPLES_MAX = 30000 };

static void evaluate(const Scene *s)
{
    static const Vec3 place[] = {{0, 0, 0}, {1, 2, 3}, {-1e9, 1e9, 0}, {0.5, 0.5, 0.5}};
    double F[4], low, high;
    Vec3 grad[4];
    SceneFrame *frame = scene_frame(s, s->first);
    scene_sample(frame, 4, place, F, grad);
    scene_bound(frame, place[1], 10, &low, &high);
    if (!(low <= F[1] && F[1] <= high) && isfinite(F[1])) abort();
    if ((double)s->n[0] * s->n[1] * s->n[2] <= SAMPLES_MAX && s->nelement <= 64) {
        Grid g;
        Err err = {0};
        grid_init(&g, 1);
        if (!scene_fill_grid(frame, false, &g, &err)) fuzz_check_failure(&err);
        grid_free(&g);
    }
    scene_frame_free(frame);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    Scene s;
    Err err = {0};
    const char *path = fuzz_file(".json", data, size);
    if (scene_load(path, &s, &err)) {
        evaluate(&s);
        scene_free(&s);
    } else {
        fuzz_check_failure(&err);
    }
    remove(path);
    return 0;
}
