#include "io/vat_priv.h"

#include "io/gltf.h"
#include "io/image.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const texture_ending[VAT_TEXTURES] = {"position.exr", "normal.exr"};
static const char base_ending[] = "base.glb";

/* PREFIX.KIND.NNNN.ending; to be freed. */
static char *run_path(const Vat *v, const VatRun *r, const char *ending)
{
    size_t size = strlen(v->prefix) + strlen(r->label) + strlen(ending) + 3;
    char *path = NEW(char, size);
    snprintf(path, size, "%s.%s.%s", v->prefix, r->label, ending);
    return path;
}

/* --- textures --------------------------------------------------------------------------------------- */

/* One row of a texture as planes R, G, B; `take` has room for a row of vertices. What lies behind the last vertex is 0. */
static bool read_row(FILE *stream, const VatRun *r, int texture, int y, float *take, float *const plane[3])
{
    int block = y / r->rows, from = y % r->rows * r->width, n = int_min(r->width, r->nvert - from);
    int64_t at = ((int64_t)VAT_TEXTURES * block + texture) * r->nvert + from;
    if (fseeko(stream, (off_t)(at * 3 * (int64_t)sizeof *take), SEEK_SET) != 0) return false;
    if (fread(take, 3 * sizeof *take, (size_t)n, stream) != (size_t)n) return false;
    for (int k = 0; k < 3; k++) {
        for (int x = 0; x < n; x++) plane[k][x] = take[3 * x + k];
        for (int x = n; x < r->width; x++) plane[k][x] = 0;
    }
    return true;
}

static bool put_rows(Vat *v, const VatRun *r, int texture, ImageFile *image, Err *err)
{
    FILE *stream = v->stream[v->slot].stream;
    size_t band = (size_t)IMAGE_BLOCK * (size_t)r->width;
    float *take = NEW(float, 3 * (size_t)r->width), *plane = NEW(float, 3 * band);
    const void *const planes[3] = {plane, plane + band, plane + 2 * band};
    int height = r->rows * vat_blocks(r);
    bool good = true;
    for (int y = 0; good && y < height; y += IMAGE_BLOCK) {
        int n = int_min(IMAGE_BLOCK, height - y);
        for (int i = 0; good && i < n; i++) {
            float *row = plane + (size_t)i * (size_t)r->width;
            good = read_row(stream, r, texture, y + i, take, (float *const[3]){row, row + band, row + 2 * band}) ||
                   outfile_fail(&v->stream[v->slot], err);
        }
        good = good && image_put_rows(image, n, planes, err);
    }
    mem_free(take);
    mem_free(plane);
    return good;
}

static bool write_texture(Vat *v, const VatRun *r, int texture, Err *err)
{
    static const ImageChannel channel[] = {{"R", IMAGE_FLOAT}, {"G", IMAGE_FLOAT}, {"B", IMAGE_FLOAT}};
    char *path = run_path(v, r, texture_ending[texture]);
    ImageFile *image = image_open(path, r->width, r->rows * vat_blocks(r), 3, channel, err);
    bool good = image && put_rows(v, r, texture, image, err);
    if (good) good = image_close(image, err);
    else if (image) image_abort(image);
    mem_free(path);
    return good;
}

/* --- the base --------------------------------------------------------------------------------------- */

static bool write_base(const Vat *v, const VatRun *r, Err *err)
{
    int height = r->rows * vat_blocks(r);
    float *uv = NEW(float, 2 * (size_t)r->nvert);
    for (int i = 0; i < r->nvert; i++) {
        uv[2 * i] = (float)((i % r->width + 0.5) / r->width);
        uv[2 * i + 1] = (float)((i / r->width + 0.5) / height);
    }
    char *path = run_path(v, r, base_ending);
    bool good = gltf_write_still(path, &v->base, uv, v->name, err);
    mem_free(path);
    mem_free(uv);
    return good;
}

bool vat_write_run(Vat *v, Err *err)
{
    const VatRun *r = &v->run[v->nrun - 1];
    bool good = true;
    for (int t = 0; good && t < VAT_TEXTURES; t++) good = write_texture(v, r, t, err);
    return good && write_base(v, r, err);
}

/* --- the table of runs ------------------------------------------------------------------------------ */

static json_t *vec3_json(const float x[3]) { return json_pack("[f,f,f]", (double)x[0], (double)x[1], (double)x[2]); }

/* Without the folder: the files lie beside each other. */
static json_t *file_json(const Vat *v, const VatRun *r, const char *ending)
{
    char *path = run_path(v, r, ending), *slash = strrchr(path, '/');
    json_t *name = json_string(slash ? slash + 1 : path);
    mem_free(path);
    return name ? name : json_null(); /* no JSON can tell of a name that is no UTF-8 */
}

static json_t *run_json(const Vat *v, const VatRun *r)
{
    return json_pack("{s:i, s:s, s:i, s:b, s:i, s:i, s:i, s:i, s:i, s:{s:o, s:o}, s:o, s:o, s:o}", "first", r->first,
                     "label", r->label, "frames", r->frames, "carried", r->carried, "vertices", r->nvert, "triangles",
                     r->ntri, "width", r->width, "height", r->rows * vat_blocks(r), "rows_per_frame", r->rows, "bounds",
                     "from", vec3_json(r->lo), "to", vec3_json(r->hi), "base", file_json(v, r, base_ending), "position",
                     file_json(v, r, texture_ending[VAT_POSITION]), "normal", file_json(v, r, texture_ending[VAT_NORMAL]));
}

static json_t *all_json(const Vat *v)
{
    float lo[3] = {0}, hi[3] = {0};
    json_t *runs = json_array();
    for (int i = 0; i < v->nrun; i++) {
        const VatRun *r = &v->run[i];
        for (int k = 0; k < 3; k++) {
            lo[k] = i && lo[k] < r->lo[k] ? lo[k] : r->lo[k];
            hi[k] = i && hi[k] > r->hi[k] ? hi[k] : r->hi[k];
        }
        json_array_append_new(runs, run_json(v, r));
    }
    return json_pack("{s:s, s:i, s:s, s:f, s:i, s:{s:o, s:o}, s:o}", "format", "twinmesh vertex animation textures",
                     "version", 1, "mesh", v->name, "fps", v->fps, "frames", v->frame + 1, "bounds", "from", vec3_json(lo),
                     "to", vec3_json(hi), "runs", runs);
}

bool vat_write_json(Vat *v, Err *err)
{
    enum { FLOAT_DIGITS = 9 };
    OutFile file;
    char *path = vat_path(v->prefix);
    json_t *root = all_json(v);
    char *text = json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(FLOAT_DIGITS));
    bool good = outfile_open(&file, path, err);
    if (good) {
        good = outfile_write(&file, text, strlen(text), err) && outfile_write(&file, "\n", 1, err);
        if (good) good = outfile_commit(&file, err);
        else outfile_abort(&file);
    }
    free(text);
    json_decref(root);
    mem_free(path);
    return good;
}
