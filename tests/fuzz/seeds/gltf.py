"""Small valid glTF and GLB files, one for each thing that the loader reads differently."""

import base64
import json
import struct

from seeds.pictures import jpeg, png

BYTE, UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
FORMATS = {BYTE: "b", UNSIGNED_BYTE: "B", SHORT: "h", UNSIGNED_SHORT: "H", UNSIGNED_INT: "I", FLOAT: "f"}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]


class Document:
    """A glTF file with one buffer, built up piece by piece."""

    def __init__(self, **more):
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                     "meshes": [], "accessors": [], "bufferViews": [], **more}
        self.binary = bytearray()

    def add(self, array, value):
        self.json.setdefault(array, []).append(value)
        return len(self.json[array]) - 1

    def use(self, *extensions, required=False):
        for key in ("extensionsUsed", "extensionsRequired")[:2 if required else 1]:
            self.json.setdefault(key, []).extend(extensions)

    def view(self, data, **more):
        self.binary += bytes(-len(self.binary) % 4)
        offset = len(self.binary)
        self.binary += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(data), **more})

    def accessor(self, rows, component=FLOAT, **more):
        rows = [r if isinstance(r, (tuple, list)) else (r,) for r in rows]
        view = self.view(pack(rows, component))
        return self.add("accessors", {"bufferView": view, "componentType": component, "count": len(rows),
                                      "type": TYPES[len(rows[0])], **more})

    def tetrahedron(self, **primitive):
        attributes = {"POSITION": self.accessor(TETRAHEDRON, min=[0, 0, 0], max=[1, 1, 1])}
        attributes.update(primitive.pop("attributes", {}))
        if "indices" not in primitive and "mode" not in primitive:
            primitive["indices"] = self.accessor(FACES, UNSIGNED_BYTE)
        return self.add("meshes", {"primitives": [{"attributes": attributes, **primitive}]})

    def gltf(self, uri=None):
        if self.binary:
            uri = uri or "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
            self.json["buffers"] = [{"byteLength": len(self.binary), "uri": uri}]
        return self._text()

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        return glb([(b"JSON", self._text()), (b"BIN\0", bytes(self.binary))])

    def _text(self):
        # Empty arrays are not valid glTF.
        return json.dumps({k: v for k, v in self.json.items() if v != []}, separators=(",", ":")).encode()


def pack(rows, component):
    return b"".join(struct.pack(f"<{len(r)}{FORMATS[component]}", *r) for r in rows)


def glb(chunks):
    body = b""
    for kind, data in chunks:
        data += (b" " if kind == b"JSON" else b"\0") * (-len(data) % 4)
        body += struct.pack("<I", len(data)) + kind + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def index_kinds():
    for name, component in (("u8", UNSIGNED_BYTE), ("u16", UNSIGNED_SHORT), ("u32", UNSIGNED_INT)):
        document = Document()
        document.tetrahedron(indices=document.accessor(FACES, component))
        yield f"indices_{name}", document.glb()


def modes():
    document = Document(nodes=[{"mesh": i} for i in range(7)], scenes=[{"nodes": list(range(7))}])
    for mode in range(7):
        document.tetrahedron(mode=mode)
    yield "modes", document.gltf()


def sparse():
    document = Document()
    indices = document.view(pack([(1,), (3,)], UNSIGNED_SHORT))
    values = document.view(pack([(2, 0, 0), (0, 0, 2)], FLOAT))
    change = {"count": 2, "indices": {"bufferView": indices, "componentType": UNSIGNED_SHORT},
              "values": {"bufferView": values}}
    position = document.accessor(TETRAHEDRON, sparse=change)
    document.tetrahedron(attributes={"POSITION": position})
    yield "sparse", document.gltf()
    zeros = {"componentType": FLOAT, "count": 4, "type": "VEC3"}
    document.json["accessors"][position] = {**zeros, "sparse": change}
    yield "sparse_on_zeros", document.gltf()
    document.json["accessors"][position] = zeros
    yield "zeros", document.gltf()


def interleaved():
    document = Document()
    rows = [p + (0.0, 0.0, 1.0) for p in TETRAHEDRON]
    view = document.view(pack(rows, FLOAT), byteStride=24)
    attributes = {name: document.add("accessors", {"bufferView": view, "byteOffset": 12 * i, "componentType": FLOAT,
                                                   "count": 4, "type": "VEC3"})
                  for i, name in enumerate(("POSITION", "NORMAL"))}
    document.tetrahedron(attributes=attributes)
    yield "interleaved", document.glb()


