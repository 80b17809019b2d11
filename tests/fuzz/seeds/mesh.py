"""Small valid OBJ, PLY and STL files, one for each thing that their readers treat differently."""

import struct

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def lines(*texts):
    return ("\n".join(texts) + "\n").encode()


def obj_faces(form="{0}"):
    return ["f " + " ".join(form.format(i + 1) for i in face) for face in FACES]


def obj():
    vertices = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    uvs = ["vt 0 0", "vt 1 0 0", "vt 0 1", "vt .5 .5"]
    normals = ["vn 0 0 1", "vn 1 0 0", "vn 0 1 0", "vn -1 -1 -1"]
    yield "obj_plain", lines("# a tetrahedron", *vertices, *obj_faces())
    yield "obj_full", lines(*vertices, *uvs, *normals, *obj_faces("{0}/{0}/{0}"))
    yield "obj_uvs", lines(*vertices, *uvs, *obj_faces("{0}/{0}"))
    yield "obj_normals", lines(*vertices, *normals, *obj_faces("{0}//{0}"))
    yield "obj_negative", lines(*vertices, "f -4 -2 -3", "f -1 -2 -3 \\", " -4")
    yield "obj_colors", lines(*[v + " 1 0.5 0" for v in vertices], *obj_faces())
    yield "obj_concave", lines("v 0 0 0", "v 2 0 0", "v 2 2 0", "v 1 .5 0", "v 0 2 0", "f 1 2 3 4 5")
    yield "obj_objects", lines(*vertices, "o first", "g a b", *obj_faces()[:2], "o second", "s 1", *obj_faces()[2:])
    yield "obj_other", lines(*vertices, "p 1 2", "l 1 2 3", "cstype bezier", "deg 3", "end", *obj_faces())
    # The file is its own material library: each reader skips what is the other's.
    yield "obj_materials", lines("newmtl shiny", "mtllib input.obj", "Kd 0.8 0.4 0.2", "Ks 1 1 1", "Ns 300", "Ke 0 0 2",
                                 "d 0.5", "Ni 1.4", "illum 2", "newmtl physical", "Pr 0.3", "Pm 1", "Tr 0.1",
                                 *vertices, "usemtl shiny", *obj_faces()[:2], "usemtl physical", *obj_faces()[2:])


def ply_header(form, vertex, face, *more):
    return lines("ply", f"format {form} 1.0", "comment small", f"element vertex {len(CORNERS)}",
                 *[f"property {p}" for p in vertex], *face, *more, "end_header")


def ply():
    position = ["float x", "float y", "float z"]
    face = [f"element face {len(FACES)}", "property list uchar int vertex_indices"]
    rows = [f"{x} {y} {z}" for x, y, z in CORNERS]
    faces = ["3 {} {} {}".format(*f) for f in FACES]
    yield "ply_text", ply_header("ascii", position, face) + lines(*rows, *faces)
    yield "ply_text_all", ply_header(
        "ascii", position + [f"float {n}" for n in ("nx", "ny", "nz", "s", "t")]
        + [f"uchar {c}" for c in ("red", "green", "blue", "alpha")], face) + lines(
            *[row + " 0 0 1 .5 .5 255 128 0 255" for row in rows], *faces)
    yield "ply_float_colors", ply_header("ascii", position + [f"float {c}" for c in ("red", "green", "blue")],
                                         face) + lines(*[row + " 1 .5 0" for row in rows], *faces)
    for form, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        body = b"".join(struct.pack(order + "3f", *c) for c in CORNERS)
        body += b"".join(struct.pack(order + "B3i", 3, *f) for f in FACES)
        yield "ply_" + form, ply_header(form, position, face) + body
    doubles = b"".join(struct.pack("<3dH", *c, 7) for c in CORNERS)
    skipped = struct.pack("<H2f", 2, 1, 2)
    shorts = b"".join(struct.pack("<I3HB", 3, *f, 9) for f in FACES)
    yield "ply_odd_types", ply_header(
        "binary_little_endian", ["double x", "float64 y", "double z", "ushort quality"],
        ["element extra 1", "property list ushort float values", f"element face {len(FACES)}",
         "property list uint uint16 vertex_index", "property uint8 flags"]) + doubles + skipped + shorts
    yield "ply_strips", ply_header("ascii", position, ["element tristrips 1", "property list int int vertex_indices"]) \
        + lines(*rows, "9 0 1 2 3 -1 0 2 1 3")


def stl():
    def facet(face):
        corners = [CORNERS[i] for i in face]
        return ["facet normal 0 0 1", "outer loop", *["vertex {} {} {}".format(*c) for c in corners], "endloop", "endfacet"]

    text = [line for face in FACES for line in facet(face)]
    yield "stl_text", lines("solid one", *text, "endsolid one")
    yield "stl_two", lines("solid one", *text, "endsolid", "solid two", *text, "endsolid")
    for name, header in (("stl_binary", b"STL made by a test"), ("stl_binary_solid", b"solid in name only")):
        body = b"".join(struct.pack("<12fH", 0, 0, 1, *[x for i in face for x in CORNERS[i]], 0) for face in FACES)
        yield name, header.ljust(80, b" ") + struct.pack("<I", len(FACES)) + body


def seeds():
    yield from obj()
    yield from ply()
    yield from stl()
