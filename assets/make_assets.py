#!/usr/bin/env python3
"""Makes the scenes of this folder, each a GLB of a few hundred kilobytes at most. Standard library only.

Usage: make_assets.py            writes the files beside this script
       make_assets.py --check    writes nothing; fails if a file differs from what it would write

Units are metres and nits (cd/m^2). Solids are closed, wound outwards, and checked to be so. Where solids
touch they overlap a little, so that no joint is left to the rounding of a tracer.
"""

import math
import pathlib
import random
import sys

from glb import Glb
from solids import ball, box, crystal, grid_solid, rounded_column, torus

HERE = pathlib.Path(__file__).resolve().parent


def turn_y(degrees):
    """Quaternion of a turn about +Y."""
    half = math.radians(degrees) / 2.0
    return (0.0, math.sin(half), 0.0, math.cos(half))


def lamp_solid(low, high, cells):
    """A box whose face below is the first of two parts, in cells x cells squares.

    The cells are for Blender's Cycles: 3.4 loses up to 3 % of the light of a triangle longer than its distance, against
    the polygon's form factor; with small ones it is exact.
    """
    xs, zs = ([low[a] + (high[a] - low[a]) * i / cells for i in range(cells + 1)] for a in (0, 2))
    solid = grid_solid(xs, [low[1], high[1]], zs, lambda i, j, k: True)
    return solid.split(lambda normal: normal[1] < -0.5)


def cornell_box():
    """The Cornell box after the measured data of Cornell's Program of Computer Graphics, ten times its size."""
    scene = Glb("cornell_box")
    white = scene.lambert("white", (0.73, 0.73, 0.70))
    red = scene.lambert("red", (0.62, 0.06, 0.05))
    green = scene.lambert("green", (0.13, 0.45, 0.09))
    light = scene.emitter("light", (1.0, 0.82, 0.55), 12000.0)
    x, y, z, wall = 2.764, 5.488, 2.796, 0.2
    scene.place("floor", box((-x - wall, -wall, -z - wall), (x + wall, 0.0, z)), white)
    scene.place("ceiling", box((-x - wall, y, -z - wall), (x + wall, y + wall, z)), white)
    scene.place("back wall", box((-x - wall, -0.1, -z - wall), (x + wall, y + 0.1, -z)), white)
    scene.place("left wall", box((-x - wall, -0.1, -z - 0.1), (-x, y + 0.1, z)), red)
    scene.place("right wall", box((x, -0.1, -z - 0.1), (x + wall, y + 0.1, z)), green)
    # Only the face below shines: light made where nobody sees it is noise.
    scene.place("lamp", lamp_solid((-0.65, y - 0.02, -0.525), (0.65, y + 0.1, 0.525), 8), [light, white])
    sunk = 0.02
    short = box((-0.825, -sunk, -0.825), (0.825, 1.65, 0.825))
    tall = box((-0.825, -sunk, -0.825), (0.825, 3.30, 0.825))
    scene.place("short block", short, white, translation=(0.909, 0.0, 1.106), rotation=turn_y(-16.6))
    scene.place("tall block", tall, white, translation=(-0.921, 0.0, -0.717), rotation=turn_y(17.2))
    scene.camera("view", eye=(0.0, 2.73, 10.796), target=(0.0, 2.73, 0.0), vertical_fov=39.3, aspect=1.0)
    return scene


