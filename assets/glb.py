"""Builds one GLB: meshes whose equal geometry is stored once, nodes, materials, cameras, suns."""

import json
import math
import struct

from solids import cross, dot, subtract, unit

FLOAT, UNSIGNED_SHORT = 5126, 5123
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


def tidy(values):
    """Rounded, so that files do not differ in the last bits of a machine's sine."""
    return [round(float(v), 6) + 0.0 for v in values]


class Glb:
    def __init__(self, name):
        self.json = {
            "asset": {"version": "2.0", "generator": "Fieldlight assets/make_assets.py"},
            "scene": 0, "scenes": [{"name": name, "nodes": []}],
            "nodes": [], "meshes": [], "materials": [], "cameras": [], "accessors": [], "bufferViews": [],
        }
        self.binary = bytearray()
        self._geometry = {}
        self._meshes = {}

    # --- materials
    def material(self, name, color, metallic, roughness, **more):
        self.json["materials"].append({
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": tidy(color) + [1.0], "metallicFactor": metallic,
                                     "roughnessFactor": roughness}, **more})
        return len(self.json["materials"]) - 1

    def lambert(self, name, color):
        """No specular at all: F0 and F90 are 0, and what is left of the glTF dielectric is Lambert."""
        self._use("KHR_materials_specular")
        return self.material(name, color, 0.0, 1.0, extensions={"KHR_materials_specular": {"specularFactor": 0.0}})

    def emitter(self, name, color, nits):
        """Sends out color x nits and reflects nothing."""
        self._use("KHR_materials_specular")
        self._use("KHR_materials_emissive_strength")
        return self.material(name, (0.0, 0.0, 0.0), 0.0, 1.0, emissiveFactor=tidy(color), extensions={
            "KHR_materials_specular": {"specularFactor": 0.0},
            "KHR_materials_emissive_strength": {"emissiveStrength": nits}})

    # --- geometry
    def mesh(self, name, solid, materials):
        assert len(materials) == len(solid.parts)
        key = (id(solid), tuple(materials))
        if key in self._meshes:
            return self._meshes[key][0]
        if id(solid) not in self._geometry:
            # The solid is kept beside its accessors, so that its id stays its own.
            self._geometry[id(solid)] = (solid, {
                "POSITION": self._vectors(solid.positions, bounds=True),
                "NORMAL": self._vectors(solid.normals)}, [self._indices(part) for part in solid.parts])
        _, attributes, indices = self._geometry[id(solid)]
        self.json["meshes"].append({"name": name, "primitives": [
            {"attributes": attributes, "indices": i, "material": m} for i, m in zip(indices, materials)]})
        self._meshes[key] = (len(self.json["meshes"]) - 1, solid)
        return self._meshes[key][0]

    def _vectors(self, rows, bounds=False, kind="VEC3"):
        more = {}
        if bounds:
            more = {"min": [min(c) for c in zip(*rows)], "max": [max(c) for c in zip(*rows)]}
        data = b"".join(struct.pack(f"<{len(r)}f", *r) for r in rows)
        return self._accessor(data, FLOAT, kind, len(rows), ARRAY_BUFFER, more)

    def _indices(self, triangles):
        flat = [i for t in triangles for i in t]
        assert max(flat) < 65535
        return self._accessor(struct.pack(f"<{len(flat)}H", *flat), UNSIGNED_SHORT, "SCALAR", len(flat),
                              ELEMENT_ARRAY_BUFFER, {})

    def _accessor(self, data, component, kind, count, target, more):
        self.binary += bytes(-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target:
            view["target"] = target
        self.json["bufferViews"].append(view)
        self.binary += data
        self.json["accessors"].append({"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component,
                                       "count": count, "type": kind, **more})
        return len(self.json["accessors"]) - 1

    # --- nodes
    def node(self, name, parent=None, **properties):
        node = {"name": name}
        for key, value in properties.items():
            node[key] = tidy(value) if key in ("translation", "rotation", "scale") else value
        self.json["nodes"].append(node)
        index = len(self.json["nodes"]) - 1
        home = self.json["scenes"][0]["nodes"] if parent is None else \
            self.json["nodes"][parent].setdefault("children", [])
        home.append(index)
        return index

    def place(self, name, solid, materials, **transform):
        materials = materials if isinstance(materials, list) else [materials]
        self.node(name, mesh=self.mesh(name, solid, materials), **transform)

    def instanced_node(self, name, mesh, placements):
        """One node with EXT_mesh_gpu_instancing. placements: (translation, rotation, scale) each."""
        self._use("EXT_mesh_gpu_instancing")
        columns = [[tidy(row) for row in column] for column in zip(*placements)]
        attributes = {key: self._accessor(b"".join(struct.pack(f"<{len(r)}f", *r) for r in column), FLOAT,
                                          kind, len(column), None, {})
                      for key, kind, column in zip(("TRANSLATION", "ROTATION", "SCALE"),
                                                   ("VEC3", "VEC4", "VEC3"), columns)}
        self.node(name, mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})

    def camera(self, name, eye, target, vertical_fov, aspect):
        """vertical_fov in degrees."""
        self.json["cameras"].append({"name": name, "type": "perspective", "perspective": {
            "yfov": round(math.radians(vertical_fov), 6), "znear": 0.01, "aspectRatio": round(aspect, 6)}})
        self.node(name, camera=len(self.json["cameras"]) - 1, translation=eye,
                  rotation=facing(unit(subtract(target, eye))))

    def sun(self, name, towards, color, lux):
        """A directional light that shines the way `towards` points."""
        self._use("KHR_lights_punctual")
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"name": name, "type": "directional", "color": tidy(color), "intensity": lux})
        self.node(name, rotation=facing(unit(towards)),
                  extensions={"KHR_lights_punctual": {"light": len(lights) - 1}})

    def _use(self, extension):
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)
            used.sort()

    def bytes(self):
        self.binary += bytes(-len(self.binary) % 4)
        text = json.dumps({**self.json, "buffers": [{"byteLength": len(self.binary)}]},
                          separators=(",", ":"), sort_keys=True).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self.binary), 0x004E4942) + bytes(self.binary)
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def facing(forward):
    """Quaternion (x, y, z, w) that turns -Z to `forward` (unit) and keeps +Y up."""
    z = tuple(-f for f in forward)
    x = unit(cross((0.0, 1.0, 0.0), z))
    y = cross(z, x)
    # A turn of less than half a circle about (axis): w > 0 wherever the trace allows it.
    candidates = [x[0] + y[1] + z[2], x[0] - y[1] - z[2], y[1] - x[0] - z[2], z[2] - x[0] - y[1]]
    largest = candidates.index(max(candidates))
    size = 2.0 * math.sqrt(1.0 + candidates[largest])
    a, b, c = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    q = [(a, b, c, size * size / 4.0), (size * size / 4.0, y[0] + x[1], z[0] + x[2], a),
         (y[0] + x[1], size * size / 4.0, z[1] + y[2], b), (z[0] + x[2], z[1] + y[2], size * size / 4.0, c)][largest]
    q = [v / size for v in q]
    assert abs(dot(q, q) - 1.0) < 1e-6
    return q
