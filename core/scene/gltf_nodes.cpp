#include "core/scene/gltf_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "core/scene/gltf_accessors.h"
#include "core/scene/gltf_lights_cameras.h"
#include "core/support/error.h"

namespace core {

namespace {

glm::dquat unit_quaternion(const glm::dvec4& xyzw, const JsonElement& element) {
    const double length = glm::length(xyzw);
    if (!(length > 0.0) || !std::isfinite(length)) element.fail("its rotation must be a unit quaternion");
    return glm::dquat(xyzw.w / length, xyzw.x / length, xyzw.y / length, xyzw.z / length);
}

glm::dmat4 read_matrix(const JsonElement& node, const JsonElement& matrix) {
    if (node.has("translation") || node.has("rotation") || node.has("scale")) {
        node.fail("has a matrix and also translation, rotation or scale; one of them must go");
    }
    const std::vector<double> values = matrix.numbers(16);
    glm::dmat4 result;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) {
            result[column][row] = values[static_cast<std::size_t>(4 * column + row)];
        }
    }
    if (result[0][3] != 0.0 || result[1][3] != 0.0 || result[2][3] != 0.0 || result[3][3] != 1.0) {
        matrix.fail("its last row must be 0, 0, 0, 1");
    }
    return result;
}

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

struct Hierarchy {
    std::vector<std::vector<std::size_t>> children;
    std::vector<std::size_t> parent;  ///< kNone for roots.
};

/// The relations of all nodes, checked to form trees.
Hierarchy read_hierarchy(const GltfDocument& document) {
    const std::size_t count = document.count("nodes");
    Hierarchy result;
    std::vector<std::vector<std::size_t>>& children = result.children;
    std::vector<std::size_t>& parent = result.parent;
    children.resize(count);
    parent.assign(count, kNone);
    for (std::size_t i = 0; i < count; ++i) {
        const JsonElement node = document.element("nodes", i);
        const auto list = node.find("children");
        if (!list) continue;
        for (std::size_t c = 0; c < list->size(); ++c) {
            const std::size_t child = list->at(c).index(count, "nodes");
            if (parent[child] != kNone) {
                node.fail(fmt::format("its child {} is also a child of node {}; a node has one parent", child,
                                      parent[child]));
            }
            parent[child] = i;
            children[i].push_back(child);
        }
    }
    // With one parent each, a node is on a cycle if its ancestors lead back to a node met on the same walk.
    std::vector<std::size_t> walk_of_node(count, kNone);
    for (std::size_t i = 0; i < count; ++i) {
        std::size_t node = i;
        while (node != kNone && walk_of_node[node] == kNone) {
            walk_of_node[node] = i;
            node = parent[node];
        }
        if (node != kNone && walk_of_node[node] == i) {
            document.element("nodes", node).fail("is its own ancestor; nodes must form trees");
        }
    }
    return result;
}

std::vector<Node> read_nodes(GltfDocument& document, const Hierarchy& hierarchy) {
    const std::size_t count = document.count("nodes");
    document.charge_memory(count, sizeof(Node) + sizeof(glm::dmat4), document.root());
    std::vector<Node> nodes(count);
    for (std::size_t i = 0; i < count; ++i) {
        const JsonElement element = document.element("nodes", i);
        Node& node = nodes[i];
        node.name = element.text_or("name", "");
        if (hierarchy.parent[i] != kNone) node.parent = static_cast<std::uint32_t>(hierarchy.parent[i]);
        if (const auto matrix = element.find("matrix")) {
            node.matrix = read_matrix(element, *matrix);
            continue;
        }
        node.translation = element.vec3_or("translation", glm::dvec3(0.0));
        node.rotation = unit_quaternion(element.vec4_or("rotation", glm::dvec4(0.0, 0.0, 0.0, 1.0)), element);
        node.scale = element.vec3_or("scale", glm::dvec3(1.0));
    }
    return nodes;
}

/// The chosen entry of `scenes`, or nothing if the file has none.
std::optional<JsonElement> select_scene(const GltfDocument& document, const std::string& selection) {
    const std::size_t count = document.count("scenes");
    if (selection.empty()) {
        const auto chosen = document.root().find("scene");
        if (chosen) return document.element("scenes", chosen->index(count, "scenes"));
        if (count == 0) return std::nullopt;
        return document.element("scenes", 0);
    }
    std::string names;
    for (std::size_t i = 0; i < count; ++i) {
        const JsonElement scene = document.element("scenes", i);
        const std::string name = scene.text_or("name", "");
        if (name == selection) return scene;
        names += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, name);
    }
    std::size_t index = 0;
    const char* end = selection.data() + selection.size();
    const auto [stop, error] = std::from_chars(selection.data(), end, index);
    if (error == std::errc() && stop == end && index < count) return document.element("scenes", index);
    throw InputError(ErrorKind::kUsage,
                     fmt::format("'{}': there is no scene '{}'; the file has {}", document.file_name(),
                                 selection, names.empty() ? "none" : names));
}

