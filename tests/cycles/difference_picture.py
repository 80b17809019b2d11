"""Ours, Cycles's and their difference side by side in a PNG, to look at."""

import struct
import zlib

import numpy

FULL_SCALE = 0.1  # Relative difference shown as pure red (ours is brighter) or blue.
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])


def write_difference(path, ours, theirs):
    """`ours` and `theirs` [height, width, 3] are linear; both are shown with the same exposure."""
    light = 0.5 * (ours + theirs) @ LUMINANCE
    exposure = 0.18 / numpy.exp(numpy.log(light[light > 0.0]).mean())
    shown = [1.0 - numpy.exp(-exposure * p) for p in (ours, theirs)]
    relative = ((ours - theirs) @ LUMINANCE) / numpy.where(light > 0.0, light, 1.0) / FULL_SCALE
    excess, lack = numpy.clip(relative, 0.0, 1.0), numpy.clip(-relative, 0.0, 1.0)
    shown.append(numpy.stack([1.0 - lack, 1.0 - lack - excess, 1.0 - excess], axis=-1))
    levels = numpy.clip(numpy.concatenate(shown, axis=1), 0.0, 1.0) ** (1.0 / 2.2)
    _write_png(path, numpy.round(255.0 * levels).astype(numpy.uint8))


def _write_png(path, pixels):
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                           (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