def quantized():
    document = Document()
    document.use("KHR_mesh_quantization", required=True)
    attributes = {
        "POSITION": document.accessor([(0, 0, 0, 0), (100, 0, 0, 0), (0, 100, 0, 0), (0, 0, 100, 0)], BYTE),
        "NORMAL": document.accessor([(0, 0, 127, 0)] * 4, BYTE, normalized=True),
        "TEXCOORD_0": document.accessor([(0, 0), (65535, 0), (0, 65535), (9, 9)], UNSIGNED_SHORT, normalized=True),
        "COLOR_0": document.accessor([(255, 0, 0, 128)] * 4, UNSIGNED_BYTE, normalized=True),
        "TANGENT": document.accessor([(32767, 0, 0, 32767)] * 4, SHORT, normalized=True)}
    document.tetrahedron(attributes=attributes)
    for name in ("POSITION", "NORMAL"):
        document.json["accessors"][attributes[name]]["type"] = "VEC3"
        document.json["bufferViews"][document.json["accessors"][attributes[name]]["bufferView"]]["byteStride"] = 4
    yield "quantized", document.glb()


def morphed():
    document = Document(nodes=[{"mesh": 0, "weights": [0.5, 0.25]}, {"mesh": 0}], scenes=[{"nodes": [0, 1]}])
    up = [(0, 0, 1)] * 4
    normal = document.accessor(up)
    document.tetrahedron(attributes={"NORMAL": normal, "TANGENT": document.accessor([(1, 0, 0, 1)] * 4)},
                         targets=[{"POSITION": normal, "NORMAL": normal, "TANGENT": normal}, {"POSITION": normal}])
    document.json["meshes"][0]["weights"] = [1.0, 0.0]
    yield "morphed", document.glb()


def material_document(image, mime, **sampler):
    """Every slot of a material in use, with mirrored texture coordinates and no tangents."""
    document = Document(nodes=[{"mesh": 0}, {"mesh": 1}, {"mesh": 2}], scenes=[{"nodes": [0, 1, 2]}])
    document.use("KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
                 "KHR_materials_unlit", "KHR_texture_transform")
    document.add("images", {"bufferView": document.view(image), "mimeType": mime, "name": "p"})
    document.add("samplers", sampler)
    document.add("textures", {"source": 0, "sampler": 0})
    document.add("textures", {"source": 0})
    turned = {"index": 0, "texCoord": 1, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1.0, "scale": [2, -1], "texCoord": 0}}}
    plain = {"index": 1, "texCoord": 1}
    document.add("materials", {
        "name": "all", "doubleSided": True, "alphaMode": "MASK", "alphaCutoff": 0.4,
        "emissiveFactor": [1, 0.5, 0.25], "emissiveTexture": plain, "occlusionTexture": plain,
        "normalTexture": {**turned, "scale": 0.5},
        "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 0.5], "baseColorTexture": turned,
                                 "metallicFactor": 0.5, "roughnessFactor": 0.25, "metallicRoughnessTexture": plain},
        "extensions": {"KHR_materials_ior": {"ior": 1.3}, "KHR_materials_emissive_strength": {"emissiveStrength": 9},
                       "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": plain,
                                                  "specularColorFactor": [1, 1, 0.5],
                                                  "specularColorTexture": plain}}})
    document.add("materials", {"alphaMode": "BLEND", "extensions": {"KHR_materials_unlit": {}},
                               "pbrMetallicRoughness": {"baseColorTexture": plain}})
    attributes = {"NORMAL": document.accessor([(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 0)]),
                  "TEXCOORD_0": document.accessor([(0, 0), (1, 0), (0, 1), (-1, 0.5)]),
                  "TEXCOORD_1": document.accessor([(0, 0), (9, 0), (0, -9), (0.5, 0.5)]),
                  "COLOR_0": document.accessor([(1, 0.5, 0.25)] * 4)}
    document.tetrahedron(attributes=attributes, material=0)
    document.tetrahedron(attributes=attributes, material=1)
    document.tetrahedron()
    return document


def materials():
    yield "material_png", material_document(png(3, 2), "image/png", wrapS=33071, wrapT=33648, magFilter=9728).glb()
    yield "material_jpeg", material_document(jpeg(3), "image/jpeg", wrapS=10497, magFilter=9729, minFilter=9987).glb()
    document = material_document(png(1, 1), "image/png")
    uri = "data:image/png;base64," + base64.b64encode(png(2, 2, 2)).decode()
    document.json["images"] = [{"uri": uri}]
    document.use("EXT_texture_webp")
    document.json["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": 0}}
    yield "image_uri", document.gltf()


