// core/scene/gltf_uri.h: what a glTF file's URIs stand for: data within the text, or a file beside it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace core {

/// No file that a scene names may be larger; the length field of a GLB ends there, too.
inline constexpr std::uint64_t kMaximumSceneFileBytes = std::uint64_t{1} << 32;

/// Reads a whole regular file.
/// @throws InputError kNoInput if it is missing or unreadable, kBadData if it is a folder, pipe or device, or
/// larger than kMaximumSceneFileBytes.
std::vector<std::uint8_t> read_whole_file(const std::filesystem::path& path, const std::string& what);

/// %XX decoded (RFC 3986, section 2.1); a % that starts no such triple stands for itself.
std::string percent_decoded(std::string_view text);

/// The bytes of standard base64 (RFC 4648, section 4), or nothing if it is malformed. Padding may be missing.
std::optional<std::vector<std::uint8_t>> base64_decoded(std::string_view text);

/// The path that a relative URI names, decoded and lexically normal, so that two spellings of one file
/// compare equal; empty for data and for whatever has a scheme or holds `..`.
std::string relative_path_of_uri(const std::string& uri);

/// The bytes behind a URI of a glTF file.
/// @param folder the glTF file's own. @param what names the element in messages.
/// @param allow_external lets paths be absolute, hold `..`, or lead out of the folder through links. Pipes,
/// devices and the network are refused even then.
/// @throws InputError
std::vector<std::uint8_t> read_uri(const std::string& uri, const std::filesystem::path& folder,
                                   bool allow_external, const std::string& what);

/// The bytes of a file that another one names by its path, under the same rules.
/// @param path as it is, without percent-encoding.
/// @throws InputError kNoInput if it is missing, kBadData if it is refused.
std::vector<std::uint8_t> read_named_file(const std::string& path, const std::filesystem::path& folder,
                                          bool allow_external, const std::string& what);

}  // namespace core
