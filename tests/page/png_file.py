"""Reads the 8-bit RGB and RGBA PNG files that browsers and fieldlight write, with the standard library alone."""

import struct
import zlib


def read_png(data):
    """(width, height, rows of bytes, channels) of PNG bytes. Raises ValueError for any other kind of file."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("not a PNG")
    at, compressed = 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            if depth != 8 or color not in (2, 6) or interlaced:
                raise ValueError(f"PNG of depth {depth}, colour type {color}, interlacing {interlaced}")
        elif kind == b"IDAT":
            compressed += body
        at += size + 12
    channels = 3 if color == 2 else 4
    stride = width * channels
    lines = zlib.decompress(compressed)
    rows, previous = [], bytearray(stride)
    for y in range(height):
        begin = y * (stride + 1)
        row = bytearray(lines[begin + 1:begin + 1 + stride])
        _unfilter(lines[begin], row, previous, channels)
        rows.append(row)
        previous = row
    return width, height, rows, channels


def _unfilter(kind, row, above, channels):
    """Undoes one row's prediction in place (PNG specification, section 9)."""
    for i in range(len(row)):
        left = row[i - channels] if i >= channels else 0
        up = above[i]
        if kind == 1:
            guess = left
        elif kind == 2:
            guess = up
        elif kind == 3:
            guess = (left + up) // 2
        elif kind == 4:
            corner = above[i - channels] if i >= channels else 0
            estimate = left + up - corner
            distances = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
            guess = (left, up, corner)[distances.index(min(distances))]
        else:
            return
        row[i] = (row[i] + guess) & 0xFF
