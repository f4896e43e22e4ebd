#include "io/bytes.h"
#include "io/volume_write_priv.h"

/* Version 1.0: magic, length of the header, the header filled up with blanks so that the samples begin at byte 128. */
static bool write_header(OutFile *f, const int n[3], Err *err)
{
    enum { SIZE = 128, TEXT = 10 };
    uint8_t head[SIZE + 1];
    memcpy(head, "\x93NUMPY\x01\x00", 8);
    put_u16(head + 8, SIZE - TEXT);
    int used = snprintf((char *)head + TEXT, SIZE - TEXT, "{'descr': '<f4', 'fortran_order': True, 'shape': (%d, %d, %d), }", n[0], n[1], n[2]);
    ASSERT(used > 0 && used < SIZE - TEXT);
    memset(head + TEXT + used, ' ', (size_t)(SIZE - TEXT - used));
    head[SIZE - 1] = '\n';
    return outfile_write(f, head, SIZE, err);
}

bool npy_write(OutFile *f, const Grid *g, Err *err)
{
    int n[3];
    for (int a = 0; a < 3; a++) n[a] = g->hi[a] - g->lo[a] + 1;
    float *row = NEW(float, n[0]);
    uint8_t *bytes = NEW(uint8_t, 4 * (size_t)n[0]);
    bool ok = write_header(f, n, err);
    for (int z = g->lo[2]; ok && z <= g->hi[2]; z++)
        for (int y = g->lo[1]; ok && y <= g->hi[1]; y++) {
            volume_row(g, y, z, row);
            for (int x = 0; x < n[0]; x++) put_f32(bytes + 4 * x, row[x]);
            ok = outfile_write(f, bytes, 4 * (size_t)n[0], err);
        }
    mem_free(row);
    mem_free(bytes);
    return ok;
}
