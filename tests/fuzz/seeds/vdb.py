"""Small .vdb files: a bake as read_field takes it, and grids of every type and compression as `inspect` does.

One leaf of 8^3 samples below one node of each level; that is 9 kB of masks a grid.
"""

import pathlib
import re
import struct
import zlib

ZIP, ACTIVE_MASK, BLOSC = 1, 2, 4
ROOT = pathlib.Path(__file__).resolve().parents[3]


def text(value):
    value = value.encode()
    return struct.pack("<I", len(value)) + value


PACKERS = {"bool": "<?", "int32": "<i", "int64": "<q", "float": "<f", "double": "<d"}


def metadata(entries):
    body = struct.pack("<I", len(entries))
    for name, (kind, value) in entries.items():
        payload = value.encode() if kind == "string" else struct.pack(PACKERS[kind], value)
        body += text(name) + text(kind) + struct.pack("<I", len(payload)) + payload
    return body


def scale_map(h, offset=None):
    values = [h] * 6 + [1 / h] * 3 + [1 / h ** 2] * 3 + [0.5 / h] * 3
    if offset is None:
        return text("UniformScaleMap") + struct.pack("<15d", *values)
    return text("UniformScaleTranslateMap") + struct.pack("<18d", *offset, *values)


def affine_map(h):
    return text("AffineMap") + struct.pack("<16d", h, 0, 0, 0, 0, h, 0, 0, 0, 0, h, 0, 1, 2, 3, 1)


def unitary_map():
    return text("UnitaryMap") + affine_map(1)[len(text("AffineMap")):-32] + struct.pack("<4d", 0, 0, 0, 1)


def translation_map():
    return text("TranslationMap") + struct.pack("<3d", 1, 2, 3)


def frustum_map():
    return (text("NonlinearFrustumMap") + struct.pack("<8d", 0, 0, 0, 10, 10, 10, 0.5, 10)
            + text("AffineMap") + affine_map(1)[len(text("AffineMap")):])


class Values:
    """How one type of tree stores its values."""

    def __init__(self, tree, code, count=1, half=False):
        self.tree, self.code, self.count, self.half = f"Tree_{tree}_5_4_3", code, count, half

    def pack(self, values, stored=False):
        code = "e" if stored and self.half else self.code
        return b"".join(struct.pack(f"<{self.count}{code}", *[v] * self.count) for v in values)


def chunk(data, compression):
    if not compression & (ZIP | BLOSC):
        return data
    packed = zlib.compress(data) if not compression & BLOSC else blosc(data)
    if len(packed) < len(data):
        return struct.pack("<q", len(packed)) + packed
    return struct.pack("<q", -len(data)) + data


def blosc(data):
    """A chunk that is marked as copied, not packed."""
    return struct.pack("<BBBBIII", 2, 1, 2, 4, len(data), len(data), len(data) + 16) + data


def stored_chunk(kind, values, compression):
    """No halves are no chunk at all."""
    return b"" if kind.half and not values else chunk(kind.pack(values, stored=True), compression)


def node_values(kind, mask_bytes, background, compression):
    """An inner node without active values: all are the background, which the compression leaves out."""
    count = 0 if compression & ACTIVE_MASK else 8 * mask_bytes
    return b"\0" + stored_chunk(kind, [background] * count, compression)


def tree(kind, background, leaf_values, active, compression, inactive=0, tiles=()):
    child = b"\x01"
    topology = struct.pack("<i", 1) + kind.pack([background]) + struct.pack("<II", len(tiles), 1)
    for corner, value, state in tiles:
        topology += struct.pack("<3i", *corner) + kind.pack([value]) + struct.pack("<?", state)
    topology += struct.pack("<3i", 0, 0, 0)
    topology += child + bytes(4095) + bytes(4096) + node_values(kind, 4096, background, compression)
    topology += child + bytes(511) + bytes(512) + node_values(kind, 512, background, compression)
    mask = sum(1 << i for i in active).to_bytes(64, "little")
    topology += mask
    if kind.tree == "Tree_bool_5_4_3":
        return topology, mask + struct.pack("<3i", 0, 0, 0) + mask
    if kind.tree == "Tree_mask_5_4_3":
        return topology, mask + struct.pack("<3i", 0, 0, 0)
    stored = [v for i, v in enumerate(leaf_values) if i in active] if compression & ACTIVE_MASK and inactive != 6 else leaf_values
    extra = kind.pack([3] * {2: 1, 4: 1, 5: 2}.get(inactive, 0)) + (bytes(64) if 3 <= inactive <= 5 else b"")
    return topology, mask + bytes([inactive]) + extra + stored_chunk(kind, stored, compression)


def grid(position, name, kind, entries, transform, body, compression, instance_of="", offsets=True):
    """A descriptor at byte `position` of the file, and the grid behind it."""
    head = text(name) + text(kind.tree + ("_HalfFloat" if kind.half else "")) + text(instance_of)
    topology, buffers = body
    start = struct.pack("<I", compression) + metadata(entries) + transform + topology
    begin = position + len(head) + 24
    places = (begin, begin + len(start), begin + len(start) + len(buffers)) if offsets else (0, 0, 0)
    return head + struct.pack("<3q", *places) + start + buffers


