#include "io/io_priv.h"

#include <string.h>
#include <strings.h>

/* A density at which smoke ends for the eye. The same for all frames: half of a frame's largest value, say, would
 * make the surface jump from frame to frame. */
static const double DENSITY_ISO = 0.1;

static const char *const LEVEL_SET_NAMES[] = {"phi",      "sdf",       "surface",       "levelset", "level_set",
                                              "distance", "potential", "implicit", NULL};
static const char *const DENSITY_NAMES[] = {"density", "smoke", "fog",  "soot", "fuel", "heat",
                                            "temperature", "flame", "fire", NULL};

static bool is_among(const char *name, const char *const *list)
{
    for (int i = 0; list[i]; i++)
        if (strcasecmp(name, list[i]) == 0) return true;
    return false;
}

static bool has_both_signs(const Grid *g)
{
    bool below = g->background[0] < 0, above = g->background[0] > 0;
    for (int i = 0; i < g->ntile; i++) {
        below |= g->tile[i].value[0] < 0;
        above |= g->tile[i].value[0] > 0;
    }
    size_t n = (size_t)g->nblock * GRID_CELLS;
    for (size_t i = 0; i < n && !(below && above); i++) {
        below |= g->value[i] < 0;
        above |= g->value[i] > 0;
    }
    return below && above;
}

VolumeClass volume_class_of(const VolumeEntry *e, const Grid *g)
{
    if (strcmp(e->grid_class, "level set") == 0) return VOLUME_LEVEL_SET;
    if (strcmp(e->grid_class, "fog volume") == 0) return VOLUME_DENSITY;
    return volume_classify(e->name, g);
}

VolumeClass volume_classify(const char *name, const Grid *g)
{
    if (is_among(name, LEVEL_SET_NAMES)) return VOLUME_LEVEL_SET;
    if (is_among(name, DENSITY_NAMES)) return VOLUME_DENSITY;
    return has_both_signs(g) ? VOLUME_LEVEL_SET : VOLUME_DENSITY;
}

SurfaceChoice volume_choose_surface(const Volume *v, double iso, int inside)
{
    VolumeClass kind = v->kind != VOLUME_UNKNOWN ? v->kind : volume_classify(v->name, &v->surface);
    bool density = kind == VOLUME_DENSITY;
    bool iso_given = !isnan(iso);
    SurfaceChoice c = {.spec = {.iso = iso_given ? iso : density ? DENSITY_ISO : 0,
                                .inside_below = inside ? inside < 0 : !density}};
    char grid[128] = "the grid";
    if (v->name[0]) snprintf(grid, sizeof grid, "grid '%.100s'", v->name);
    const char *hint = !iso_given && !inside ? "; --iso and --inside overrule"
                       : !iso_given         ? " (--inside given; --iso overrules the isovalue)"
                       : !inside            ? " (--iso given; --inside overrules the side)"
                                            : " (--iso and --inside given)";
    snprintf(c.why, sizeof c.why, "%s is taken for a %s: inside is %s %g%s", grid, density ? "density" : "level set",
             c.spec.inside_below ? "below" : "above", c.spec.iso, hint);
    return c;
}
