#include "tests/support/analytic_scenes.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <map>
#include <utility>

namespace tests {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct IcosphereShape {
    std::vector<glm::dvec3> vertices;  ///< On the unit sphere.
    std::vector<glm::uvec3> triangles;
};

IcosphereShape subdivided_icosahedron(int level) {
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    IcosphereShape shape;
    for (const double a : {-1.0, 1.0}) {
        for (const double b : {-g, g}) {
            shape.vertices.push_back(glm::normalize(glm::dvec3(0, a, b)));
            shape.vertices.push_back(glm::normalize(glm::dvec3(a, b, 0)));
            shape.vertices.push_back(glm::normalize(glm::dvec3(b, 0, a)));
        }
    }
    // The faces are the vertex triples at the edge length; brute force spares a table to get wrong.
    const double edge = 2.0 / std::sqrt(1.0 + g * g);
    const auto adjacent = [&](unsigned i, unsigned j) {
        return std::abs(glm::distance(shape.vertices[i], shape.vertices[j]) - edge) < 1e-9;
    };
    for (unsigned i = 0; i < 12; ++i) {
        for (unsigned j = i + 1; j < 12; ++j) {
            for (unsigned k = j + 1; k < 12; ++k) {
                if (!adjacent(i, j) || !adjacent(j, k) || !adjacent(i, k)) continue;
                const glm::dvec3 &a = shape.vertices[i], &b = shape.vertices[j], &c = shape.vertices[k];
                const bool outwards = glm::dot(glm::cross(b - a, c - a), a + b + c) > 0.0;
                shape.triangles.push_back(outwards ? glm::uvec3(i, j, k) : glm::uvec3(i, k, j));
            }
        }
    }
    for (int step = 0; step < level; ++step) {
        std::map<std::pair<unsigned, unsigned>, unsigned> midpoints;
        const auto midpoint = [&](unsigned i, unsigned j) {
            const auto [entry, is_new] = midpoints.try_emplace(std::minmax(i, j), shape.vertices.size());
            if (is_new) shape.vertices.push_back(glm::normalize(shape.vertices[i] + shape.vertices[j]));
            return entry->second;
        };
        std::vector<glm::uvec3> finer;
        finer.reserve(shape.triangles.size() * 4);
        for (const glm::uvec3& t : shape.triangles) {
            const unsigned ab = midpoint(t.x, t.y), bc = midpoint(t.y, t.z), ca = midpoint(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
        }
        shape.triangles = std::move(finer);
    }
    return shape;
}

/// Grows a mesh by quadrilaterals with one normal each.
struct FlatBuilder {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs;
    std::vector<glm::uvec3> triangles;

    void add_quad(const glm::vec3& corner, const glm::vec3& edge_u, const glm::vec3& edge_v) {
        const auto first = static_cast<unsigned>(positions.size());
        const glm::vec3 normal = glm::normalize(glm::cross(edge_u, edge_v));
        for (const glm::vec2 uv : {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(1, 1), glm::vec2(0, 1)}) {
            positions.push_back(corner + uv.x * edge_u + uv.y * edge_v);
            normals.push_back(normal);
            uvs.push_back(uv);
        }
        triangles.emplace_back(first, first + 1, first + 2);
        triangles.emplace_back(first, first + 2, first + 3);
    }
};

}  // namespace

core::Mesh make_mesh(std::string name, std::vector<glm::vec3> positions, std::vector<glm::vec3> normals,
                     std::vector<glm::vec2> uvs, std::vector<glm::uvec3> triangles) {
    core::Mesh mesh;
    mesh.name = std::move(name);
    mesh.positions = std::move(positions);
    mesh.normals = std::move(normals);
    mesh.uvs[0] = std::move(uvs);
    mesh.triangles = std::move(triangles);
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.triangles.size())}};
    mesh.part_of_triangle.assign(mesh.triangles.size(), 0);
    for (const glm::uvec3& triangle : mesh.triangles) {
        for (int corner = 0; corner < 3; ++corner) mesh.bounds.include(mesh.positions[triangle[corner]]);
    }
    return mesh;
}

