/* motion.c: velocities of vertices where no grid tells them, from two frames' fields and the vertices' own ways. */
#include "track/track_priv.h"

void track_remember_places(Track *tr)
{
    const RefinedMesh *f = &tr->fine;
    if (!tr->set.own_motion) return;
    map_clear(&tr->before_at);
    RESERVE(tr->before, tr->capbefore, f->nvert);
    for (int v = 0; v < f->nvert; v++) {
        map_put(&tr->before_at, (uint64_t)(uint32_t)f->id[v], v);
        tr->before[v] = f->pos[v];
    }
}

Vec3 track_motion(const Track *tr, int32_t id, Vec3 p, Vec3 normal)
{
    const Vec3 none = vec3(0, 0, 0);
    if (!tr->last_field || tr->last_field->nbrick == 0 || !(tr->span_s > 0)) return none;
    int b = map_get(&tr->before_at, (uint64_t)(uint32_t)id);
    Vec3 moved = b == NONE ? none : v_scale(v_sub(p, tr->before[b]), 1 / tr->span_s);
    double along = v_dot(moved, normal);
    bool known, known_before;
    double now = field_value(tr->field, p, NULL, &known), before = field_value(tr->last_field, p, NULL, &known_before);
    double slope = v_len(field_gradient(tr->field, p));
    /* F is positive inside: where it grows, the surface goes outward */
    double outward = known && known_before && slope > 0 ? (now - before) / (tr->span_s * slope) : along;
    return v_axpy(moved, outward - along, normal);
}
