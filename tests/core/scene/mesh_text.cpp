#include "tests/core/scene/mesh_text.h"

#include <bit>

namespace tests {

namespace {

void append_u32(std::string& bytes, std::uint32_t value, bool big_endian = false) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> 8 * (big_endian ? 3 - i : i)));
}

void append_float(std::string& bytes, int value, bool big_endian = false) {
    append_u32(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(value)), big_endian);
}

std::string ply_header(const char* format) {
    return fmt::format(
        "ply\nformat {} 1.0\ncomment a cube\nelement vertex 8\nproperty float x\nproperty float y\n"
        "property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n",
        format);
}

}  // namespace

std::string cube_obj() {
    std::string text = "# a cube\n";
    for (const auto& p : kCubeCorners) text += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
    for (const auto& f : kCubeFaces) {
        text += fmt::format("f {} {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1, f[3] + 1);
    }
    return text;
}

std::string cube_ply_text() {
    std::string text = ply_header("ascii");
    for (const auto& p : kCubeCorners) text += fmt::format("{} {} {}\n", p[0], p[1], p[2]);
    for (const auto& f : kCubeFaces) text += fmt::format("4 {} {} {} {}\n", f[0], f[1], f[2], f[3]);
    return text;
}

std::string cube_ply_binary(bool big_endian) {
    std::string bytes = ply_header(big_endian ? "binary_big_endian" : "binary_little_endian");
    for (const auto& p : kCubeCorners) {
        for (const int coordinate : p) append_float(bytes, coordinate, big_endian);
    }
    for (const auto& f : kCubeFaces) {
        bytes.push_back(4);
        for (const int corner : f) append_u32(bytes, static_cast<std::uint32_t>(corner), big_endian);
    }
    return bytes;
}

std::string cube_stl_text() {
    std::string text = "solid cube\n";
    for (const auto& f : kCubeFaces) {
        for (const std::array<int, 3> corners :
             {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
            text += "  facet normal 0 0 0\n    outer loop\n";
            for (const int corner : corners) {
                const auto& p = kCubeCorners[static_cast<std::size_t>(corner)];
                text += fmt::format("      vertex {} {} {}\n", p[0], p[1], p[2]);
            }
            text += "    endloop\n  endfacet\n";
        }
    }
    return text + "endsolid cube\n";
}

std::string cube_stl_binary(const std::string& header) {
    std::string bytes = header;
    bytes.resize(80, ' ');
    append_u32(bytes, 12);
    for (const auto& f : kCubeFaces) {
        for (const std::array<int, 3> corners :
             {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
            for (int i = 0; i < 3; ++i) append_float(bytes, 0);
            for (const int corner : corners) {
                for (const int c : kCubeCorners[static_cast<std::size_t>(corner)]) append_float(bytes, c);
            }
            bytes += std::string(2, '\0');
        }
    }
    return bytes;
}

}  // namespace tests
