"""Renders a GLB with Blender's Cycles as a plain path tracer. Runs inside Blender:

    blender --background --factory-startup --python-exit-code 1 --python render_cycles.py -- JOB.json

JOB.json: {"scene": GLB, "camera": name or null, "size": [w, h], "samples": n, "bounces": n or -1,
"sky": [r, g, b], "threads": n, "seeds": [..], "output": "prefix"}. Writes prefix.SEED.exr (32-bit, linear, cd/m^2) for each
seed and prefix.json with the seconds of each (wall and processor), and those of a picture of one sample, which is what a
render costs before the first ray.

Blender's importer gives geometry, nodes and lights. Materials are set again from the file, since the importer's Principled
material adds a specular layer that a Lambert surface does not have.
"""

import json
import math
import struct
import sys
import time

import bpy
import numpy

numpy.bool = bool  # Blender 3.4's importer wants a name that newer numpy lacks.

UNLIMITED_BOUNCES = 1024


def glb_json(path):
    with open(path, "rb") as file:
        magic, _, _, length, kind = struct.unpack("<IIIII", file.read(20))
        assert magic == 0x46546C67 and kind == 0x4E4F534A, path
        return json.loads(file.read(length))


def set_material(material, source):
    """One node: Emission, Diffuse (Lambert), or for metals Principled with GGX."""
    tree = material.node_tree
    tree.nodes.clear()
    extensions = source.get("extensions", {})
    pbr = source.get("pbrMetallicRoughness", {})
    color = pbr.get("baseColorFactor", [1.0] * 4)[:3] + [1.0]
    emission = source.get("emissiveFactor", [0.0] * 3)
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    if max(emission) > 0.0:
        assert max(color[:3]) == 0.0, f"{material.name}: emits and reflects; only one of them is compared"
        node = tree.nodes.new("ShaderNodeEmission")
        node.inputs["Color"].default_value = emission + [1.0]
        node.inputs["Strength"].default_value = strength
    elif pbr.get("metallicFactor", 1.0) == 1.0:
        node = tree.nodes.new("ShaderNodeBsdfPrincipled")
        node.distribution = "GGX"
        node.inputs["Base Color"].default_value = color
        node.inputs["Metallic"].default_value = 1.0
        node.inputs["Roughness"].default_value = pbr.get("roughnessFactor", 1.0)
    else:
        lambert = extensions.get("KHR_materials_specular", {}).get("specularFactor", 1.0) == 0.0
        assert lambert, f"{material.name}: a glTF dielectric has no equal in Blender 3.4"
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = color
        node.inputs["Roughness"].default_value = 0.0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])


def import_scene(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    # COMPAT: candela and lux enter as they are, not divided by 683.
    bpy.ops.import_scene.gltf(filepath=job["scene"], convert_lighting_mode="COMPAT")
    document = glb_json(job["scene"])
    sources = {m["name"]: m for m in document["materials"]}
    for material in bpy.data.materials:
        set_material(material, sources[material.name])
    for light in bpy.data.lights:
        if light.type == "SUN":
            light.angle = 0.0
        else:
            light.shadow_soft_size = 0.0
    for placed in bpy.data.objects:
        placed.cycles.shadow_terminator_geometry_offset = 0.0

    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = job["sky"] + [1.0]
    background.inputs["Strength"].default_value = 1.0

    names = [c["name"] for c in document["cameras"]]
    name = job["camera"] or names[0]
    lens = document["cameras"][names.index(name)]["perspective"]
    # The importer names the object after the node and the data after the camera.
    camera = next(o for o in bpy.data.objects if o.type == "CAMERA" and o.data.name == name)
    camera.data.sensor_fit = "VERTICAL"
    camera.data.lens = camera.data.sensor_height / (2.0 * math.tan(lens["yfov"] / 2.0))
    camera.data.clip_start = lens["znear"]
    camera.data.clip_end = 1.0e6
    scene.camera = camera
    return scene


def plain_path_tracing(scene, job):
    """Nothing clamped, filtered, adapted, denoised or toned."""
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "FIXED"
    scene.render.threads = job["threads"]
    scene.render.resolution_x, scene.render.resolution_y = job["size"]
    scene.render.resolution_percentage = 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.dither_intensity = 0.0
    scene.render.use_persistent_data = False
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "ZIP"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_fast_gi = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.min_light_bounces = cycles.min_transparent_bounces = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.film_exposure = 1.0
    cycles.pixel_filter_type = "BOX"
    bounces = UNLIMITED_BOUNCES if job["bounces"] < 0 else job["bounces"]
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, kind + "_bounces", bounces)


def timed_render(scene, samples, seed, output):
    """Wall and processor seconds of the render alone, without writing the file."""
    scene.cycles.samples = samples
    # Cycles puts sample 0 of every pixel on its centre: a bias of edges by 1 / samples. The next as many are as well
    # stratified.
    scene.cycles.sample_offset = samples
    scene.cycles.seed = seed
    wall, processor = time.perf_counter(), time.process_time()
    bpy.ops.render.render()
    seconds = time.perf_counter() - wall, time.process_time() - processor
    bpy.data.images["Render Result"].save_render(output, scene=scene)
    return seconds


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    scene = import_scene(job)
    plain_path_tracing(scene, job)
    first = [timed_render(scene, 1, seed, job["output"] + ".one_sample.exr") for seed in (1, 2)]
    all_samples = [timed_render(scene, job["samples"], seed, f"{job['output']}.{seed}.exr") for seed in job["seeds"]]
    with open(job["output"] + ".json", "w") as file:
        json.dump({"blender": bpy.app.version_string, "one_sample": first, "renders": all_samples}, file)


main()
