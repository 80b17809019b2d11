#include "tests/core/scene/gltf_builder.h"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace tests {

namespace {

void append_big_endian(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

void append_little_endian(std::string& text, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) text.push_back(static_cast<char>(value >> shift));
}

std::uint32_t crc32(const std::vector<std::uint8_t>& bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) ? 0xedb88320u : 0u);
    }
    return ~crc;
}

void append_png_chunk(std::vector<std::uint8_t>& png, const char* type,
                      const std::vector<std::uint8_t>& data) {
    std::vector<std::uint8_t> checked(type, type + 4);
    checked.insert(checked.end(), data.begin(), data.end());
    append_big_endian(png, static_cast<std::uint32_t>(data.size()));
    png.insert(png.end(), checked.begin(), checked.end());
    append_big_endian(png, crc32(checked));
}

/// A zlib stream of one stored block. @pre fewer than 2^16 bytes
std::vector<std::uint8_t> zlib_stored(const std::vector<std::uint8_t>& data) {
    const auto size = static_cast<std::uint16_t>(data.size());
    const auto inverse = static_cast<std::uint16_t>(~size);
    std::vector<std::uint8_t> stream = {0x78,
                                        0x01,
                                        0x01,
                                        static_cast<std::uint8_t>(size),
                                        static_cast<std::uint8_t>(size >> 8),
                                        static_cast<std::uint8_t>(inverse),
                                        static_cast<std::uint8_t>(inverse >> 8)};
    stream.insert(stream.end(), data.begin(), data.end());
    std::uint32_t a = 1;
    std::uint32_t b = 0;
    for (const std::uint8_t byte : data) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    append_big_endian(stream, b << 16 | a);
    return stream;
}

std::string join(const std::vector<std::string>& items) {
    return fmt::format("{}", fmt::join(items, ","));
}

std::string with_kind(const core::InputError& error) {
    return fmt::format("{} (kind {})", error.what(), static_cast<int>(error.kind()));
}

}  // namespace

std::vector<std::uint8_t> encode_png(int width, int height, const std::vector<std::uint8_t>& rgba) {
    std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    std::vector<std::uint8_t> header;
    append_big_endian(header, static_cast<std::uint32_t>(width));
    append_big_endian(header, static_cast<std::uint32_t>(height));
    header.insert(header.end(), {8, 6, 0, 0, 0});
    append_png_chunk(png, "IHDR", header);
    std::vector<std::uint8_t> rows;
    for (int y = 0; y < height; ++y) {
        rows.push_back(0);
        rows.insert(rows.end(), rgba.begin() + 4 * width * y, rgba.begin() + 4 * width * (y + 1));
    }
    append_png_chunk(png, "IDAT", zlib_stored(rows));
    append_png_chunk(png, "IEND", {});
    return png;
}

std::string encode_base64(const std::vector<std::uint8_t>& bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = static_cast<std::uint32_t>(bytes[i]) << 16;
        if (i + 1 < bytes.size()) group |= static_cast<std::uint32_t>(bytes[i + 1]) << 8;
        if (i + 2 < bytes.size()) group |= bytes[i + 2];
        text += kDigits[group >> 18];
        text += kDigits[group >> 12 & 63];
        text += i + 1 < bytes.size() ? kDigits[group >> 6 & 63] : '=';
        text += i + 2 < bytes.size() ? kDigits[group & 63] : '=';
    }
    return text;
}

int GltfBuilder::add_bytes(const void* data, std::size_t size, int stride) {
    while (bytes_.size() % 4 != 0) bytes_.push_back(0);
    const std::size_t offset = bytes_.size();
    const auto* first = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
    return add("bufferViews",
               fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}{}}})", offset, size,
                           stride > 0 ? fmt::format(R"(,"byteStride":{})", stride) : std::string()));
}

int GltfBuilder::add_accessor(int view, Component component, std::size_t count, const std::string& type,
                              const std::string& extra) {
    return add("accessors",
               fmt::format(R"({{"bufferView":{},"componentType":{},"count":{},"type":"{}"{}{}}})", view,
                           static_cast<int>(component), count, type, extra.empty() ? "" : ",", extra));
}