def two_rooms():
    """A front room without windows; the back room has a window to the sun and a small bright lamp."""
    scene = Glb("two_rooms")
    plaster = scene.lambert("plaster", (0.78, 0.75, 0.70))
    blue = scene.lambert("blue plaster", (0.35, 0.45, 0.62))
    boards = scene.lambert("boards", (0.42, 0.28, 0.17))
    oak = scene.lambert("oak", (0.55, 0.38, 0.20))
    teal = scene.lambert("teal", (0.08, 0.40, 0.38))
    brick = scene.lambert("brick", (0.55, 0.16, 0.10))
    chalk = scene.lambert("chalk", (0.80, 0.80, 0.80))
    lamp = scene.emitter("lamp", (1.0, 0.84, 0.62), 20000.0)
    wall, height, half, depth = 0.2, 2.6, 2.5, 5.0
    outer, far, sunk = half + wall, -3.4, 0.1
    scene.place("floor", box((-outer, -wall, far), (outer, 0.0, depth + wall)), boards)
    scene.place("ceiling", box((-outer, height, far), (outer, height + wall, depth + wall)), plaster)
    low, high = -sunk, height + sunk
    scene.place("left wall", box((-outer, low, far), (-half, high, depth + wall)), plaster)
    scene.place("right wall", box((half, low, far), (outer, high, depth + wall)), blue)
    scene.place("wall behind the camera", box((-outer + 0.1, low, depth), (outer - 0.1, high, depth + wall)), plaster)
    door = grid_solid([-outer + 0.1, -0.7, 0.8, outer - 0.1], [low, 2.1, high], [-wall, 0.0],
                      lambda i, j, k: not (i == 1 and j == 0))
    scene.place("wall with the doorway", door, plaster)
    window = grid_solid([-outer + 0.1, -0.6, 1.2, outer - 0.1], [low, 0.8, 2.2, high], [far, far + wall],
                        lambda i, j, k: not (i == 1 and j == 1))
    scene.place("wall with the window", window, plaster)
    table = grid_solid([-0.7, -0.62, 0.62, 0.7], [-0.01, 0.68, 0.74], [-0.4, -0.32, 0.32, 0.4],
                       lambda i, j, k: j == 1 or (i != 1 and k != 1))
    scene.place("table", table, oak, translation=(-1.35, 0.0, 1.4), rotation=turn_y(12.0))
    sphere = ball(3)
    scene.place("ball on the table", sphere, brick, translation=(-1.6, 0.897, 1.35), scale=(0.16, 0.16, 0.16))
    column = rounded_column(0.05)
    scene.place("vase", column, teal, translation=(-1.1, 0.897, 1.45), scale=(0.09, 0.16, 0.09))
    scene.place("stool", column, teal, translation=(1.5, 0.23, 1.6), scale=(0.22, 0.24, 0.22))
    scene.place("ball in the back room", sphere, chalk, translation=(0.75, 0.33, -1.6), scale=(0.34, 0.34, 0.34))
    scene.place("cabinet", box((-0.45, -0.01, -0.25), (0.45, 0.95, 0.25)), oak,
                translation=(1.9, 0.0, -1.3), rotation=turn_y(-90.0))
    scene.place("bench", box((-0.8, -0.01, -0.22), (0.8, 0.42, 0.22)), brick,
                translation=(2.1, 0.0, 3.2), rotation=turn_y(90.0))
    scene.place("lamp", ball(2), lamp, translation=(-0.35, 1.75, -1.5), scale=(0.07, 0.07, 0.07))
    scene.sun("sun", towards=(-0.12, -0.42, 1.0), color=(1.0, 0.86, 0.66), lux=10000.0)
    scene.camera("view", eye=(-0.55, 1.5, 4.7), target=(0.05, 1.05, 0.0), vertical_fov=52.0, aspect=16.0 / 9.0)
    scene.camera("back room", eye=(2.2, 1.6, -0.5), target=(-0.6, 0.9, -2.6), vertical_fov=62.0, aspect=16.0 / 9.0)
    return scene


def instances():
    """Four shapes placed 420 times: turned, squeezed, some mirrored, most of them by EXT_mesh_gpu_instancing."""
    scene = Glb("instances")
    numbers = random.Random(20260)
    shapes = [ball(2), torus(1.0, 0.4, 32, 16), rounded_column(0.25), crystal()]
    colors = [("ochre", (0.65, 0.42, 0.10)), ("slate", (0.20, 0.28, 0.40)), ("chalk", (0.75, 0.74, 0.70))]
    paints = [scene.lambert(name, color) for name, color in colors]
    ground = scene.lambert("ground", (0.42, 0.40, 0.36))
    scene.place("ground", box((-9.0, -0.4, -9.0), (9.0, 0.0, 9.0)), ground)
    meshes = [scene.mesh(f"shape {s} {colors[p][0]}", shapes[s], [paints[p]])
              for s in range(len(shapes)) for p in range(len(paints))]

    def placement(cell_x, cell_z, spacing, mirrored):
        size = numbers.uniform(0.14, 0.34)
        scale = [size * numbers.uniform(0.5, 1.4) for _ in range(3)]
        if mirrored:
            scale[numbers.randrange(3)] *= -1.0
        axis = [numbers.uniform(-1.0, 1.0) for _ in range(3)]
        length = math.sqrt(sum(a * a for a in axis)) or 1.0
        angle = numbers.uniform(0.0, math.pi)
        rotation = [math.sin(angle) * a / length for a in axis] + [math.cos(angle)]
        where = ((cell_x + numbers.uniform(-0.2, 0.2)) * spacing, numbers.uniform(0.2, 1.0),
                 (cell_z + numbers.uniform(-0.2, 0.2)) * spacing)
        return where, rotation, scale

    node_count = 0
    group = scene.node("placed by nodes")
    for row in range(-5, 6):
        for column in range(-7, 8):
            where, rotation, scale = placement(column, row + 0.5, 1.0, node_count % 4 == 0)
            scene.node(f"node {node_count}", parent=group, mesh=meshes[node_count % len(meshes)],
                       translation=where, rotation=rotation, scale=scale)
            node_count += 1
    for batch in range(5):
        placements = [placement(column, row + 3 * batch - 7, 1.0, (row + column) % 5 == 0)
                      for row in range(3) for column in range(-8, 9)]
        scene.instanced_node(f"instanced {batch}", meshes[(batch * 5 + 1) % len(meshes)], placements)
    scene.sun("sun", towards=(0.5, -0.8, -0.35), color=(1.0, 0.95, 0.88), lux=60000.0)
    scene.camera("view", eye=(3.0, 3.4, 9.0), target=(0.2, 0.1, 2.2), vertical_fov=36.0, aspect=16.0 / 9.0)
    return scene


