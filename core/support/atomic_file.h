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

/// Fails now where write_file_atomically could not begin: before long work, whose result would have no place.
/// Makes a temporary file and removes it.
/// @throws InputError as write_file_atomically does
void require_place_for_file(const std::filesystem::path& path);

/// Removes the temporary files that are being written, where the program must end without unwinding. Takes no
/// memory.
void remove_temporary_files() noexcept;

/// write_file_atomically for text that is at hand.
void write_text_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace core
