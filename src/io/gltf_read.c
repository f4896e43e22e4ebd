#include "io/gltf_read.h"
struct GltfReader { int n; };
GltfReader *gltf_reader_open(const char *path, Err *err) { fail(err, ERR_INPUT, "%s: stub", path); return NULL; }
void gltf_reader_close(GltfReader *r) { (void)r; }
int gltf_reader_length(const GltfReader *r) { return r->n; }
int64_t gltf_reader_frame(const GltfReader *r, int i) { (void)r; return i; }
bool gltf_reader_mesh(GltfReader *r, int i, TriMesh *mesh, Err *err) { (void)r; (void)i; (void)mesh; return fail(err, ERR_INPUT, "stub"); }
