#!/usr/bin/env python3
"""Makes data-samples/balls: two balls that drift into each other, as raw grids.

    tests/make_balls.py data-samples/balls

Only additions, products and square roots, so that every machine makes the same bytes. Not needed at run time.
"""
import math
import struct
import sys

SIDE = 24          # samples a side, voxel size 1
FRAMES = 6
RADIUS = 4.6


def distance(p, centre):
    return math.sqrt(sum((a - b) * (a - b) for a, b in zip(p, centre))) - RADIUS


def samples(frame):
    """Signed distance to the union, negative inside, x fastest."""
    centres = ((5.7 + 0.8 * frame, 11.2, 11.7), (18.2 - 0.8 * frame, 12.4, 12.1))
    return [min(distance((x, y, z), c) for c in centres)
            for z in range(SIDE) for y in range(SIDE) for x in range(SIDE)]


def npy_header():
    """Fortran order, as array[x][y][z]: x fastest."""
    text = "{'descr': '<f4', 'fortran_order': True, 'shape': (%d, %d, %d), }" % (SIDE, SIDE, SIDE)
    text += " " * (-(10 + len(text) + 1) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def main(folder):
    for frame in range(1, FRAMES + 1):
        body = struct.pack("<%df" % SIDE ** 3, *samples(frame))
        with open("%s/balls.%04d.npy" % (folder, frame), "wb") as out:
            out.write(npy_header() + body)
    with open("%s/balls.0001.raw" % folder, "wb") as out:
        out.write(struct.pack("<%df" % SIDE ** 3, *samples(1)))


main(sys.argv[1])
