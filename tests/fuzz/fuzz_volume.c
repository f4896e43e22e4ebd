/* All other volume formats: the first byte says which. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const ending[] = {".nvdb", ".npy", ".raw", ".nrrd", ".nhdr", ".uni", ".exr"};
    static const char *const type[] = {NULL, "u8", "f16", "f64"};
    if (size == 0) return 0;
    VolumeRequest request = {.raw_dims = {7, 6, 8}, .raw_type = type[data[0] / 32 % 4], .raw_order = data[0] & 128 ? "zyx" : NULL};
    fuzz_volume(fuzz_file(ending[data[0] % 32 % 7], data + 1, size - 1), &request);
    return 0;
}
