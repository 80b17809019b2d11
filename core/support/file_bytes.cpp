#include "core/support/file_bytes.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>

#include "core/support/error.h"

namespace core {

namespace fs = std::filesystem;

std::vector<std::uint8_t> read_file_bytes(const fs::path& path, std::uint64_t max_bytes) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) {
        throw InputError(ErrorKind::kNoInput, fmt::format("'{}': no such file", path.string()));
    }
    if (!fs::is_regular_file(status)) {
        throw InputError(ErrorKind::kNoInput,
                         fmt::format("'{}': is not a regular file; only files can be read", path.string()));
    }
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw InputError(ErrorKind::kNoInput, fmt::format("'{}': cannot be opened", path.string()));
    const auto size = static_cast<std::uint64_t>(file.tellg());
    if (size > max_bytes) {
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': has {} bytes; at most {} are read",
                                                          path.string(), size, max_bytes));
    }
    std::vector<std::uint8_t> bytes(size);
    file.seekg(0);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (!file) throw InputError(ErrorKind::kInputOutput, fmt::format("'{}': reading failed", path.string()));
    return bytes;
}

}  // namespace core
