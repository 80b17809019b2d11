#include "core/scene/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "core/scene/gltf_extensions.h"
#include "core/scene/gltf_meshopt.h"
#include "core/scene/gltf_uri.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67;     // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004e4942;  // "BIN"
constexpr std::size_t kGlbHeaderSize = 12;
constexpr std::size_t kChunkHeaderSize = 8;

/// What decoding may take: generous for real files, whose attributes and pictures grow at most some
/// twenty-fold, and small enough that no small file takes half a gigabyte, copies on the way included.
constexpr std::uint64_t kMemoryAllowance = std::uint64_t{192} << 20;
constexpr std::uint64_t kMemoryPerFileByte = 64;
/// Draco brings a vertex with its two triangles down to some three bytes, which take 450 while they are read.
constexpr std::uint64_t kMemoryPerDracoFileByte = 256;

std::uint32_t read_u32(std::span<const std::uint8_t> bytes, std::size_t offset) {
    return static_cast<std::uint32_t>(bytes[offset]) | static_cast<std::uint32_t>(bytes[offset + 1]) << 8 |
           static_cast<std::uint32_t>(bytes[offset + 2]) << 16 |
           static_cast<std::uint32_t>(bytes[offset + 3]) << 24;
}

constexpr const char* kMeshopt = "EXT_meshopt_compression";