core::Mesh icosphere(int level, float radius) {
    const IcosphereShape shape = subdivided_icosahedron(level);
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs;
    for (const glm::dvec3& vertex : shape.vertices) {
        positions.emplace_back(vertex * double(radius));
        normals.emplace_back(vertex);
        uvs.emplace_back(0.5 * (1.0 + vertex.x), 0.5 * (1.0 + vertex.y));
    }
    return make_mesh("icosphere", std::move(positions), std::move(normals), std::move(uvs), shape.triangles);
}

double icosphere_inner_radius(int level, double radius) {
    const IcosphereShape shape = subdivided_icosahedron(level);
    double least = 1.0;
    for (const glm::uvec3& t : shape.triangles) {
        const glm::dvec3& a = shape.vertices[t.x];
        const glm::dvec3 n = glm::normalize(glm::cross(shape.vertices[t.y] - a, shape.vertices[t.z] - a));
        least = std::min(least, glm::dot(n, a));
    }
    return least * radius;
}

core::Mesh box(const glm::vec3& half_extent) {
    FlatBuilder builder;
    for (int axis = 0; axis < 3; ++axis) {
        for (const float side : {-1.0f, 1.0f}) {
            // u x v points along +axis; swapping them makes the opposite face wind outwards too.
            glm::vec3 u(0.0f), v(0.0f), corner = -half_extent;
            u[(axis + 1) % 3] = 2.0f * half_extent[(axis + 1) % 3];
            v[(axis + 2) % 3] = 2.0f * half_extent[(axis + 2) % 3];
            corner[axis] = side * half_extent[axis];
            if (side > 0.0f) {
                builder.add_quad(corner, u, v);
            } else {
                builder.add_quad(corner, v, u);
            }
        }
    }
    return make_mesh("box", std::move(builder.positions), std::move(builder.normals), std::move(builder.uvs),
                     std::move(builder.triangles));
}

core::Mesh quad(float width, float height, int columns, int rows) {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs;
    std::vector<glm::uvec3> triangles;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            const glm::vec2 uv(float(column) / float(columns), float(row) / float(rows));
            positions.emplace_back((uv.x - 0.5f) * width, (uv.y - 0.5f) * height, 0.0f);
            normals.emplace_back(0.0f, 0.0f, 1.0f);
            uvs.push_back(uv);
        }
    }
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const auto first = static_cast<unsigned>(row * (columns + 1) + column);
            const unsigned above = first + static_cast<unsigned>(columns) + 1;
            triangles.emplace_back(first, first + 1, above + 1);
            triangles.emplace_back(first, above + 1, above);
        }
    }
    return make_mesh("quad", std::move(positions), std::move(normals), std::move(uvs), std::move(triangles));
}

core::Mesh cylinder(float radius, float height, int segments) {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs;
    std::vector<glm::uvec3> triangles;
    const auto count = static_cast<unsigned>(segments);
    const auto rim = [&](unsigned i) {
        const double angle = 2.0 * kPi * double(i % count) / double(count);
        return glm::dvec2(std::cos(angle), std::sin(angle));
    };
    // The side, with one more column so that uv need not wrap.
    for (unsigned i = 0; i <= count; ++i) {
        for (const float v : {0.0f, 1.0f}) {
            const glm::dvec2 p = rim(i);
            positions.emplace_back(p.x * radius, (v - 0.5) * height, p.y * radius);
            normals.emplace_back(p.x, 0.0, p.y);
            uvs.emplace_back(float(i) / float(count), v);
        }
    }
    for (unsigned i = 0; i < count; ++i) {
        const unsigned low = 2 * i, high = low + 1;
        triangles.emplace_back(low, high, high + 2);
        triangles.emplace_back(low, high + 2, low + 2);
    }
    for (const float side : {-1.0f, 1.0f}) {
        const auto center = static_cast<unsigned>(positions.size());
        positions.emplace_back(0.0f, 0.5f * side * height, 0.0f);
        normals.emplace_back(0.0f, side, 0.0f);
        uvs.emplace_back(0.5f, 0.5f);
        for (unsigned i = 0; i < count; ++i) {
            const glm::dvec2 p = rim(i);
            positions.emplace_back(p.x * radius, 0.5 * side * height, p.y * radius);
            normals.emplace_back(0.0f, side, 0.0f);
            uvs.emplace_back(0.5 + 0.5 * p.x, 0.5 + 0.5 * p.y);
            const unsigned here = center + 1 + i, next = center + 1 + (i + 1) % count;
            triangles.push_back(side > 0.0f ? glm::uvec3(center, next, here)
                                            : glm::uvec3(center, here, next));
        }
    }
    return make_mesh("cylinder", std::move(positions), std::move(normals), std::move(uvs),
                     std::move(triangles));
}

