/* velocity.h: a velocity grid's own units turned into world units a second. */
#pragma once
#include "cli/job.h"

/* What VELOCITY_BY_GRID means for this grid: Mantaflow's for a staggered grid named `velocity` or `vel`, else world. */
VelocityUnits velocity_units_of(const Grid *g, const char *name, VelocityUnits asked);
const char *velocity_units_say(VelocityUnits units);
/* Scales the samples in place. */
void velocity_to_world(Grid *g, VelocityUnits units);
