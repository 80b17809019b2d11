#include "core/scene/gltf_uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>

#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

namespace fs = std::filesystem;

/// A data URI may be megabytes long, so it is not quoted in full.
[[noreturn]] void refuse(const std::string& what, std::string_view uri, const std::string& reason) {
    throw InputError(ErrorKind::kBadData, fmt::format("{}: '{}' {}", what, quotable(uri), reason));
}

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

int base64_digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+') return 62;
    if (c == '/') return 63;
    return -1;
}

/// The scheme of RFC 3986, section 3.1, in lower case; empty for a relative reference.
std::string scheme_of(std::string_view uri) {
    const std::size_t colon = uri.find(':');
    if (colon == std::string_view::npos || colon == 0) return {};
    std::string scheme(uri.substr(0, colon));
    for (char& c : scheme) {
        const bool allowed = std::isalnum(static_cast<unsigned char>(c)) || c == '+' || c == '-' || c == '.';
        if (!allowed) return {};
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return std::isalpha(static_cast<unsigned char>(scheme.front())) ? scheme : std::string();
}

std::vector<std::uint8_t> read_data_uri(std::string_view uri, const std::string& what) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos) refuse(what, uri, "has no comma before its data");
    const std::string_view header = uri.substr(0, comma);
    const std::string_view payload = uri.substr(comma + 1);
    constexpr std::string_view kBase64 = ";base64";
    if (header.size() < kBase64.size() || header.substr(header.size() - kBase64.size()) != kBase64) {
        const std::string decoded = percent_decoded(payload);
        return {decoded.begin(), decoded.end()};
    }
    // Only the rare percent-encoded payload pays for a copy.
    std::optional<std::vector<std::uint8_t>> bytes = payload.find('%') == std::string_view::npos
                                                         ? base64_decoded(payload)
                                                         : base64_decoded(percent_decoded(payload));
    if (!bytes) refuse(what, uri, "is not valid base64");
    return *std::move(bytes);
}

bool lies_within(const fs::path& inner, const fs::path& outer) {
    const auto [outer_end, inner_end] = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
    return outer_end == outer.end() && inner_end != inner.end();
}

/// The path of a relative URI inside the folder; refuses whatever would leave it.
fs::path confined_path(const std::string& uri, const std::string& decoded, const fs::path& folder,
                       const std::string& what) {
    const fs::path relative(decoded);
    if (relative.is_absolute()) {
        refuse(what, uri, "is absolute; a path relative to the file is read, others with --allow-external");
    }
    for (const fs::path& component : relative) {
        if (component == "..") refuse(what, uri, "holds '..'; it is followed only with --allow-external");
    }
    std::error_code error;
    const fs::path root = fs::canonical(folder.empty() ? fs::path(".") : folder, error);
    const fs::path resolved = error ? fs::path() : fs::weakly_canonical(root / relative, error);
    if (error) refuse(what, uri, fmt::format("cannot be resolved ({})", error.message()));
    if (!lies_within(resolved, root)) {
        refuse(what, uri, "leads out of the file's folder; it is followed only with --allow-external");
    }
    return folder / relative;
}

/// @param uri as the file has it, for messages.
std::vector<std::uint8_t> read_path(const std::string& uri, const std::string& decoded,
                                    const fs::path& folder, bool allow_external, const std::string& what) {
    if (decoded.empty()) refuse(what, uri, "is empty");
    if (decoded.find('\0') != std::string::npos) refuse(what, uri, "holds a NUL character");
    if (allow_external) return read_whole_file(folder / decoded, what);
    if (decoded.find('\\') != std::string::npos) refuse(what, uri, "holds a backslash; use /");
    return read_whole_file(confined_path(uri, decoded, folder, what), what);
}

}  // namespace

std::vector<std::uint8_t> read_whole_file(const fs::path& path, const std::string& what) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) {
        throw InputError(ErrorKind::kNoInput, fmt::format("{}: '{}' does not exist", what, path.string()));
    }
    // Asked before opening: opening a pipe would wait for a writer.
    if (!fs::is_regular_file(status)) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("{}: '{}' is not a regular file", what, path.string()));
    }
    std::ifstream stream(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : -1;
    if (size < 0) {
        throw InputError(ErrorKind::kNoInput, fmt::format("{}: '{}' cannot be opened", what, path.string()));
    }
    if (static_cast<std::uint64_t>(size) > kMaximumSceneFileBytes) {
        throw InputError(ErrorKind::kBadData, fmt::format("{}: '{}' has {} bytes; at most {} are read", what,
                                                          path.string(), size, kMaximumSceneFileBytes));
    }
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
    stream.seekg(0);
    if (!stream.read(reinterpret_cast<char*>(bytes.data()), size)) {
        throw InputError(ErrorKind::kInputOutput,
                         fmt::format("{}: '{}' cannot be read to its end", what, path.string()));
    }
    return bytes;
}

std::string percent_decoded(std::string_view text) {
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
        const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
        if (low >= 0) {
            result.push_back(static_cast<char>(high * 16 + low));
            i += 2;
        } else {
            result.push_back(text[i]);
        }
    }
    return result;
}

std::optional<std::vector<std::uint8_t>> base64_decoded(std::string_view text) {
    for (int padding = 0; padding < 2 && !text.empty() && text.back() == '='; ++padding) {
        text.remove_suffix(1);
    }
    if (text.size() % 4 == 1) return std::nullopt;
    std::vector<std::uint8_t> bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t buffer = 0;
    int bit_count = 0;
    for (const char c : text) {
        const int digit = base64_digit(c);
        if (digit < 0) return std::nullopt;
        buffer = (buffer << 6) | static_cast<std::uint32_t>(digit);
        bit_count += 6;
        if (bit_count >= 8) {
            bit_count -= 8;
            bytes.push_back(static_cast<std::uint8_t>(buffer >> bit_count));
        }
    }
    return bytes;
}

std::string relative_path_of_uri(const std::string& uri) {
    if (uri.starts_with(':') || !scheme_of(uri).empty()) return {};
    const fs::path path(percent_decoded(uri));
    if (std::find(path.begin(), path.end(), fs::path("..")) != path.end()) return {};
    return path.lexically_normal().string();
}

std::vector<std::uint8_t> read_uri(const std::string& uri, const fs::path& folder, bool allow_external,
                                   const std::string& what) {
    const std::string scheme = scheme_of(uri);
    if (scheme == "data") return read_data_uri(uri, what);
    const bool local_file = scheme == "file" && allow_external;
    if (!scheme.empty() && !local_file) {
        refuse(what, uri,
               scheme == "file"
                   ? "names a file by scheme; it is followed only with --allow-external"
                   : fmt::format("has the scheme '{}'; only data: and relative paths are read", scheme));
    }
    if (uri.starts_with(':')) refuse(what, uri, "has an empty scheme; a path relative to the file is read");
    std::string decoded = percent_decoded(uri);
    if (local_file) {
        decoded.erase(0, decoded.find(':') + 1);
        if (decoded.rfind("//", 0) == 0) decoded.erase(0, 2);
    }
    return read_path(uri, decoded, folder, allow_external, what);
}

std::vector<std::uint8_t> read_named_file(const std::string& path, const fs::path& folder,
                                          bool allow_external, const std::string& what) {
    return read_path(path, path, folder, allow_external, what);
}

}  // namespace core
