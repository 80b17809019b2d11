// core/scene/gltf_document.h: a glTF file taken apart: its JSON, its buffers, and what the loader has to say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/scene/gltf_json.h"
#include "core/scene/warning_list.h"
#include "core/support/error.h"

namespace core {

/// The parsed file. Everything the other gltf_* units read goes through it.
class GltfDocument {
public:
    /// Reads a .gltf or .glb (told apart by content) and all its buffers, decodes compressed buffer views,
    /// and checks `asset` and the required extensions. A buffer that cannot be read is no error until
    /// something refers to it. @throws InputError
    GltfDocument(const std::filesystem::path& path, bool allow_external);
    ~GltfDocument();
    GltfDocument(const GltfDocument&) = delete;
    GltfDocument& operator=(const GltfDocument&) = delete;

    const std::string& file_name() const { return file_name_; }
    JsonElement root() const;

    /// Length of a top-level array such as "meshes"; 0 where it is absent.
    std::size_t count(const char* array) const;
    /// @pre index < count(array)
    JsonElement element(const char* array, std::size_t index) const;

    /// The bytes of a buffer view, decoded if it is compressed, and its stride (0: tightly packed).
    /// @throws InputError also for what kept the buffer from being read
    struct BufferView {
        std::span<const std::uint8_t> bytes;
        std::size_t stride = 0;
    };
    BufferView buffer_view(std::size_t index) const;

    /// What an image is read from. Images of equal sources are the same picture.
    std::string image_source(std::size_t index) const;

    /// The still encoded bytes of an image, from its URI or buffer view.
    std::vector<std::uint8_t> read_image(std::size_t index) const;

    /// Says something once, however often it is met; past WarningList::kMost things, only that there is more.
    void warn_once(const std::string& warning);
    std::vector<std::string> warnings() const { return warnings_.all(); }

    /// Counts memory that decoding takes or walks through, so that a small file that refers to the same data
    /// over and over cannot ask for any amount. @throws InputError (kOutOfMemory) past a multiple of the
    /// file's size.
    void charge_memory(std::size_t count, std::size_t bytes_each, const JsonElement& element);

private:
    std::string read_json_text(std::vector<std::uint8_t>& file);
    void check_asset() const;
    void load_buffers();
    void read_buffer(std::size_t index);
    std::shared_ptr<const std::vector<std::uint8_t>> read_buffer_file(const JsonElement& uri,
                                                                      const std::string& what);
    std::uint64_t buffer_byte_count() const;
    void decode_compressed_views();
    std::span<const std::uint8_t> buffer_range(const JsonElement& object) const;

    std::filesystem::path path_;
    std::string file_name_;
    bool allow_external_;
    std::unique_ptr<nlohmann::json> json_;
    std::optional<std::vector<std::uint8_t>> binary_chunk_;
    struct Buffer {
        std::shared_ptr<const std::vector<std::uint8_t>> data;
        std::span<const std::uint8_t> bytes;  ///< The part of `data` in use. Empty: a placeholder.
        std::optional<InputError> trouble;    ///< Why there are no bytes.
    };
    std::vector<Buffer> buffers_;
    /// The files that buffers name, by path: one that many of them name is read and held once.
    std::map<std::string, std::shared_ptr<const std::vector<std::uint8_t>>> buffer_files_;
    std::map<std::size_t, std::vector<std::uint8_t>> decoded_views_;
    WarningList warnings_;
    std::uint64_t memory_per_file_byte_ = 0;
    std::uint64_t memory_limit_ = 0;
    std::uint64_t memory_charged_ = 0;
};

}  // namespace core
