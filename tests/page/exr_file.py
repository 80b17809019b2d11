"""Reads the EXR files that fieldlight writes, with the standard library alone: one part, scan lines, float channels, ZIP."""

import struct
import zlib

FLOAT = 2
LINES_PER_CHUNK = {0: 1, 2: 1, 3: 16}  # NONE, ZIPS, ZIP


def read_exr(path):
    """(width, height, channels by name, each a tuple of floats in row order). Raises ValueError for any other kind of file."""
    with open(path, "rb") as file:
        data = file.read()
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version & ~0xFF & ~0x400:
        raise ValueError(f"{path}: not a single-part scan-line EXR")
    attributes, at = _header(data, 8)
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    compression = attributes["compression"][0]
    names, kinds = _channels(attributes["channels"])
    if compression not in LINES_PER_CHUNK or any(kind != FLOAT for kind in kinds):
        raise ValueError(f"{path}: compression {compression}, channel types {kinds}; wants ZIP and float")
    lines = LINES_PER_CHUNK[compression]
    planes = {name: [] for name in names}
    for chunk in range(-(-height // lines)):
        (offset,) = struct.unpack_from("<Q", data, at + 8 * chunk)
        first, size = struct.unpack_from("<iI", data, offset)
        count = min(lines, height - (first - top))
        block = data[offset + 8:offset + 8 + size]
        if compression and size < count * len(names) * width * 4:
            block = _unzip(block)
        for line in range(count):
            for index, name in enumerate(names):
                planes[name] += struct.unpack_from(f"<{width}f", block, 4 * width * (line * len(names) + index))
    return width, height, {name: tuple(values) for name, values in planes.items()}


def _header(data, at):
    attributes = {}
    while data[at]:
        name_end = data.index(0, at)
        type_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<I", data, type_end + 1)
        begin = type_end + 5
        attributes[data[at:name_end].decode()] = data[begin:begin + size]
        at = begin + size
    return attributes, at + 1


def _channels(data):
    names, kinds, at = [], [], 0
    while data[at]:
        end = data.index(0, at)
        names.append(data[at:end].decode())
        kinds.append(struct.unpack_from("<i", data, end + 1)[0])
        at = end + 17
    return names, kinds


def _unzip(block):
    """Undoes OpenEXR's predictor (differences of bytes) and its split into even and odd bytes."""
    stored = bytearray(zlib.decompress(block))
    for i in range(1, len(stored)):
        stored[i] = (stored[i - 1] + stored[i] - 128) & 0xFF
    half = (len(stored) + 1) // 2
    result = bytearray(len(stored))
    result[0::2] = stored[:half]
    result[1::2] = stored[half:]
    return bytes(result)