core::Mesh torus(float major_radius, float minor_radius, int major_segments, int minor_segments) {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs;
    std::vector<glm::uvec3> triangles;
    const auto columns = static_cast<unsigned>(major_segments), rows = static_cast<unsigned>(minor_segments);
    for (unsigned i = 0; i <= columns; ++i) {
        for (unsigned j = 0; j <= rows; ++j) {
            const double a = 2.0 * kPi * double(i % columns) / columns;
            const double b = 2.0 * kPi * double(j % rows) / rows;
            const glm::dvec3 normal(std::cos(a) * std::cos(b), std::sin(b), std::sin(a) * std::cos(b));
            const glm::dvec3 center(std::cos(a) * major_radius, 0.0, std::sin(a) * major_radius);
            positions.emplace_back(center + normal * double(minor_radius));
            normals.emplace_back(normal);
            uvs.emplace_back(float(i) / float(columns), float(j) / float(rows));
        }
    }
    for (unsigned i = 0; i < columns; ++i) {
        for (unsigned j = 0; j < rows; ++j) {
            const unsigned here = i * (rows + 1) + j, next = here + rows + 1;
            triangles.emplace_back(here, here + 1, next + 1);
            triangles.emplace_back(here, next + 1, next);
        }
    }
    return make_mesh("torus", std::move(positions), std::move(normals), std::move(uvs), std::move(triangles));
}

core::Mesh reversed(core::Mesh mesh) {
    for (glm::uvec3& triangle : mesh.triangles) std::swap(triangle.y, triangle.z);
    for (glm::vec3& normal : mesh.normals) normal = -normal;
    return mesh;
}

core::Mesh merged(core::Mesh first, const core::Mesh& second) {
    const auto vertex_base = static_cast<unsigned>(first.positions.size());
    const auto triangle_base = static_cast<std::uint32_t>(first.triangles.size());
    const auto part_base = static_cast<std::uint32_t>(first.parts.size());
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(first.positions, second.positions);
    append(first.normals, second.normals);
    append(first.uvs[0], second.uvs[0]);
    for (const glm::uvec3& triangle : second.triangles) first.triangles.push_back(triangle + vertex_base);
    for (const core::MeshPart& part : second.parts) {
        first.parts.push_back({triangle_base + part.first_triangle, part.triangle_count});
    }
    for (const std::uint32_t part : second.part_of_triangle)
        first.part_of_triangle.push_back(part_base + part);
    first.bounds.include(second.bounds);
    return first;
}

core::Mesh moved(core::Mesh mesh, const glm::dmat4& matrix) {
    const glm::dmat3 linear(matrix);
    const glm::dmat3 cofactor = glm::determinant(linear) * glm::transpose(glm::inverse(linear));
    const bool mirrors = glm::determinant(linear) < 0.0;
    mesh.bounds = core::Bounds();
    for (glm::vec3& position : mesh.positions)
        position = glm::vec3(matrix * glm::dvec4(glm::dvec3(position), 1.0));
    for (glm::vec3& normal : mesh.normals) {
        normal = glm::vec3(glm::normalize(cofactor * glm::dvec3(normal)) * (mirrors ? -1.0 : 1.0));
    }
    for (glm::uvec3& triangle : mesh.triangles) {
        if (mirrors) std::swap(triangle.y, triangle.z);
        for (int corner = 0; corner < 3; ++corner) mesh.bounds.include(mesh.positions[triangle[corner]]);
    }
    return mesh;
}