int GltfBuilder::add_floats(const std::string& type, const std::vector<float>& values) {
    const std::map<std::string, std::size_t> components = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    return add_accessor(add_view(values), kFloat, values.size() / components.at(type), type);
}

int GltfBuilder::add_indices(const std::vector<std::uint16_t>& values) {
    return add_accessor(add_view(values), kUnsignedShort, values.size(), "SCALAR");
}

int GltfBuilder::add(const std::string& array, const std::string& object) {
    arrays_[array].push_back(object);
    return static_cast<int>(arrays_[array].size()) - 1;
}

int GltfBuilder::add_mesh(const std::string& primitive) {
    return add("meshes", fmt::format(R"({{"primitives":[{}]}})", primitive));
}

int GltfBuilder::add_triangle_mesh(const std::string& extra) {
    const int position = add_floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int normal = add_floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
    return add_mesh(fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}}{}{}}})", position, normal,
                                extra.empty() ? "" : ",", extra));
}

int GltfBuilder::add_texture(int width, int height, const std::vector<std::uint8_t>& rgba,
                             const std::string& sampler) {
    const int view = add_view(encode_png(width, height, rgba));
    const int image = add("images", fmt::format(R"({{"bufferView":{},"mimeType":"image/png"}})", view));
    if (sampler.empty()) return add("textures", fmt::format(R"({{"source":{}}})", image));
    return add("textures", fmt::format(R"({{"source":{},"sampler":{}}})", image, add("samplers", sampler)));
}

std::string GltfBuilder::json(const std::string& buffer_uri) const {
    std::vector<std::string> members = {R"("asset":{"version":"2.0"})"};
    for (const auto& [key, value] : members_) members.push_back(fmt::format(R"("{}":{})", key, value));
    for (const auto& [key, objects] : arrays_) {
        if (key == "buffers") continue;
        members.push_back(fmt::format(R"("{}":[{}])", key, join(objects)));
    }
    if (!arrays_.contains("scenes")) {
        std::vector<std::string> roots;
        const auto nodes = arrays_.find("nodes");
        for (std::size_t i = 0; nodes != arrays_.end() && i < nodes->second.size(); ++i) {
            roots.push_back(std::to_string(i));
        }
        members.push_back(fmt::format(R"("scenes":[{{"nodes":[{}]}}])", join(roots)));
    }
    if (!bytes_.empty()) {
        const std::string uri = !buffer_uri.empty()
                                    ? buffer_uri
                                    : "data:application/octet-stream;base64," + encode_base64(bytes_);
        const std::string member = uri == "-" ? std::string() : fmt::format(R"("uri":"{}",)", uri);
        std::vector<std::string> buffers = {fmt::format(R"({{{}"byteLength":{}}})", member, bytes_.size())};
        const auto more = arrays_.find("buffers");
        if (more != arrays_.end()) buffers.insert(buffers.end(), more->second.begin(), more->second.end());
        members.push_back(fmt::format(R"("buffers":[{}])", join(buffers)));
    }
    return fmt::format("{{{}}}", join(members));
}

std::string GltfBuilder::glb() const {
    std::string text = json("-");
    while (text.size() % 4 != 0) text.push_back(' ');
    std::string binary(bytes_.begin(), bytes_.end());
    while (binary.size() % 4 != 0) binary.push_back('\0');
    std::string file = "glTF";
    append_little_endian(file, 2);
    append_little_endian(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
    append_little_endian(file, static_cast<std::uint32_t>(text.size()));
    file += "JSON" + text;
    append_little_endian(file, static_cast<std::uint32_t>(binary.size()));
    file += std::string("BIN\0", 4) + binary;
    return file;
}

core::Scene GltfBuilder::load(const core::LoadOptions& options) const {
    return load_text(json(), options);
}

std::string GltfBuilder::error(const core::LoadOptions& options) const {
    return error_of_text(json(), options);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

core::Scene load_text(const std::string& text, const core::LoadOptions& options, const std::string& name) {
    const TemporaryFolder folder;
    write_text(folder.path() / name, text);
    return core::load_gltf(folder.path() / name, options);
}

std::string error_of_text(const std::string& text, const core::LoadOptions& options,
                          const std::string& name) {
    try {
        load_text(text, options, name);
    } catch (const core::InputError& error) {
        return with_kind(error);
    }
    return "no error";
}

}  // namespace tests
