#include "cli/info.h"
#include "scene/scene.h"

json_t *info_scene(const char *path, Err *err)
{
    Scene s;
    if (!scene_load(path, &s, err)) return NULL;
    const double origin[3] = {s.origin.x, s.origin.y, s.origin.z};
    double end[3];
    for (int a = 0; a < 3; a++) end[a] = origin[a] + s.voxel * (s.n[a] - 1);
    json_t *o = json_pack("{s:o,s:s,s:i,s:{s:I,s:I,s:o},s:o,s:[i,i,i],s:{s:o,s:o},s:o,s:o}", "file", info_text(path), "format", "scene", "elements", s.nelement,
                          "frames", "first", (json_int_t)s.first, "last", (json_int_t)s.last, "fps", info_real(s.fps), "voxel", info_real(s.voxel),
                          "samples", s.n[0], s.n[1], s.n[2], "world", "from", info_reals(3, origin), "to", info_reals(3, end),
                          "iso", info_real(s.iso), "tolerance", info_real(s.tolerance));
    scene_free(&s);
    return o;
}