core::Material lambert(const glm::vec3& albedo) {
    core::Material material;
    material.name = "lambert";
    material.base_color = glm::vec4(albedo, 1.0f);
    material.metallic = 0.0f;
    material.specular = 0.0f;
    return material;
}

std::uint32_t add_mesh(core::Scene& scene, core::Mesh mesh) {
    scene.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(scene.meshes.size() - 1);
}

std::uint32_t add_material(core::Scene& scene, core::Material material) {
    scene.materials.push_back(std::move(material));
    return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

std::uint32_t add_instance(core::Scene& scene, std::uint32_t mesh, const glm::dmat4& world_from_local,
                           std::uint32_t material) {
    const auto index = static_cast<std::uint32_t>(scene.instances.size());
    std::vector<std::uint32_t> materials(scene.meshes[mesh].parts.size(), material);
    scene.instances.push_back(core::make_instance("instance " + std::to_string(index), mesh,
                                                  std::move(materials), world_from_local));
    return index;
}

int add_texture(core::Scene& scene, int width, int height, const std::vector<glm::u8vec4>& texels) {
    core::TextureImage image;
    image.name = "test texture";
    image.width = width;
    image.height = height;
    for (const glm::u8vec4& texel : texels) {
        image.rgba.insert(image.rgba.end(), {texel.r, texel.g, texel.b, texel.a});
    }
    core::Texture texture;
    texture.image = static_cast<std::uint32_t>(scene.images.size());
    texture.wrap_u = texture.wrap_v = core::TextureWrap::kClampToEdge;
    texture.nearest = true;
    scene.images.push_back(std::move(image));
    scene.textures.push_back(texture);
    return static_cast<int>(scene.textures.size() - 1);
}

core::Scene scene_of(core::Mesh mesh, const glm::dmat4& world_from_local) {
    core::Scene scene;
    scene.name = "analytic scene";
    add_material(scene, lambert(glm::vec3(0.5f)));
    add_instance(scene, add_mesh(scene, std::move(mesh)), world_from_local);
    return scene;
}

glm::dmat4 translation(const glm::dvec3& offset) {
    return glm::translate(glm::dmat4(1.0), offset);
}
glm::dmat4 scaling(const glm::dvec3& factors) {
    return glm::scale(glm::dmat4(1.0), factors);
}
glm::dmat4 rotation(double angle, const glm::dvec3& axis) {
    return glm::rotate(glm::dmat4(1.0), angle, axis);
}

glm::dvec3 TestRandom::direction() {
    const double z = uniform(-1.0, 1.0), angle = 2.0 * kPi * uniform();
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
}

glm::dvec3 TestRandom::cosine_direction(const glm::dvec3& normal) {
    // A point of the unit sphere that touches the surface at its south pole, normalised, is cosine-weighted.
    for (;;) {
        const glm::dvec3 sum = normal + direction();
        if (glm::length(sum) > 1e-3) return glm::normalize(sum);
    }
}

core::Ray make_ray(const glm::dvec3& origin, const glm::dvec3& direction, float t_max, std::uint32_t seed) {
    return {glm::vec3(origin), 0.0f, glm::vec3(glm::normalize(direction)), t_max, seed};
}

core::RayStream stream_of(const std::vector<core::Ray>& rays) {
    core::RayStream stream;
    stream.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) stream.set(i, rays[i]);
    return stream;
}

core::RayStream random_lines(const glm::dvec3& center, double radius, std::size_t count, std::uint32_t seed) {
    TestRandom random(seed);
    core::RayStream stream;
    stream.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 d = random.direction();
        const glm::dvec3 helper = std::abs(d.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 u = glm::normalize(glm::cross(d, helper)), v = glm::cross(d, u);
        const double r = radius * std::sqrt(random.uniform()), angle = 2.0 * kPi * random.uniform();
        const glm::dvec3 origin = center - radius * d + r * (std::cos(angle) * u + std::sin(angle) * v);
        stream.set(i, make_ray(origin, d, std::numeric_limits<float>::infinity(), random.bits()));
    }
    return stream;
}

}  // namespace tests