def thin_walls():
    """Five panels, 2 mm to 4 cm thick, between a bright corridor and a dark one. All light on the far side."""
    scene = Glb("thin_walls")
    white = scene.lambert("white", (0.70, 0.70, 0.70))
    panel = scene.lambert("panel", (0.55, 0.55, 0.58))
    bright = scene.emitter("bright", (1.0, 1.0, 1.0), 20000.0)
    faint = scene.emitter("faint", (1.0, 0.9, 0.7), 40.0)
    end, wall, height = 2.9, 0.2, 2.0
    back, front = -1.2, 2.6
    scene.place("floor", box((-end - wall, -wall, back - wall), (end + wall, 0.0, front + wall)), white)
    scene.place("ceiling", box((-end - wall, height, back - wall), (end + wall, height + wall, front + wall)), white)
    low, high = -0.1, height + 0.1
    for name, at in (("left end", -end - wall), ("right end", end)):
        scene.place(name, box((at, low, back - wall), (at + wall, high, front + wall)), white)
    for name, at in (("back wall", back - wall), ("front wall", front)):
        scene.place(name, box((-end - 0.1, low, at), (end + 0.1, high, at + wall)), white)
    openings = [-end - 0.1]
    for centre in range(-2, 3):
        openings += [centre * 1.1 - 0.4, centre * 1.1 + 0.4]
    openings.append(end + 0.1)
    frame = grid_solid(openings, [low, 0.4, 1.6, high], [-0.1, 0.0],
                       lambda i, j, k: not (i % 2 == 1 and j == 1))
    scene.place("frame", frame, white)
    for index, centimetres in enumerate((0.2, 0.5, 1.0, 2.0, 4.0)):
        middle, half = (index - 2) * 1.1, centimetres / 200.0
        scene.place(f"panel {centimetres} cm",
                    box((middle - 0.45, 0.35, -0.05 - half), (middle + 0.45, 1.65, -0.05 + half)), panel)
    tube = box((-2.4, 1.70, -0.85), (2.4, 1.78, -0.77))
    scene.place("bright tube", tube, bright)
    scene.place("faint lamp", box((-0.15, 1.75, 1.0), (0.15, 1.80, 1.3)), faint)
    scene.camera("dark side", eye=(0.0, 1.0, 2.5), target=(0.0, 1.0, 0.0), vertical_fov=68.0, aspect=2.0)
    scene.camera("bright side", eye=(-2.7, 1.2, -0.6), target=(0.5, 0.9, -0.1), vertical_fov=68.0, aspect=2.0)
    return scene


def glossy():
    """Metals and coloured plastics, one row each, roughness 0.05 to 1 from left to right."""
    scene = Glb("glossy")
    roughnesses = (0.05, 0.15, 0.3, 0.5, 0.75, 1.0)
    metals = [("gold", (1.0, 0.77, 0.34)), ("copper", (0.96, 0.64, 0.54)), ("steel", (0.56, 0.57, 0.58))]
    plastics = [("red plastic", (0.60, 0.05, 0.04)), ("blue plastic", (0.05, 0.14, 0.55))]
    sphere = ball(4)
    for row, (name, color) in enumerate(plastics + metals):
        for column, roughness in enumerate(roughnesses):
            metallic = 1.0 if (name, color) in metals else 0.0
            paint = scene.material(f"{name} {roughness}", color, metallic, roughness)
            scene.place(f"{name} {roughness}", sphere, paint,
                        translation=((column - 2.5) * 1.05, 0.45, 2.1 - row * 1.05), scale=(0.45, 0.45, 0.45))
    ground = scene.lambert("ground", (0.30, 0.30, 0.31))
    scene.place("ground", box((-6.0, -0.3, -4.0), (6.0, 0.0, 6.0)), ground)
    scene.place("backdrop", box((-6.0, -0.2, -4.3), (6.0, 5.0, -4.0)), ground)
    key = scene.emitter("key light", (1.0, 0.93, 0.84), 9000.0)
    fill = scene.emitter("fill light", (0.60, 0.78, 1.0), 4000.0)
    lamp = lamp_solid((-1.1, -0.05, -0.8), (1.1, 0.05, 0.8), 4)
    back = scene.lambert("lamp housing", (0.1, 0.1, 0.1))
    scene.place("key light", lamp, [key, back], translation=(-2.6, 4.2, 1.6), rotation=(0.0, 0.0, -0.25, 0.968246))
    scene.place("fill light", lamp, [fill, back], translation=(4.4, 3.6, 1.4), rotation=(0.0, 0.0, 0.38, 0.924986))
    scene.camera("view", eye=(0.0, 4.6, 7.6), target=(0.0, 0.25, 0.0), vertical_fov=40.0, aspect=4.0 / 3.0)
    return scene


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit(__doc__)
    stale = []
    for make in (cornell_box, two_rooms, instances, thin_walls, glossy):
        file = HERE / (make.__name__ + ".glb")
        data = make().bytes()
        if not check:
            file.write_bytes(data)
            print(f"{file.name}: {len(data)} bytes")
        elif not file.exists() or file.read_bytes() != data:
            stale.append(file.name)
    if stale:
        sys.exit("differ from what make_assets.py writes: " + ", ".join(stale))


if __name__ == "__main__":
    main()
