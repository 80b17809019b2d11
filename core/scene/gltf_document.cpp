#include "core/scene/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "core/scene/gltf_uri.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67;     // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004e4942;  // "BIN"
constexpr std::size_t kGlbHeaderSize = 12;
constexpr std::size_t kChunkHeaderSize = 8;

/// What decoded geometry may take: generous for real files, whose attributes grow at most some twenty-fold.
constexpr std::uint64_t kMemoryAllowance = std::uint64_t{256} << 20;
constexpr std::uint64_t kMemoryPerFileByte = 64;

constexpr std::array<std::string_view, 8> kSupportedExtensions = {
    "EXT_mesh_gpu_instancing", "KHR_lights_punctual",    "KHR_materials_emissive_strength",
    "KHR_materials_ior",       "KHR_materials_specular", "KHR_materials_unlit",
    "KHR_mesh_quantization",   "KHR_texture_transform"};

/// Known extensions that are left out of the picture, and what the picture loses.
struct LostExtension {
    std::string_view name;
    std::string_view loss;
};
constexpr LostExtension kLostExtensions[] = {
    {"EXT_meshopt_compression", "compressed buffers are not decoded; their fallbacks are used"},
    {"EXT_texture_avif", "AVIF images are not decoded; their fallbacks are used"},
    {"EXT_texture_webp", "WebP images are not decoded; their fallbacks are used"},
    {"KHR_animation_pointer", "animated properties stand still"},
    {"KHR_draco_mesh_compression", "compressed meshes are not decoded; their fallbacks are used"},
    {"KHR_materials_anisotropy", "brushed surfaces reflect alike in all directions"},
    {"KHR_materials_clearcoat", "clear coats are missing"},
    {"KHR_materials_diffuse_transmission", "light does not pass through thin diffuse surfaces"},
    {"KHR_materials_dispersion", "glass does not split colours"},
    {"KHR_materials_iridescence", "thin-film colours are missing"},
    {"KHR_materials_pbrSpecularGlossiness", "those materials show their metallic-roughness fallback"},
    {"KHR_materials_sheen", "the sheen of cloth is missing"},
    {"KHR_materials_transmission", "transparent materials are opaque"},
    {"KHR_materials_variants", "the default variant is shown"},
    {"KHR_materials_volume", "absorption and refraction within volumes are missing"},
    {"KHR_node_visibility", "hidden nodes are shown"},
    {"KHR_texture_basisu", "Basis Universal images are not decoded; their fallbacks are used"},
};

std::uint32_t read_u32(std::span<const std::uint8_t> bytes, std::size_t offset) {
    return static_cast<std::uint32_t>(bytes[offset]) | static_cast<std::uint32_t>(bytes[offset + 1]) << 8 |
           static_cast<std::uint32_t>(bytes[offset + 2]) << 16 |
           static_cast<std::uint32_t>(bytes[offset + 3]) << 24;
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& path, bool allow_external)
    : path_(path), file_name_(path.filename().string()), allow_external_(allow_external) {
    std::vector<std::uint8_t> file = read_whole_file(path, fmt::format("scene '{}'", file_name_));
    const std::size_t file_size = file.size();
    const std::string text = read_json_text(file);
    json_ = std::make_unique<nlohmann::json>(parse_limited_json(text, file_name_));
    check_asset();
    check_extensions();
    load_buffers(std::move(binary_chunk_));
    std::uint64_t byte_count = file_size;
    for (const auto& buffer : buffers_) byte_count += buffer.size();
    memory_limit_ = kMemoryAllowance + kMemoryPerFileByte * byte_count;
}

GltfDocument::~GltfDocument() = default;

JsonElement GltfDocument::root() const {
    return JsonElement(*json_, file_name_);
}

std::size_t GltfDocument::count(const char* array) const {
    const auto elements = root().find(array);
    return elements ? elements->size() : 0;
}

JsonElement GltfDocument::element(const char* array, std::size_t index) const {
    return root().require(array).at(index);
}

std::string GltfDocument::read_json_text(std::vector<std::uint8_t>& file) {
    if (file.size() < 4 || read_u32(file, 0) != kGlbMagic) {
        return {reinterpret_cast<const char*>(file.data()), file.size()};
    }
    const auto refuse = [&](const std::string& reason) {
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': GLB {}", file_name_, reason));
    };
    if (file.size() < kGlbHeaderSize) refuse("ends within its header of 12 bytes");
    const std::uint32_t version = read_u32(file, 4);
    const std::uint32_t length = read_u32(file, 8);
    if (version != 2) refuse(fmt::format("version is {}; 2 is read", version));
    if (length > file.size()) {
        refuse(fmt::format("is cut short: {} bytes of the {} in its header", file.size(), length));
    }
    if (length < file.size()) {
        warn_once(fmt::format("{} bytes after the end of the GLB are ignored", file.size() - length));
    }
    std::string text;
    bool has_json = false;
    for (std::size_t offset = kGlbHeaderSize; offset < length;) {
        if (length - offset < kChunkHeaderSize) refuse("ends within a chunk's header");
        const std::size_t chunk_length = read_u32(file, offset);
        const std::uint32_t type = read_u32(file, offset + 4);
        offset += kChunkHeaderSize;
        if (chunk_length > length - offset) {
            refuse(fmt::format("chunk at byte {} claims {} bytes, but {} are left", offset, chunk_length,
                               length - offset));
        }
        if (!has_json && type != kJsonChunk) refuse("does not begin with a JSON chunk");
        const std::uint8_t* chunk = file.data() + offset;
        if (type == kJsonChunk) {
            if (has_json) refuse("has two JSON chunks");
            text.assign(reinterpret_cast<const char*>(chunk), chunk_length);
            has_json = true;
        } else if (type == kBinaryChunk) {
            if (binary_chunk_) refuse("has two binary chunks");
            binary_chunk_.emplace(chunk, chunk + chunk_length);
        }
        offset += chunk_length;
    }
    if (!has_json) refuse("has no JSON chunk");
    file.clear();
    file.shrink_to_fit();
    return text;
}

