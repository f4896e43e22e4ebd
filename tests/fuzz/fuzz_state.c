/* What another run left: the tracker's memory, a mesh, a glTF's tables; the first byte says which. */
#include "fuzz.h"

#include "io/gltf.h"
#include "track/track.h"

static void read_track(Store *s)
{
    TrackSettings set = track_defaults();
    set.rest = set.own_motion = true;
    Track *tr = track_open(&set);
    track_store(tr, s);
    track_close(tr);
}

static void read_mesh(Store *s)
{
    TriMesh m = {0};
    trimesh_store(&m, s);
    for (int i = 0; i < 3 * m.ntri; i++)
        if (s->bad || m.tri[i] < 0 || m.tri[i] >= m.nvert) abort();
    trimesh_free(&m);
}

/* Its parts are not there. */
static void read_gltf(Store *s)
{
    Err err = {0};
    GltfOptions options = {.path = "/nowhere/fuzz.glb", .fps = 24, .name = "geometric"};
    gltf_abort(gltf_reopen(&options, s, &err));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static void (*const read[])(Store *s) = {read_track, read_mesh, read_gltf};
    if (size == 0) return 0;
    Store s = store_reading(data + 1, size - 1);
    read[data[0] % 3](&s);
    return 0;
}
