#include "io/png.h"

#include "io/file.h"

#include <png.h>

static void put_bytes(png_structp png, png_bytep data, size_t n)
{
    OutFile *f = png_get_io_ptr(png);
    if (fwrite(data, 1, n, f->stream) != n) png_error(png, "write");
}

static void flush_nothing(png_structp png) { (void)png; }

/* Its words go nowhere: outfile_fail says what the disk said. */
static void give_up(png_structp png, png_const_charp text)
{
    (void)text;
    png_longjmp(png, 1);
}

static void say_nothing(png_structp png, png_const_charp text) { (void)png, (void)text; }

/* Nothing here is changed between setjmp and longjmp. */
static bool put_image(png_structp png, png_infop info, int width, int height, const uint8_t *rgb)
{
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (int y = 0; y < height; y++) png_write_row(png, rgb + 3 * (size_t)y * (size_t)width);
    png_write_end(png, info);
    return true;
}

bool png_file_write(const char *path, int width, int height, const uint8_t *rgb, Err *err)
{
    OutFile f;
    if (!outfile_open(&f, path, err)) return false;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, give_up, say_nothing);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    bool ok = false;
    if (info) {
        png_set_write_fn(png, &f, put_bytes, flush_nothing);
        ok = put_image(png, info, width, height, rgb) || outfile_fail(&f, err);
    } else {
        fail(err, ERR_RESOURCE, "%.800s: no memory for a PNG", path);
    }
    png_destroy_write_struct(&png, &info);
    if (ok) return outfile_commit(&f, err);
    outfile_abort(&f);
    return false;
}