def lights_and_cameras():
    document = Document(nodes=[
        {"children": [1, 2, 3, 4, 5], "rotation": [0, 0.6, 0, 0.8], "scale": [1, -2, 3], "mesh": 0},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 1, 2]},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}, "translation": [0, 1, 3]},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        {"camera": 0, "translation": [0.3, 0.3, 4]},
        {"camera": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 5, 1]}])
    document.use("KHR_lights_punctual")
    document.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1, 0.5, 0.2], "intensity": 40, "range": 9, "name": "lamp"},
        {"type": "spot", "intensity": 30, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}},
        {"type": "directional", "intensity": 3}]}}
    document.add("cameras", {"type": "perspective", "name": "eye", "perspective": {
        "yfov": 0.7, "znear": 0.1, "zfar": 100, "aspectRatio": 1.5}})
    document.add("cameras", {"type": "orthographic",
                             "orthographic": {"xmag": 2, "ymag": 2, "znear": 0, "zfar": 50}})
    document.tetrahedron()
    yield "lights_and_cameras", document.gltf()


def instancing():
    document = Document()
    document.use("EXT_mesh_gpu_instancing", required=True)
    attributes = {"TRANSLATION": document.accessor([(0, 0, 0), (2, 0, 0), (0, 3, 0)]),
                  "ROTATION": document.accessor([(0, 0, 127, 0)] * 3, BYTE, normalized=True),
                  "SCALE": document.accessor([(1, 1, 1), (1, 2, 3), (-1, 1, 1)])}
    document.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    document.tetrahedron()
    yield "instancing", document.glb()


