// tests/core/scene/gltf_builder.h: small glTF files made in a test.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/scene/gltf_loader.h"

namespace tests {

/// Collects bytes and JSON snippets and writes them as one file whose buffer is a data URI.
class GltfBuilder {
public:
    enum Component { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

    /// Appends bytes, aligned to 4, as a new buffer view. Returns its index.
    template <typename T>
    int add_view(const std::vector<T>& values, int stride = 0) {
        return add_bytes(values.data(), values.size() * sizeof(T), stride);
    }
    /// @param extra more JSON members, such as `"normalized":true`.
    int add_accessor(int view, Component component, std::size_t count, const std::string& type,
                     const std::string& extra = "");

    /// A view and an accessor in one.
    int add_floats(const std::string& type, const std::vector<float>& values);
    int add_indices(const std::vector<std::uint16_t>& values);

    /// Appends an object to a top-level array ("nodes", "meshes", ...) and returns its index there. "buffers"
    /// come after the builder's own.
    int add(const std::string& array, const std::string& object);
    /// Sets a top-level member other than those arrays.
    void set(const std::string& key, const std::string& json) { members_[key] = json; }

    /// A triangle (0,0,0), (1,0,0), (0,1,0) with the normal +Z as a mesh; `extra` goes into its primitive.
    int add_triangle_mesh(const std::string& extra = "");
    /// A mesh of one primitive.
    int add_mesh(const std::string& primitive);
    /// An image from RGBA texels, as a PNG in a buffer view, with a texture. Returns the texture.
    int add_texture(int width, int height, const std::vector<std::uint8_t>& rgba,
                    const std::string& sampler = "");

    const std::vector<std::uint8_t>& bytes() const { return bytes_; }
    /// The file's JSON; without scenes, one with all nodes as roots is added.
    /// @param buffer_uri instead of a data URI; "-" leaves the URI out.
    std::string json(const std::string& buffer_uri = "") const;
    std::string glb() const;

    /// Writes the JSON into a folder of its own and loads it.
    core::Scene load(const core::LoadOptions& options = {}) const;
    /// The message and the kind of the InputError that loading ends in; "no error" if there is none.
    std::string error(const core::LoadOptions& options = {}) const;

private:
    int add_bytes(const void* data, std::size_t size, int stride);

    std::vector<std::uint8_t> bytes_;
    std::map<std::string, std::vector<std::string>> arrays_;
    std::map<std::string, std::string> members_;
};

/// Writes text as `name` into a fresh folder and loads it from there.
core::Scene load_text(const std::string& text, const core::LoadOptions& options = {},
                      const std::string& name = "test.gltf");
std::string error_of_text(const std::string& text, const core::LoadOptions& options = {},
                          const std::string& name = "test.gltf");

void write_text(const std::filesystem::path& path, const std::string& text);

/// An uncompressed 8-bit RGBA PNG.
std::vector<std::uint8_t> encode_png(int width, int height, const std::vector<std::uint8_t>& rgba);

std::string encode_base64(const std::vector<std::uint8_t>& bytes);

}  // namespace tests
