"""Reads float and half channels of single-part scanline EXRs without compression or with ZIP."""

import array
import pathlib
import statistics
import struct
import zlib


def _unzip(data, size):
    if len(data) == size:
        return data
    raw = bytearray(zlib.decompress(data))
    value = raw[0]
    for i in range(1, size):
        value = (value + raw[i] - 128) & 255
        raw[i] = value
    out, half = bytearray(size), (size + 1) // 2
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return bytes(out)


def read_exr(path):
    """Each channel by name, as a list of values in scanline order."""
    data, at, attributes = pathlib.Path(path).read_bytes(), 8, {}
    while data[at]:
        end = data.index(0, at)
        name, at = data[at:end].decode(), data.index(0, end + 1) + 1
        size, = struct.unpack_from("<i", data, at)
        attributes[name], at = data[at + 4:at + 4 + size], at + 4 + size
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height, compression = right - left + 1, bottom - top + 1, attributes["compression"][0]
    if compression not in (0, 2, 3):
        raise ValueError(f"{path}: compression {compression} is not read")
    lines = 16 if compression == 3 else 1
    channels, text = [], attributes["channels"]
    while text[0]:
        end = text.index(0)
        kind, = struct.unpack_from("<i", text, end + 1)
        channels.append((text[:end].decode(), "e" if kind == 1 else "f"))
        text = text[end + 17:]
    pixels = {name: array.array("f", bytes(4 * width * height)) for name, _ in channels}
    line_size = sum(width * struct.calcsize(kind) for _, kind in channels)
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at + 1):
        first, size = struct.unpack_from("<2i", data, offset)
        count = min(lines, bottom + 1 - first)
        block = _unzip(data[offset + 8:offset + 8 + size], count * line_size)
        place = 0
        for y in range(first - top, first - top + count):
            for name, kind in channels:
                values = struct.unpack_from(f"<{width}{kind}", block, place)
                pixels[name][y * width:(y + 1) * width] = array.array("f", values)
                place += width * struct.calcsize(kind)
    return pixels


def squared_bias(pictures, reference):
    """measure.md's bias^2 as a relMSE, both variances subtracted, and its standard error if pixels are independent.

    @param pictures at least two, of independent seeds
    """
    seeds, truth, errors = [read_exr(picture) for picture in pictures], read_exr(reference), []
    for channel in "RGB":
        columns = zip(truth[channel], truth["Variance." + channel], *(seed[channel] for seed in seeds))
        for right, variance, *values in columns:
            mean = sum(values) / len(values)
            own = sum((value - mean) ** 2 for value in values) / (len(values) - 1) / len(values)
            errors.append(((mean - right) ** 2 - own - variance) / (right * right + 0.01))
    mean = statistics.mean(errors)
    return mean, statistics.stdev(errors, mean) / (len(errors) / 3) ** 0.5  # the channels are not independent