def scenes_and_leftovers():
    """What is read around the picture: several scenes, animations, skins, extras, unknown extensions."""
    document = Document(scene=1, scenes=[{"name": "first", "nodes": [0]}, {"name": "second", "nodes": [1]}],
                        nodes=[{"name": "a", "mesh": 0}, {"name": "b", "mesh": 0, "skin": 0, "children": [2]},
                               {"name": "joint", "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1]}])
    document.use("KHR_materials_clearcoat", "VENDOR_unheard_of")
    document.json["asset"].update(minVersion="2.0", generator="fuzz", copyright="none")
    document.tetrahedron()
    times = document.accessor([0, 1])
    document.add("animations", {"channels": [{"sampler": 0, "target": {"node": 2, "path": "scale"}}],
                                "samplers": [{"input": times, "output": document.accessor([(1, 1, 1)] * 2)}]})
    document.add("skins", {"joints": [2]})
    document.json["extras"] = {"nested": [[[1]], {"text": "\u00e9\n\"\\"}], "number": -1.5e-3}
    yield "scenes_and_leftovers", document.gltf()


# The tetrahedron as the encoders of Debian's draco 1.5.5 and meshoptimizer 0.18 write it.
DRACO = {
    "edgebreaker": "RFJBQ08CAgEBAAAABAQAAwAAAS8BARAB/wAAAQAJAwAAAgEBAQADAwEQATADAFCCJJEEAAAAAP8AAAAAAAAAAAAAAAAAAAAAAIA/CA==",
    "sequential": "RFJBQ08CAgEAAAAEBAEAAgEAAQMBAgMCAAMBAQAJAwAAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPw==",
}
MESHOPT = {
    "positions": "oAAAATwAAAD//wE8AAAAfn0AAAEPAAAA//8BDwAAAH59AAABAwAAAP8BAwAAAH4AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==",
    "exponential": "oAABPAAAAEA/AAEgAAAAAAEPAAAAQD8AASAAAAAAAQMAAABAAAEgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADyAAAA8gAAAPI=",
    "octahedral": "oAE/AAAA/v2pAQ8AAAD+WAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAfwA=",
    "triangles": "4P4PEgPwBAIAdodWZ3iphmWJaJgBaQAA",
    "indices": "0AAIAgIECAYEBAIGDAAAAAA=",
}


def draco():
    for method, text in DRACO.items():
        document = Document()
        document.use("KHR_draco_mesh_compression", required=True)
        view = document.view(base64.b64decode(text))
        position = document.add("accessors", {"componentType": FLOAT, "count": 4, "type": "VEC3",
                                              "min": [0, 0, 0], "max": [1, 1, 1]})
        indices = document.add("accessors", {"componentType": UNSIGNED_INT, "count": 12, "type": "SCALAR"})
        document.add("meshes", {"primitives": [{"attributes": {"POSITION": position}, "indices": indices, "extensions": {
            "KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0}}}}]})
        yield "draco_" + method, document.glb()


def meshopt():
    def packed_view(document, text, count, stride, mode, **more):
        data = base64.b64decode(text)
        document.binary += bytes(-len(document.binary) % 4)
        extension = {"buffer": 0, "byteOffset": len(document.binary), "byteLength": len(data), "byteStride": stride,
                     "count": count, "mode": mode, **more}
        document.binary += data
        view = {"buffer": 1, "byteLength": count * stride, "extensions": {"EXT_meshopt_compression": extension}}
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride
        return document.add("bufferViews", view)

    cases = (("triangles", "positions", {}, "TRIANGLES"), ("indices", "positions", {}, "INDICES"),
             ("triangles", "exponential", {"filter": "EXPONENTIAL"}, "TRIANGLES"))
    for indices, positions, filters, mode in cases:
        document = Document()
        document.use("EXT_meshopt_compression", "KHR_mesh_quantization", required=True)
        accessors = [
            {"bufferView": packed_view(document, MESHOPT[positions], 4, 12, "ATTRIBUTES", **filters),
             "componentType": FLOAT, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": packed_view(document, MESHOPT["octahedral"], 4, 4, "ATTRIBUTES", filter="OCTAHEDRAL"),
             "componentType": BYTE, "normalized": True, "count": 4, "type": "VEC3"},
            {"bufferView": packed_view(document, MESHOPT[indices], 12, 4, mode), "componentType": UNSIGNED_INT,
             "count": 12, "type": "SCALAR"}]
        document.json["accessors"] = accessors
        document.add("meshes", {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]})
        document.json["buffers"] = [
            {"byteLength": len(document.binary), "uri": "data:application/octet-stream;base64,"
             + base64.b64encode(document.binary).decode()},
            {"byteLength": 1000, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}]
        yield f"meshopt_{indices}_{positions}", document._text()


def animated():
    document = Document()
    document.tetrahedron()
    times = document.accessor([0, 0.5, 2], min=[0], max=[2])
    turns = document.accessor([(0, 0, 0, 1), (0, 0.7071068, 0, 0.7071068), (0, 1, 0, 0)])
    steps = document.accessor([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    # In tangent, value, out tangent.
    curve = document.accessor([(0, 0, 0), (1, 1, 1), (1, 0, 0)] * 3)
    document.add("animations", {"name": "all", "channels": [
        {"sampler": 0, "target": {"node": 0, "path": "rotation"}},
        {"sampler": 1, "target": {"node": 0, "path": "translation"}},
        {"sampler": 2, "target": {"node": 0, "path": "scale"}}], "samplers": [
            {"input": times, "output": turns, "interpolation": "LINEAR"},
            {"input": times, "output": steps, "interpolation": "STEP"},
            {"input": times, "output": curve, "interpolation": "CUBICSPLINE"}]})
    yield "animated", document.glb()


def shared_files():
    """Many mentions of one file and of one picture."""
    document = Document()
    document.json["buffers"] = [{"byteLength": n, "uri": uri} for n, uri in
                                enumerate(["input.gltf", "./input.gltf", "in%70ut.gltf"], start=1)]
    document.json.update(meshes=[], accessors=[], bufferViews=[], nodes=[{}])
    yield "one_file_thrice", document._text()
    document = material_document(png(2, 2), "image/png")
    image = dict(document.json["images"][0])
    document.json["images"].append(image)
    document.add("textures", {"source": len(document.json["images"]) - 1})
    document.json["materials"].append({"emissiveFactor": [1, 1, 1],
                                       "emissiveTexture": {"index": len(document.json["textures"]) - 1}})
    yield "one_image_twice", document.glb()


def files():
    """Containers: chunks, URIs of several kinds, files without geometry."""
    yield "empty", b'{"asset":{"version":"2.0"}}'
    yield "empty_glb", glb([(b"JSON", b'{"asset":{"version":"2.0"}}')])
    document = Document()
    document.tetrahedron()
    document.json["buffers"] = [{"byteLength": len(document.binary)}]
    text = json.dumps(document.json).encode()
    yield "unknown_chunk", glb([(b"JSON", text), (b"BIN\0", bytes(document.binary)), (b"WHAT", b"1234")]) + b"after"
    document.json["buffers"] = [{"byteLength": 2, "uri": "input.gltf"}, {"byteLength": 3, "uri": "./in%70ut.gltf"}]
    document.json.update(meshes=[], accessors=[], bufferViews=[], nodes=[{}])
    yield "reads_itself", document._text()
    document = Document()
    document.tetrahedron()
    yield "percent_encoded", document.gltf("data:," + "".join(f"%{b:02x}" for b in document.binary))


def seeds():
    """Pairs of a name and a file's bytes."""
    for group in (index_kinds, modes, sparse, interleaved, quantized, morphed, materials, lights_and_cameras, instancing,
                  scenes_and_leftovers, draco, meshopt, animated, shared_files, files):
        yield from group()
