/* OpenVDB files: the table of contents, the walk, the decoding, and the field made of what came through. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const attribute[] = {"v"};
    const VolumeRequest request = {.velocity = size % 2 ? "v" : NULL, .nattribute = size % 3 == 0, .attribute = attribute};
    fuzz_volume(fuzz_file(".vdb", data, size), &request);
    return 0;
}
