"""Small valid EXR, HDR, PNG and JPEG files, one for each thing that the readers treat differently."""

import struct
import zlib

from seeds.pictures import jpeg, png

UINT, HALF, FLOAT = 0, 1, 2
NONE, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB = range(10)
LINES = {NONE: 1, RLE: 1, ZIPS: 1, ZIP: 16, PIZ: 32, PXR24: 16, B44: 32, B44A: 32, DWAA: 32, DWAB: 256}


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value


def channel(name, kind, sampling=1):
    return name.encode() + b"\0" + struct.pack("<IIii", kind, 0, sampling, sampling)


def header(width, height, compression, channels, flags=0, more=b"", origin=(0, 0)):
    x, y = origin
    window = struct.pack("<4i", x, y, x + width - 1, y + height - 1)
    return (struct.pack("<II", 20000630, 2 | flags)
            + attribute("channels", "chlist", b"".join(channel(*c) for c in channels) + b"\0")
            + attribute("compression", "compression", bytes([compression]))
            + attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
            + attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
            + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
            + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + more + b"\0")


def pack(data, compression):
    """A chunk's bytes; as they are where packing gains nothing, as the format demands."""
    if compression in (ZIPS, ZIP, RLE):
        split = data[0::2] + data[1::2]
        differences = bytes([split[0]]) + bytes((b - a + 128) % 256 for a, b in zip(split, split[1:]))
        packed = zlib.compress(differences) if compression != RLE else run_lengths(differences)
        return packed if len(packed) < len(data) else data
    return data


def run_lengths(data):
    packed, i = b"", 0
    while i < len(data):
        n = 1
        while i + n < len(data) and data[i + n] == data[i] and n < 127:
            n += 1
        if n >= 3:
            packed += bytes([n - 1, data[i]])
            i += n
        else:
            packed += bytes([255, data[i]])
            i += 1
    return packed


def value(kind, i):
    i = abs(i)
    return {UINT: struct.pack("<I", i), HALF: struct.pack("<e", i / 4), FLOAT: struct.pack("<f", i / 4)}[kind]


def scanlines(width, height, compression, channels, constant=False, **more):
    start = header(width, height, compression, channels, **more)
    first = more.get("origin", (0, 0))[1]
    chunks = []
    for y in range(first, first + height, LINES[compression]):
        data = b""
        for row in range(y, min(y + LINES[compression], first + height)):
            for name, kind, *sampling in channels:
                step = sampling[0] if sampling else 1
                if row % step == 0:
                    data += b"".join(value(kind, 1 if constant else x + row) for x in range(0, width, step))
        packed = pack(data, compression)
        chunks.append(struct.pack("<iI", y, len(packed)) + packed)
    return table_and_chunks(start, chunks)


def tiles(width, height, side, compression, channels):
    description = attribute("tiles", "tiledesc", struct.pack("<IIB", side, side, 0))
    start = header(width, height, compression, channels, flags=0x200, more=description)
    chunks = []
    for y in range(0, height, side):
        for x in range(0, width, side):
            rows, columns = min(side, height - y), min(side, width - x)
            data = b"".join(value(kind, i) for _ in range(rows) for _, kind in channels for i in range(columns))
            packed = pack(data, compression)
            chunks.append(struct.pack("<4iI", x // side, y // side, 0, 0, len(packed)) + packed)
    return table_and_chunks(start, chunks)


def table_and_chunks(start, chunks):
    position = len(start) + 8 * len(chunks)
    table = b""
    for chunk in chunks:
        table += struct.pack("<Q", position)
        position += len(chunk)
    return start + table + b"".join(chunks)


def exr():
    rgb = [("B", HALF), ("G", HALF), ("R", HALF)]
    for compression, name in enumerate(("none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab")):
        if compression in (NONE, RLE, ZIPS, ZIP):
            yield f"exr_{name}", scanlines(5, 3, compression, rgb, constant=True)
        else:
            # Two pixels stay as they are: nothing is shorter.
            yield f"exr_{name}", scanlines(1, 2, compression, [("R", FLOAT)])
    layers = [("A", FLOAT), ("B", FLOAT), ("Depth.Z", FLOAT), ("G", FLOAT), ("Id", UINT), ("R", FLOAT)]
    yield "exr_layers", scanlines(4, 20, ZIP, layers, origin=(-3, -20))
    yield "exr_luminance_chroma", scanlines(4, 4, ZIPS, [("BY", HALF, 2), ("RY", HALF, 2), ("Y", HALF)])
    yield "exr_luminance", scanlines(2, 2, NONE, [("Y", FLOAT)])
    yield "exr_tiled", tiles(5, 5, 4, ZIP, rgb)
    attributes = (attribute("owner", "string", b"nobody") + attribute("n", "int", struct.pack("<i", -4))
                  + attribute("d", "double", struct.pack("<d", 0.5)) + attribute("m", "m44f", struct.pack("<16f", *range(16)))
                  + attribute("m3", "m33f", struct.pack("<9f", *range(9))) + attribute("i", "v2i", struct.pack("<2i", 1, 2))
                  + attribute("v", "v3f", struct.pack("<3f", 1, 2, 3)) + attribute("r", "rational", struct.pack("<iI", 1, 2))
                  + attribute("e", "envmap", b"\1") + attribute("c", "chromaticities", struct.pack("<8f", *range(8)))
                  + attribute("l", "stringvector", struct.pack("<I", 2) + b"ab" + struct.pack("<I", 1) + b"c")
                  + attribute("x", "unheard_of", b"1234")
                  + attribute("preview", "preview", struct.pack("<II", 1, 1) + bytes(4)))
    yield "exr_attributes", scanlines(1, 1, NONE, rgb, more=attributes)


def hdr():
    head = b"#?RADIANCE\n# seed\nEXPOSURE=2\nEXPOSURE= 0.5\nFORMAT=32-bit_rle_rgbe\n\n"
    pixel = bytes([100, 50, 25, 129])
    yield "hdr_flat", head + b"-Y 2 +X 3\n" + pixel * 6
    yield "hdr_old_runs", head + b"-Y 1 +X 9\n" + pixel + bytes([1, 1, 1, 3]) + pixel + bytes([1, 1, 1, 4])
    line = bytes([2, 2, 0, 10]) + b"".join(bytes([128 + 6, c, 4, 1, 2, 3, 4]) for c in pixel)
    yield "hdr_runs", head + b"-Y 2 +X 10\r\n" + 2 * line
    yield "hdr_black", b"#?RGBE\n\n-Y 1 +X 1\n" + bytes(4)


def textures():
    for color_type, depth in ((0, 1), (0, 2), (0, 4), (0, 8), (0, 16), (2, 8), (2, 16), (3, 1), (3, 2), (3, 4), (3, 8),
                              (4, 8), (4, 16), (6, 8), (6, 16)):
        yield f"png_type{color_type}_{depth}bit", png(5, 7, color_type, depth)
    yield "png_interlaced", png(9, 9, 6, 8, interlaced=True)
    yield "jpeg_grey", jpeg(1)
    yield "jpeg_color", jpeg(3)
    yield "jpeg_subsampled", jpeg(3, sampling=2)
    yield "jpeg_cmyk", jpeg(4)
    yield "jpeg_progressive", jpeg(3, progressive=True)
    yield "jpeg_restart", jpeg(1, restart=True)


def seeds():
    """Pairs of a name and a file's bytes."""
    yield from exr()
    yield from hdr()
    yield from textures()
