"""The smallest PNG and JPEG files, byte by byte."""

import struct
import zlib


def png(width, height, color_type=6, depth=8, interlaced=False):
    """A gradient. Color types: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA."""
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[color_type]

    def rows(w, h):
        row_bytes = (w * channels * depth + 7) // 8
        return b"".join(bytes([y % 5]) + bytes((37 * y + 11 * x) % 256 if color_type != 3 else 0
                                               for x in range(row_bytes)) for y in range(h)) if w and h else b""

    if interlaced:
        passes = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
        data = b"".join(rows((width - x + dx - 1) // dx, (height - y + dy - 1) // dy) for x, y, dx, dy in passes)
    else:
        data = rows(width, height)

    def chunk(kind, payload):
        return struct.pack(">I", len(payload)) + kind + payload + struct.pack(">I", zlib.crc32(kind + payload))

    palette = chunk(b"PLTE", bytes(range(48))) + chunk(b"tRNS", bytes(range(16))) if color_type == 3 else b""
    return (b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color_type, 0, 0, int(interlaced)))
            + palette + chunk(b"IDAT", zlib.compress(data, 9)) + chunk(b"IEND", b""))


def jpeg(components=1, sampling=1, progressive=False, restart=False):
    """Mid-grey blocks: both Huffman tables know one symbol, "no difference" and "end of block"."""

    def segment(marker, payload):
        return struct.pack(">BBH", 0xFF, marker, len(payload) + 2) + payload

    side = 8 * sampling
    frame = struct.pack(">BHHB", 8, side, side, components)
    scan = bytes([components])
    for i in range(components):
        size = sampling if i == 0 else 1
        frame += bytes([i + 1, 16 * size + size, 0])
        scan += bytes([i + 1, 0])
    one_code = bytes([1]) + bytes(15) + b"\0"
    tables = segment(0xDB, b"\0" + bytes([1]) * 64) + segment(0xC4, b"\0" + one_code) + segment(0xC4, b"\x10" + one_code)
    if restart:
        tables += segment(0xDD, struct.pack(">H", 1))
    blocks = components - 1 + sampling * sampling if components > 1 else sampling * sampling
    picture = segment(0xC2 if progressive else 0xC0, frame)
    if progressive:
        body = segment(0xDA, scan + bytes([0, 0, 0])) + _zero_bits(blocks)
        for i in range(components):
            own_blocks = sampling * sampling if i == 0 else 1
            body += segment(0xDA, bytes([1, i + 1, 0, 1, 63, 0])) + _zero_bits(own_blocks)
    else:
        body = segment(0xDA, scan + bytes([0, 63, 0])) + _zero_bits(2 * blocks)
    return b"\xff\xd8" + tables + picture + body + b"\xff\xd9"


def _zero_bits(count):
    """`count` zero bits, padded with ones."""
    bits = "0" * count + "1" * (-count % 8)
    return bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8))
