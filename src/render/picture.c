#include "render/picture.h"

#include <math.h>
#include <string.h>

/* Blender reads a pass only if its channels are single letters, and a motion only if a third one, `a`, goes with u and v. */
const PlaneSpec plane_table[PLANE_COUNT] = {
    [PLANE_R] = {"R", LAYER_BEAUTY, PLANE_SMALL},
    [PLANE_G] = {"G", LAYER_BEAUTY, PLANE_SMALL},
    [PLANE_B] = {"B", LAYER_BEAUTY, PLANE_SMALL},
    [PLANE_A] = {"A", LAYER_BEAUTY, PLANE_SMALL},
    [PLANE_Z] = {"Z", LAYER_DEPTH, PLANE_LARGE},
    [PLANE_NORMAL_X] = {"normal.X", LAYER_NORMAL, PLANE_SMALL},
    [PLANE_NORMAL_Y] = {"normal.Y", LAYER_NORMAL, PLANE_SMALL},
    [PLANE_NORMAL_Z] = {"normal.Z", LAYER_NORMAL, PLANE_SMALL},
    [PLANE_POSITION_X] = {"position.X", LAYER_POSITION, PLANE_LARGE},
    [PLANE_POSITION_Y] = {"position.Y", LAYER_POSITION, PLANE_LARGE},
    [PLANE_POSITION_Z] = {"position.Z", LAYER_POSITION, PLANE_LARGE},
    [PLANE_FORWARD_U] = {"forward.u", LAYER_MOTION, PLANE_SMALL},
    [PLANE_FORWARD_V] = {"forward.v", LAYER_MOTION, PLANE_SMALL},
    [PLANE_FORWARD_KNOWN] = {"forward.a", LAYER_MOTION, PLANE_SMALL},
    [PLANE_BACKWARD_U] = {"backward.u", LAYER_MOTION, PLANE_SMALL},
    [PLANE_BACKWARD_V] = {"backward.v", LAYER_MOTION, PLANE_SMALL},
    [PLANE_BACKWARD_KNOWN] = {"backward.a", LAYER_MOTION, PLANE_SMALL},
    [PLANE_OBJECT] = {"objectId.X", LAYER_ID, PLANE_NUMBER},
    [PLANE_VERTEX] = {"vertexId.X", LAYER_ID, PLANE_NUMBER},
    [PLANE_REST_X] = {"rest.X", LAYER_REST, PLANE_LARGE},
    [PLANE_REST_Y] = {"rest.Y", LAYER_REST, PLANE_LARGE},
    [PLANE_REST_Z] = {"rest.Z", LAYER_REST, PLANE_LARGE},
};

static Sample nothing_of(PlaneId id)
{
    if (id == PLANE_Z) return (Sample){.real = PICTURE_FAR};
    if (plane_table[id].kind == PLANE_NUMBER) return (Sample){.number = PICTURE_NOBODY};
    return (Sample){.real = 0};
}

void picture_init(Picture *p, int width, int height, unsigned layers)
{
    size_t n = (size_t)width * (size_t)height;
    *p = (Picture){.width = width, .height = height};
    for (int id = 0; id < PLANE_COUNT; id++) {
        if (!(layers >> plane_table[id].layer & 1)) continue;
        p->plane[id] = NEW(Sample, n);
        for (size_t i = 0; i < n; i++) p->plane[id][i] = nothing_of((PlaneId)id);
    }
}

void picture_free(Picture *p)
{
    for (int id = 0; id < PLANE_COUNT; id++) mem_free(p->plane[id]);
    *p = (Picture){0};
}

bool picture_has(const Picture *p, Layer layer)
{
    for (int id = 0; id < PLANE_COUNT; id++)
        if (plane_table[id].layer == layer) return p->plane[id] != NULL;
    return false;
}

void picture_paste(Picture *p, int x, const Picture *from)
{
    ASSERT(from->height == p->height && x >= 0 && x + from->width <= p->width);
    for (int id = 0; id < PLANE_COUNT; id++)
        for (int y = 0; p->plane[id] && from->plane[id] && y < p->height; y++)
            memcpy(p->plane[id] + (size_t)y * (size_t)p->width + x, from->plane[id] + (size_t)y * (size_t)from->width,
                   (size_t)from->width * sizeof(Sample));
}

/* IEC 61966-2-1, rounded to 8 bits. */
static uint8_t to_srgb(double x)
{
    x = real_clamp(x, 0, 1);
    double y = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint8_t)(255 * y + 0.5);
}

void picture_to_rgb(const Picture *p, uint8_t *rgb)
{
    size_t n = (size_t)p->width * (size_t)p->height;
    for (size_t i = 0; i < n; i++)
        for (size_t a = 0; a < 3; a++)
            rgb[3 * i + a] = to_srgb((double)p->plane[PLANE_R + a][i].real + 1 - (double)p->plane[PLANE_A][i].real);
}
