"""Closed triangle meshes with outward winding and shared vertices, each checked when it is made."""

import math


class Mesh:
    """Vertices (position and normal) and parts: lists of triangles, one for each material slot."""

    def __init__(self):
        self.positions = []
        self.normals = []
        self.parts = [[]]
        self._known = {}

    def vertex(self, position, normal):
        """Index of a vertex, made at most once for each position and normal."""
        length = math.sqrt(sum(n * n for n in normal))
        rounded = tuple(round(float(p), 6) + 0.0 for p in position)
        unit = tuple(round(n / length, 6) + 0.0 for n in normal)
        index = self._known.setdefault((rounded, unit), len(self.positions))
        if index == len(self.positions):
            self.positions.append(rounded)
            self.normals.append(unit)
        return index

    def triangle(self, a, b, c):
        self.parts[0].append((a, b, c))

    def quad(self, a, b, c, d):
        self.triangle(a, b, c)
        self.triangle(a, c, d)

    def split(self, first):
        """The same solid in two parts: the triangles whose vertex normal satisfies `first`, and the rest."""
        result = Mesh()
        result.positions, result.normals = self.positions, self.normals
        triangles = [t for part in self.parts for t in part]
        result.parts = [[t for t in triangles if first(self.normals[t[0]])],
                        [t for t in triangles if not first(self.normals[t[0]])]]
        assert all(result.parts)
        return result

    def checked(self):
        """Itself, after proof that it is a closed solid whose winding and normals point outwards."""
        edges = {}
        volume = 0.0
        for a, b, c in (t for part in self.parts for t in part):
            pa, pb, pc = (self.positions[i] for i in (a, b, c))
            for edge in ((pa, pb), (pb, pc), (pc, pa)):
                edges[edge] = edges.get(edge, 0) + 1
            face = cross(subtract(pb, pa), subtract(pc, pa))
            volume += dot(pa, face) / 6.0
            for i in (a, b, c):
                assert dot(face, self.normals[i]) > 0.0, "a normal points inwards"
        assert all(count == 1 and edges.get((b, a)) == 1 for (a, b), count in edges.items()), "not closed"
        assert volume > 0.0, "wound inwards"
        return self


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def box(low, high):
    return grid_solid(*([a, b] for a, b in zip(low, high)), lambda i, j, k: True)


def grid_solid(xs, ys, zs, filled):
    """The solid of those cells of a rectangular grid for which filled(i, j, k): walls with openings, tables."""
    mesh = Mesh()
    planes = (xs, ys, zs)
    count = [len(p) - 1 for p in planes]

    def solid(cell):
        return all(0 <= c < n for c, n in zip(cell, count)) and filled(*cell)

    cells = [(i, j, k) for i in range(count[0]) for j in range(count[1]) for k in range(count[2])]
    for cell in filter(solid, cells):
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for side in (0, 1):
                beyond = list(cell)
                beyond[axis] += 2 * side - 1
                if solid(tuple(beyond)):
                    continue
                normal = [0.0, 0.0, 0.0]
                normal[axis] = 2.0 * side - 1.0
                corners = []
                for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    point = [0.0, 0.0, 0.0]
                    point[axis] = planes[axis][cell[axis] + side]
                    point[u] = planes[u][cell[u] + du]
                    point[v] = planes[v][cell[v] + dv]
                    corners.append(mesh.vertex(point, normal))
                mesh.quad(*(corners if side else reversed(corners)))
    return mesh.checked()


def ball(levels):
    """Unit sphere: an icosahedron split `levels` times, smooth normals."""
    golden = (1.0 + math.sqrt(5.0)) / 2.0
    points = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            points += [(a, b, 0.0), (0.0, a, b), (b, 0.0, a)]
    points = [unit(p) for p in points]
    # The faces are the triples of nearest neighbours, turned to face outwards.
    edge = min(distance(points[0], p) for p in points[1:]) * 1.01
    faces = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                a, b, c = points[i], points[j], points[k]
                if max(distance(a, b), distance(b, c), distance(c, a)) < edge:
                    faces.append((a, b, c) if dot(a, cross(b, c)) > 0.0 else (a, c, b))
    for _ in range(levels):
        finer = []
        for a, b, c in faces:
            ab, bc, ca = (unit(tuple(x + y for x, y in zip(p, q))) for p, q in ((a, b), (b, c), (c, a)))
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    mesh = Mesh()
    for face in faces:
        mesh.triangle(*(mesh.vertex(p, p) for p in face))
    return mesh.checked()


def unit(p):
    length = math.sqrt(dot(p, p))
    return tuple(x / length for x in p)


def distance(a, b):
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def torus(major, minor, around, across):
    """A ring in the xz plane, smooth normals."""
    mesh = Mesh()

    def vertex(i, j):
        turn, tilt = 2.0 * math.pi * (i % around) / around, 2.0 * math.pi * (j % across) / across
        out = (math.cos(turn), 0.0, math.sin(turn))
        normal = (out[0] * math.cos(tilt), math.sin(tilt), out[2] * math.cos(tilt))
        return mesh.vertex([major * o + minor * n for o, n in zip(out, normal)], normal)

    for i in range(around):
        for j in range(across):
            mesh.quad(vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j))
    return mesh.checked()


def rounded_column(corner, around=32, steps=6):
    """A cylinder of radius 1 from y = -1 to 1 whose rims are rounded with radius `corner`; smooth normals."""
    arc = [math.pi / 2.0 * s / steps for s in range(steps + 1)]
    # From the rim of the lower cap to the rim of the upper one: (radius, height, normal outwards, normal up).
    profile = [(1.0 - corner + corner * math.sin(a), -1.0 + corner - corner * math.cos(a), math.sin(a), -math.cos(a))
               for a in arc]
    profile += [(r, -y, out, -up) for r, y, out, up in reversed(profile)]
    mesh = Mesh()

    def vertex(i, point):
        turn = 2.0 * math.pi * (i % around) / around
        radius, height, out, up = point
        return mesh.vertex((radius * math.cos(turn), height, radius * math.sin(turn)),
                           (out * math.cos(turn), up, out * math.sin(turn)))

    bottom = mesh.vertex((0.0, -1.0, 0.0), (0.0, -1.0, 0.0))
    top = mesh.vertex((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
    for i in range(around):
        mesh.triangle(bottom, vertex(i, profile[0]), vertex(i + 1, profile[0]))
        for low, high in zip(profile, profile[1:]):
            mesh.quad(vertex(i, low), vertex(i, high), vertex(i + 1, high), vertex(i + 1, low))
        mesh.triangle(top, vertex(i + 1, profile[-1]), vertex(i, profile[-1]))
    return mesh.checked()


def crystal():
    """A flat-shaded double pyramid over a hexagon."""
    mesh = Mesh()
    ring = [(0.6 * math.cos(math.pi * i / 3.0), 0.0, 0.6 * math.sin(math.pi * i / 3.0)) for i in range(6)]
    for i in range(6):
        for tip in (-1.0, 1.0):
            a, b, c = ring[i], ring[(i + 1) % 6], (0.0, tip, 0.0)
            face = (a, b, c) if tip < 0.0 else (b, a, c)
            normal = cross(subtract(face[1], face[0]), subtract(face[2], face[0]))
            mesh.triangle(*(mesh.vertex(p, normal) for p in face))
    return mesh.checked()
