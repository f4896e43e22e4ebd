/* png.h: pictures for a quick look: 8 bits a channel, sRGB. */
#pragma once
#include "base/base.h"

/* rgb: [3 * width * height], rows from the top. The file bears its final name when it is whole. */
bool png_file_write(const char *path, int width, int height, const uint8_t *rgb, Err *err);
