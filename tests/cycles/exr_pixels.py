"""Reads the EXR files that these scripts compare: one part, scan lines, float channels, no or ZIP compression."""

import struct
import zlib

import numpy

FLOAT = 2
LINES_PER_CHUNK = {0: 1, 2: 1, 3: 16}  # NONE, ZIPS, ZIP


def read_exr(path):
    """Channels by name, each an array [height, width] of float32. Raises ValueError for any other kind of file."""
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
    chunk_count = -(-height // lines)
    pixels = numpy.empty((height, len(names), width), numpy.float32)
    for (offset,) in struct.iter_unpack("<Q", data[at:at + 8 * chunk_count]):
        first, size = struct.unpack_from("<iI", data, offset)
        row = first - top
        count = min(lines, height - row)
        block = data[offset + 8:offset + 8 + size]
        expected = count * len(names) * width * 4
        if compression and size < expected:
            block = _unzip(block)
        pixels[row:row + count] = numpy.frombuffer(block, "<f4", expected // 4).reshape(count, len(names), width)
    return {name: pixels[:, index] for index, name in enumerate(names)}


def rgb(channels, layer=""):
    """Array [height, width, 3] of a layer: "" for the beauty."""
    prefix = layer + "." if layer else ""
    return numpy.stack([channels[prefix + c] for c in "RGB"], axis=-1).astype(numpy.float64)


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
    stored = numpy.frombuffer(zlib.decompress(block), numpy.uint8).astype(numpy.int64)
    stored[1:] -= 128
    bytes_in_halves = (numpy.cumsum(stored) & 0xFF).astype(numpy.uint8)
    half = (len(bytes_in_halves) + 1) // 2
    result = numpy.empty_like(bytes_in_halves)
    result[0::2] = bytes_in_halves[:half]
    result[1::2] = bytes_in_halves[half:]
    return result.tobytes()
