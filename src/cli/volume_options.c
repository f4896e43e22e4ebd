#include "cli/volume_options.h"

#include <math.h>

VolumeRequest volume_options_request(const Options *o)
{
    int origin = options_find(o, "origin"), spacing = options_find(o, "spacing"), dims = options_find(o, "dims");
    VolumeRequest r = {
        .grid = option_text(o, options_find(o, "grid")),
        .raw_type = option_text(o, options_find(o, "type")),
        .raw_order = option_text(o, options_find(o, "order")),
        .has_origin = option_given(o, origin),
    };
    for (int i = 0; i < 3; i++) {
        r.raw_dims[i] = (int)o->value[dims].real[i];
        r.spacing[i] = option_given(o, spacing) ? o->value[spacing].real[i] : 0;
        r.origin[i] = o->value[origin].real[i];
    }
    return r;
}

double volume_options_iso(const Options *o)
{
    int iso = options_find(o, "iso");
    return option_given(o, iso) ? option_real(o, iso) : NAN;
}

int volume_options_inside(const Options *o)
{
    int inside = options_find(o, "inside");
    return !option_given(o, inside) ? 0 : option_choice(o, inside) == 0 ? 1 : -1;
}

bool volume_options_border_is_open(const Options *o) { return option_choice(o, options_find(o, "border")) == 1; }