/// Whether a buffer only stands for the decoded bytes of compressed views, so that it is never read.
bool is_fallback(const JsonElement& buffer) {
    const auto extension = buffer.extension(kMeshopt);
    return extension && extension->boolean_or("fallback", false);
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& path, bool allow_external)
    : path_(path), file_name_(path.filename().string()), allow_external_(allow_external) {
    std::vector<std::uint8_t> file = read_whole_file(path, fmt::format("scene '{}'", file_name_));
    const std::size_t file_size = file.size();
    const std::string text = read_json_text(file);
    json_ = std::make_unique<nlohmann::json>(parse_limited_json(text, file_name_));
    check_asset();
    for (const std::string& warning : check_extensions(root())) warn_once(warning);
    load_buffers();
    const std::uint64_t byte_count = file_size + buffer_byte_count();
    memory_per_file_byte_ =
        lists_extension(root(), "KHR_draco_mesh_compression") ? kMemoryPerDracoFileByte : kMemoryPerFileByte;
    memory_limit_ = kMemoryAllowance + memory_per_file_byte_ * byte_count;
    decode_compressed_views();
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
        std::string text(reinterpret_cast<const char*>(file.data()), file.size());
        file = {};
        // Spaces and a byte order mark may stand before JSON.
        const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
        if (first != std::string::npos && text[first] == '{') return text;
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': begins neither with 'glTF', as a .glb does, nor with '{{', as a .gltf does",
                        file_name_));
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
    file = {};
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

void GltfDocument::load_buffers() {
    buffers_.resize(count("buffers"));
    for (std::size_t i = 0; i < buffers_.size(); ++i) {
        try {
            read_buffer(i);
        } catch (const InputError& error) {
            // What the picture does not need may be broken, as images and meshes may be.
            buffers_[i].trouble = error;
            warn_once(fmt::format("a buffer is left out: {}", error.what()));
        }
    }
}

/// Fills in a buffer; a placeholder stays empty.
void GltfDocument::read_buffer(std::size_t index) {
    const JsonElement buffer = element("buffers", index);
    const std::uint64_t byte_length = buffer.require("byteLength").unsigned_integer();
    if (byte_length == 0) buffer.fail("byteLength must be at least 1");
    if (is_fallback(buffer)) return;
    std::shared_ptr<const std::vector<std::uint8_t>> data;
    if (const auto uri = buffer.find("uri")) {
        data = read_buffer_file(*uri, buffer.where());
    } else if (index == 0 && binary_chunk_) {
        data = std::make_shared<const std::vector<std::uint8_t>>(*std::exchange(binary_chunk_, std::nullopt));
    } else if (lists_extension(root(), kMeshopt)) {
        return;  // Fallbacks need not be marked.
    } else {
        buffer.fail("has no uri, and only the first buffer of a GLB may be its binary chunk");
    }
    if (byte_length > data->size()) {
        buffer.fail(
            fmt::format("byteLength is {}, but the data ends after {} bytes", byte_length, data->size()));
    }
    buffers_[index].bytes = std::span(*data).first(static_cast<std::size_t>(byte_length));
    buffers_[index].data = std::move(data);
}

std::shared_ptr<const std::vector<std::uint8_t>> GltfDocument::read_buffer_file(const JsonElement& uri,
                                                                                const std::string& what) {
    const auto read = [&] {
        return std::make_shared<const std::vector<std::uint8_t>>(
            read_uri(uri.text(), path_.parent_path(), allow_external_, what));
    };
    const std::string path = relative_path_of_uri(uri.text());
    if (path.empty()) return read();
    const auto known = buffer_files_.find(path);
    return known != buffer_files_.end() ? known->second : buffer_files_.emplace(path, read()).first->second;
}

/// Of all buffers together, what several share counted once.
std::uint64_t GltfDocument::buffer_byte_count() const {
    std::set<const void*> counted;
    std::uint64_t bytes = 0;
    for (const Buffer& buffer : buffers_) {
        if (buffer.data && counted.insert(buffer.data.get()).second) bytes += buffer.data->size();
    }
    return bytes;
}

void GltfDocument::decode_compressed_views() {
    for (std::size_t i = 0; i < count("bufferViews"); ++i) {
        const JsonElement view = element("bufferViews", i);
        const auto extension = view.extension(kMeshopt);
        if (!extension) continue;
        const MeshoptLayout layout = read_meshopt_layout(view, *extension);
        charge_memory(layout.count, layout.stride, *extension);
        decoded_views_.emplace(i, decode_meshopt(layout, buffer_range(*extension), *extension));
    }
}

/// The bytes that an object with buffer, byteOffset and byteLength refers to.
std::span<const std::uint8_t> GltfDocument::buffer_range(const JsonElement& object) const {
    const std::size_t index = object.require("buffer").index(buffers_.size(), "buffers");
    if (buffers_[index].trouble) throw InputError(*buffers_[index].trouble);
    const std::span<const std::uint8_t> buffer = buffers_[index].bytes;
    const std::uint64_t offset = object.unsigned_or("byteOffset", 0);
    const std::uint64_t length = object.require("byteLength").unsigned_integer();
    if (length == 0) object.fail("byteLength must be at least 1");
    if (buffer.empty()) {
        object.fail(fmt::format("buffers[{}] is a placeholder without data, which only views with {} may use",
                                index, kMeshopt));
    }
    if (offset > buffer.size() || length > buffer.size() - offset) {
        object.fail(fmt::format("bytes {} to {} + {} lie outside a buffer of {} bytes", offset, offset,
                                length, buffer.size()));
    }
    return buffer.subspan(offset, length);
}

GltfDocument::BufferView GltfDocument::buffer_view(std::size_t index) const {
    const JsonElement view = element("bufferViews", index);
    const std::uint64_t stride = view.unsigned_or("byteStride", 0);
    if (view.has("byteStride") && (stride < 4 || stride > 252 || stride % 4 != 0)) {
        view.fail(fmt::format("byteStride is {}; it must be a multiple of 4 from 4 to 252", stride));
    }
    const auto decoded = decoded_views_.find(index);
    if (decoded != decoded_views_.end()) return {decoded->second, stride};
    return {buffer_range(view), stride};
}

std::string GltfDocument::image_source(std::size_t index) const {
    const JsonElement image = element("images", index);
    if (const auto uri = image.find("uri")) {
        const std::string path = relative_path_of_uri(uri->text());
        return path.empty() ? fmt::format("image {}", index) : fmt::format("file {}", path);
    }
    const auto view = image.find("bufferView");
    if (!view) return fmt::format("image {}", index);
    const BufferView bytes = buffer_view(view->index(count("bufferViews"), "bufferViews"));
    return fmt::format("bytes {} {}", fmt::ptr(bytes.bytes.data()), bytes.bytes.size());
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
    warnings_.add(warning);
}

void GltfDocument::charge_memory(std::size_t element_count, std::size_t bytes_each,
                                 const JsonElement& element) {
    // count <= 2^40 keeps the product in range.
    const bool representable = element_count <= (std::uint64_t{1} << 40);
    if (representable) memory_charged_ += static_cast<std::uint64_t>(element_count) * bytes_each;
    if (representable && memory_charged_ <= memory_limit_) return;
    throw InputError(
        ErrorKind::kOutOfMemory,
        fmt::format("{}: the file unpacks to more than {} MiB; {} MiB and {} times its own size "
                    "are allowed",
                    element.where(), memory_limit_ >> 20, kMemoryAllowance >> 20, memory_per_file_byte_));
}

}  // namespace core
