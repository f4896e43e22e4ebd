/* volume_options.h: what the options of samples.def and surface.def mean, for every command whose table has them. */
#pragma once
#include "cli/options.h"
#include "io/volume.h"

/* Without velocity and attributes. Texts are borrowed from the options. */
VolumeRequest volume_options_request(const Options *o);
/* NaN: by the grid. */
double volume_options_iso(const Options *o);
/* 1 above, -1 below, 0 by the grid. */
int volume_options_inside(const Options *o);
bool volume_options_border_is_open(const Options *o);
