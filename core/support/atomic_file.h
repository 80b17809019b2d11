// core/support/atomic_file.h: files that are either the old one or the whole new one, never half.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace core {

/// Calls `write` with the path of a temporary file in the same folder (same extension), then flushes it to
/// disk, renames it to `path` and flushes the folder. On any failure the temporary file is removed and `path`
/// is untouched.
/// @throws InputError kCannotCreate if the folder is missing or not writable, kInputOutput if writing fails;
/// both name the path. What `write` throws passes through.
void write_file_atomically(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for text that is at hand.
void write_text_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace core