void GltfDocument::check_asset() const {
    if (!root().is_object()) root().fail("a glTF file must be a JSON object");
    const JsonElement asset = root().require("asset");
    const JsonElement version = asset.require("version");
    if (version.text().rfind("2.", 0) != 0) version.fail(fmt::format("is '{}'; 2.x is read", version.text()));
    if (const auto minimum = asset.find("minVersion"); minimum && minimum->text() != "2.0") {
        minimum->fail(fmt::format("is '{}'; files that can be read as 2.0 are read", minimum->text()));
    }
}

void GltfDocument::check_extensions() {
    const auto supported = [](const std::string& name) {
        return std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), name) !=
               kSupportedExtensions.end();
    };
    if (const auto required = root().find("extensionsRequired")) {
        for (std::size_t i = 0; i < required->size(); ++i) {
            const std::string name = required->at(i).text();
            if (!supported(name)) {
                required->at(i).fail(fmt::format(
                    "the file cannot be read without {}, which is not supported; export it without", name));
            }
        }
    }
    if (const auto used = root().find("extensionsUsed")) {
        for (std::size_t i = 0; i < used->size(); ++i) {
            const std::string name = used->at(i).text();
            if (supported(name)) continue;
            const auto* lost =
                std::find_if(std::begin(kLostExtensions), std::end(kLostExtensions),
                             [&](const LostExtension& extension) { return extension.name == name; });
            warn_once(
                fmt::format("{} is ignored: {}", name,
                            lost != std::end(kLostExtensions) ? lost->loss : "whatever it adds is missing"));
        }
    }
}

void GltfDocument::load_buffers(std::optional<std::vector<std::uint8_t>> binary_chunk) {
    for (std::size_t i = 0; i < count("buffers"); ++i) {
        const JsonElement buffer = element("buffers", i);
        const std::uint64_t byte_length = buffer.require("byteLength").unsigned_integer();
        std::vector<std::uint8_t> bytes;
        if (const auto uri = buffer.find("uri")) {
            bytes = read_uri(uri->text(), path_.parent_path(), allow_external_, buffer.where());
        } else if (i == 0 && binary_chunk) {
            bytes = *std::move(binary_chunk);
        } else {
            buffer.fail("has no uri, and only the first buffer of a GLB may be its binary chunk");
        }
        if (byte_length == 0) buffer.fail("byteLength must be at least 1");
        if (byte_length > bytes.size()) {
            buffer.fail(
                fmt::format("byteLength is {}, but the data ends after {} bytes", byte_length, bytes.size()));
        }
        bytes.resize(static_cast<std::size_t>(byte_length));
        buffers_.push_back(std::move(bytes));
    }
}

GltfDocument::BufferView GltfDocument::buffer_view(std::size_t index) const {
    const JsonElement view = element("bufferViews", index);
    const std::vector<std::uint8_t>& buffer =
        buffers_[view.require("buffer").index(buffers_.size(), "buffers")];
    const std::uint64_t offset = view.unsigned_or("byteOffset", 0);
    const std::uint64_t length = view.require("byteLength").unsigned_integer();
    const std::uint64_t stride = view.unsigned_or("byteStride", 0);
    if (length == 0) view.fail("byteLength must be at least 1");
    if (offset > buffer.size() || length > buffer.size() - offset) {
        view.fail(fmt::format("bytes {} to {} + {} lie outside a buffer of {} bytes", offset, offset, length,
                              buffer.size()));
    }
    if (view.has("byteStride") && (stride < 4 || stride > 252 || stride % 4 != 0)) {
        view.fail(fmt::format("byteStride is {}; it must be a multiple of 4 from 4 to 252", stride));
    }
    return {std::span<const std::uint8_t>(buffer).subspan(offset, length), stride};
}

std::vector<std::uint8_t> GltfDocument::read_image(std::size_t index) const {
    const JsonElement image = element("images", index);
    if (const auto uri = image.find("uri")) {
        return read_uri(uri->text(), path_.parent_path(), allow_external_, image.where());
    }
    const auto view = image.find("bufferView");
    if (!view) image.fail("has neither uri nor bufferView");
    const BufferView bytes = buffer_view(view->index(count("bufferViews"), "bufferViews"));
    return {bytes.bytes.begin(), bytes.bytes.end()};
}

void GltfDocument::warn_once(const std::string& warning) {
    if (std::find(warnings_.begin(), warnings_.end(), warning) == warnings_.end()) {
        warnings_.push_back(warning);
    }
}

void GltfDocument::charge_memory(std::size_t element_count, std::size_t bytes_each,
                                 const JsonElement& element) {
    // count <= 2^40 keeps the product in range.
    const bool representable = element_count <= (std::uint64_t{1} << 40);
    if (representable) memory_charged_ += static_cast<std::uint64_t>(element_count) * bytes_each;
    if (representable && memory_charged_ <= memory_limit_) return;
    throw InputError(ErrorKind::kOutOfMemory,
                     fmt::format("{}: the file asks for more than {} MiB of geometry, {} times its size",
                                 element.where(), memory_limit_ >> 20, kMemoryPerFileByte));
}

}  // namespace core