/// The transforms of EXT_mesh_gpu_instancing, relative to the node.
std::vector<glm::dmat4> read_instancing(GltfDocument& document, const JsonElement& extension) {
    const JsonElement attributes = extension.require("attributes");
    const auto open = [&](const char* name, int component_count) -> std::optional<GltfAccessor> {
        const auto index = attributes.find(name);
        if (!index) return std::nullopt;
        GltfAccessor accessor(document, index->index(document.count("accessors"), "accessors"));
        if (accessor.component_count() != component_count) {
            index->fail(fmt::format("its accessor must have {} components", component_count));
        }
        if (!accessor.is_float() && !accessor.is_normalized()) {
            index->fail("its accessor must be float or normalized");
        }
        return accessor;
    };
    const std::optional<GltfAccessor> translation = open("TRANSLATION", 3);
    const std::optional<GltfAccessor> rotation = open("ROTATION", 4);
    const std::optional<GltfAccessor> scale = open("SCALE", 3);
    std::optional<std::size_t> count;
    for (const auto* accessor : {&translation, &rotation, &scale}) {
        if (!*accessor) continue;
        if (count && *count != (*accessor)->count()) attributes.fail("its accessors differ in length");
        count = (*accessor)->count();
    }
    if (!count) attributes.fail("has none of TRANSLATION, ROTATION, SCALE");
    document.charge_memory(*count, sizeof(glm::dmat4), extension);
    std::vector<glm::dmat4> transforms;
    transforms.reserve(*count);
    for (std::size_t i = 0; i < *count; ++i) {
        const glm::dvec4 quaternion =
            rotation ? glm::dvec4(rotation->read(i)) : glm::dvec4(0.0, 0.0, 0.0, 1.0);
        transforms.push_back(compose_transform(
            translation ? glm::dvec3(translation->read(i)) : glm::dvec3(0.0),
            unit_quaternion(quaternion, extension), scale ? glm::dvec3(scale->read(i)) : glm::dvec3(1.0)));
    }
    return transforms;
}

class NodeReader {
public:
    NodeReader(GltfDocument& document, GltfMeshes& meshes, Scene& scene)
        : document_(document), meshes_(meshes), scene_(scene), hierarchy_(read_hierarchy(document)) {
        scene_.nodes = read_nodes(document, hierarchy_);
        world_from_node_ = world_from_nodes(scene_.nodes);
    }

    /// Parents before children, siblings in order. Not recursive: files may be deep.
    void read_tree(std::size_t root) {
        if (hierarchy_.parent[root] != kNone) {
            document_.element("nodes", root)
                .fail(fmt::format("a scene names it as a root, but it is a child of node {}",
                                  hierarchy_.parent[root]));
        }
        std::vector<std::size_t> open = {root};
        while (!open.empty()) {
            const std::size_t index = open.back();
            open.pop_back();
            read_node(document_.element("nodes", index), static_cast<std::uint32_t>(index));
            const std::vector<std::size_t>& children = hierarchy_.children[index];
            open.insert(open.end(), children.rbegin(), children.rend());
        }
    }

private:
    void read_node(const JsonElement& node, std::uint32_t index) {
        const glm::dmat4& world_from_node = world_from_node_[index];
        if (const auto mesh = node.find("mesh")) read_mesh(node, *mesh, index);
        if (const auto camera = node.find("camera")) {
            scene_.cameras.push_back(read_camera(
                document_.element("cameras", camera->index(document_.count("cameras"), "cameras")), node,
                world_from_node));
            scene_.cameras.back().node = index;
        }
        if (const auto light = node.extension("KHR_lights_punctual")) {
            if (auto read = read_light(document_, *light, node, world_from_node)) {
                std::visit([&](auto& placed) { placed.node = index; }, *read);
                scene_.lights.push_back(*std::move(read));
            }
        }
    }

    void read_mesh(const JsonElement& node, const JsonElement& mesh, std::uint32_t index) {
        std::optional<std::vector<double>> weights;
        if (const auto given = node.find("weights")) weights = given->numbers(given->size());
        const GltfMeshes::Placement& placement =
            meshes_.place(mesh.index(document_.count("meshes"), "meshes"), weights ? &*weights : nullptr);
        if (node.has("skin")) {
            document_.warn_once("skins are ignored: skinned meshes stand under their node's transform");
        }
        std::string name = node.text_or("name", "");
        if (name.empty()) name = fmt::format("node_{}", index);
        std::vector<glm::dmat4> node_from_local = {glm::dmat4(1.0)};
        if (const auto extension = node.extension("EXT_mesh_gpu_instancing")) {
            node_from_local = read_instancing(document_, *extension);
        }
        document_.charge_memory(
            node_from_local.size(),
            sizeof(Instance) + name.size() + placement.materials.size() * sizeof(placement.materials.front()),
            node);
        for (const glm::dmat4& transform : node_from_local) {
            try {
                scene_.instances.push_back(make_instance(name, placement.mesh, placement.materials,
                                                         world_from_node_[index] * transform));
            } catch (const InputError& error) {
                throw InputError(error.kind(), fmt::format("{}: {}", node.where(), error.what()));
            }
            scene_.instances.back().node = index;
            scene_.instances.back().node_from_local = transform;
        }
    }

    GltfDocument& document_;
    GltfMeshes& meshes_;
    Scene& scene_;
    Hierarchy hierarchy_;
    std::vector<glm::dmat4> world_from_node_;
};

}  // namespace

void load_nodes(GltfDocument& document, const std::string& selection, GltfMeshes& meshes, Scene& scene) {
    NodeReader reader(document, meshes, scene);
    const std::optional<JsonElement> chosen = select_scene(document, selection);
    if (!chosen) {
        document.warn_once("the file has no scene; there is nothing to see");
        return;
    }
    const auto roots = chosen->find("nodes");
    if (!roots) return;
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < roots->size(); ++i) {
        seen.push_back(roots->at(i).index(document.count("nodes"), "nodes"));
    }
    std::vector<std::size_t> sorted = seen;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
        roots->fail("names a node twice");
    }
    for (const std::size_t root : seen) reader.read_tree(root);
}

}  // namespace core
