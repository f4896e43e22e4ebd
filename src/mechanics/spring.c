#include "mechanics/mechanics_priv.h"

Spring spring_make(double k, double rest, Vec3 p0, Vec3 p1, Vec3 f[2])
{
    Vec3 e = v_sub(p1, p0);
    double l = v_len(e);
    f[0] = f[1] = vec3(0, 0, 0);
    if (!(l > 0)) return (Spring){0}; /* no direction to push in */
    Vec3 d = v_scale(e, 1 / l);
    f[0] = v_scale(d, k * (l - rest));
    f[1] = v_scale(d, -k * (l - rest));
    return (Spring){.d = d, .along = k, .across = k * real_max(0, 1 - rest / l)};
}

int spring_edges(int ntri, const int32_t *tri, Map *seen, int32_t *edge)
{
    int nedge = 0;
    map_clear(seen);
    for (int h = 0; h < 3 * ntri; h++) {
        int a = tri[h], b = tri[h % 3 == 2 ? h - 2 : h + 1];
        if (map_put(seen, key_pair(int_min(a, b), int_max(a, b)), nedge) != nedge) continue;
        edge[2 * nedge] = int_min(a, b);
        edge[2 * nedge + 1] = int_max(a, b);
        nedge++;
    }
    return nedge;
}
