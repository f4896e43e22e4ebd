/* homes.h: which component of the surface a vertex must stay on.
 *
 * In a crowded cell the nearest landing may be on another component's surface. Who moves vertices asks; who knows the
 * components (topology) answers. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef struct Homes {
    bool (*is_home)(const void *ctx, int32_t home, Vec3 p); /* is p on the surface of component `home`? */
    const void *ctx;
    const int32_t *of;  /* [nvert] each vertex's component; NONE: not bound */
} Homes;
