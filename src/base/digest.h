/* digest.h: 64 bits that tell contents apart (XXH3); no protection against forgers. */
#pragma once
#include "base/base.h"

uint64_t digest_bytes(const void *data, size_t n);
/* Of a whole file. False with a sentence where it cannot be read. */
bool digest_file(const char *path, uint64_t *out, Err *err);