def vdb(grids, offsets=True, version=224):
    data = struct.pack("<QIII?", 0x56444220, version, 10, 0, offsets) + b"00000000-0000-0000-0000-000000000000"
    data += metadata({"creator": ("string", "seed")}) + struct.pack("<i", len(grids))
    for arguments in grids:
        data += grid(len(data), *arguments, offsets=offsets)
    return data


def writer():
    """The mark of bakes that this version reads."""
    source = (ROOT / "sdf/vdb_file.cpp").read_text()
    bake = re.search(r'"fieldlight " FIELDLIGHT_VERSION " (.*)"', source).group(1)
    version = re.search(r"VERSION ([\d.]+) LANGUAGES", (ROOT / "CMakeLists.txt").read_text()).group(1)
    return f"fieldlight {version} {bake}"


def baked(compression):
    """The plane x = 3.5 as one triangle, with triangles of every feature."""
    h = 0.25
    active = range(512)
    distances = [h * (i // 64 - 3.5) for i in active]
    entries = {
        "fieldlight_writer": ("string", writer()), "fieldlight_class": ("string", "mixed"),
        "fieldlight_voxel": ("double", h), "fieldlight_unit": ("double", 1.0),
        "fieldlight_half_thickness": ("double", 0.1), "fieldlight_clean_level_set": ("bool", False),
        "fieldlight_triangle_count": ("int64", 9), "fieldlight_dropped_faces": ("int64", 1),
        "fieldlight_error_voxels_mean": ("double", 0.1), "fieldlight_error_voxels_p99": ("double", 0.2),
        "fieldlight_error_voxels_max": ("double", 0.3), "fieldlight_error_field_voxels_mean": ("double", 0.1),
        "fieldlight_error_field_voxels_p99": ("double", 0.2),
        "fieldlight_error_field_voxels_max": ("double", 0.3), "fieldlight_sign_samples": ("int64", 400),
        "fieldlight_sign_mismatches": ("int64", 3), "fieldlight_source_hash": ("string", "s"),
        "fieldlight_settings_hash": ("string", "t"), "fieldlight_warnings": ("string", "one\ntwo"),
        "fieldlight_sheet_triangles": ("string", "0-2,5"), "fieldlight_thin_wall_triangles": ("string", "3"),
        "name": ("string", "distance"), "class": ("string", "unknown")}
    place = scale_map(h, (1, 2, 3))
    return vdb([
        ("distance", Values("float", "f"), entries, place,
         tree(Values("float", "f"), 4 * h, distances, active, compression), compression),
        ("triangle", Values("int32", "i"), {}, place,
         tree(Values("int32", "i"), -1, [i % 9 for i in active], active, compression), compression)])


def seeds():
    """Pairs of a name and a file's bytes."""
    yield "bake", baked(ACTIVE_MASK)
    yield "bake_blosc", baked(ACTIVE_MASK | BLOSC)
    few = [0, 9, 511]
    values = range(512)
    for kind in (Values("double", "d"), Values("vec3s", "f", 3), Values("vec3d", "d", 3), Values("vec3i", "i", 3),
                 Values("int64", "q"), Values("bool", "?"), Values("mask", "?"), Values("float", "f", half=True)):
        entries = {"is_saved_as_half_float": ("bool", True)} if kind.half else {"number": ("float", 1.5)}
        name = kind.tree.split("_")[1] + ("_half" if kind.half else "")
        yield name, vdb([(name, kind, entries, scale_map(1), tree(kind, 0, values, few, ACTIVE_MASK), ACTIVE_MASK)])
    kind = Values("float", "f", half=True)
    entries = {"is_saved_as_half_float": ("bool", True)}
    packed = ZIP | ACTIVE_MASK
    yield "float_half_zip", vdb([("x", kind, entries, scale_map(1), tree(kind, 0, values, few, packed), packed)])
    kind = Values("float", "f")
    for name, compression in (("zip", ZIP), ("zip_active", ZIP | ACTIVE_MASK)):
        yield name, vdb([(name, kind, {}, affine_map(2), tree(kind, 1, values, few, compression), compression)])
    for inactive in range(1, 7):
        yield f"inactive_{inactive}", vdb([("x", kind, {}, scale_map(1), tree(kind, 1, values, few, ACTIVE_MASK, inactive),
                                            ACTIVE_MASK)])
    tiles = [((4096, 0, -4096), 5, True), ((0, 1 << 20, 0), 7, False)]
    body = tree(kind, 1, values, few, ACTIVE_MASK, tiles=tiles)
    yield "tiles", vdb([("tiles", kind, {}, frustum_map(), body, ACTIVE_MASK)])
    for place in (unitary_map(), translation_map()):
        name = "map_" + place[4:4 + place[0]].decode()
        yield name, vdb([("x", kind, {}, place, tree(kind, 1, values, few, ACTIVE_MASK), ACTIVE_MASK)])
    instance = ("twin", kind, {}, scale_map(3), (b"", b""), ACTIVE_MASK, "first")
    first = ("first", kind, {}, scale_map(1), tree(kind, 1, values, few, ACTIVE_MASK), ACTIVE_MASK)
    yield "instance", vdb([first, instance])
    yield "stream", vdb([first], offsets=False)
    yield "format_222", vdb([first], version=222)
    empty = struct.pack("<i", 1) + kind.pack([1]) + struct.pack("<II", 0, 0)
    yield "empty", vdb([("empty", kind, {}, scale_map(1), (empty, b""), 0)])
