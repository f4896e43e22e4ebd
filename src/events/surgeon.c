#include "events/events_priv.h"

enum { REGION_MOST = 6000, ISLAND_MOST = 12, SAMPLES_MOST = 200, SPOKE_SAMPLES = 8 };
#define LAND_EDGES 2.0    /* a new vertex lands at most this far away, in edges */
#define SAMPLE_VOX 0.1

void surgeon_init(Surgeon *s, Mesh *mesh, const Field *field, const EventRules *rules, ChangeList *events)
{
    *s = (Surgeon){.mesh = mesh, .field = field, .rules = rules, .events = events};
    region_init(&s->region, mesh);
}

void surgeon_free(Surgeon *s)
{
    region_free(&s->region);
    borders_free(&s->borders);
    mem_free(s->lost);
}

bool surgeon_prepare(Surgeon *s)
{
    if (!region_unpinch(&s->region, REGION_MOST)) return false;
    region_fill_islands(&s->region, ISLAND_MOST);
    if (!region_unpinch(&s->region, REGION_MOST)) return false;
    region_borders(&s->region, &s->borders);
    return true;
}

static bool is_inside(const Surgeon *s, Vec3 p) { return field_value(s->field, p, NULL, NULL) > 0; }

bool surgeon_holds_way(const Surgeon *s, Vec3 a, Vec3 b, bool inside)
{
    int n = int_clamp((int)(v_dist(a, b) / (SAMPLE_VOX * s->field->voxel)), 1, SAMPLES_MOST);
    for (int i = 0; i <= n; i++)
        if (is_inside(s, v_mix(a, b, (double)i / n)) != inside) return false;
    return true;
}

double surgeon_disc_inside(const Surgeon *s, int n, const Vec3 *rim)
{
    Vec3 centre = {0, 0, 0};
    double in = 0, all = 0;
    for (int i = 0; i < n; i++) centre = v_axpy(centre, 1.0 / n, rim[i]);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < SPOKE_SAMPLES; k++) { /* a sample stands for an area that grows with its distance */
            double t = (k + 0.5) / SPOKE_SAMPLES;
            in += is_inside(s, v_mix(centre, rim[i], t)) ? t : 0;
            all += t;
        }
    return in / all;
}

bool surgeon_looks_outward(const Surgeon *s, Vec3 p)
{
    const Mesh *m = s->mesh;
    double sum = 0;
    for (int i = 0; i < s->region.n; i++) {
        int t = s->region.tri[i];
        if (!tri_is_dead(m, t)) sum += v_dot(mesh_tri_area2(m, t), v_sub(m->pos[m->corner[3 * t]], p));
    }
    return sum > 0;
}

Vec3 surgeon_land(const Surgeon *s, Vec3 p)
{
    field_project(s->field, 1, &p, LAND_EDGES * s->rules->edge, NULL);
    return v_round32(p);
}

void surgeon_cap_all(Surgeon *s)
{
    const Borders *b = &s->borders;
    Mesh *m = s->mesh;
    Vec3 place = {0, 0, 0}, *centre = NEW(Vec3, b->n);
    for (int i = 0; i < b->n; i++) {
        centre[i] = border_centre(m, b, i);
        place = v_axpy(place, 1.0 / b->n, centre[i]);
    }
    int before = mesh_components(m, NULL, NULL), gone = mesh_erase(m, &s->region);
    for (int i = 0; i < b->n; i++) mesh_cap(m, border_length(b, i), border_halves(b, i), surgeon_land(s, centre[i]), mesh_fresh_id(m));
    bool parted = mesh_components(m, NULL, NULL) > before;
    if (b->n > 1) change_add(s->events, parted ? CHANGE_SPLIT : CHANGE_HOLE_CLOSE, place, gone + b->n);
    mem_free(centre);
}
