// core/support/error.h: the one exception for what a user can mend, with the exit code it ends in.
#pragma once

#include <stdexcept>
#include <string>

namespace core {

/// What kind of trouble a user's input or machine caused. The value is the program's exit code
/// (sysexits(3)).
enum class ErrorKind {
    kUsage = 64,         ///< A flag or a combination of flags that cannot be met.
    kBadData = 65,       ///< A file whose content is wrong.
    kNoInput = 66,       ///< A file that is missing or cannot be opened.
    kOutOfMemory = 71,   ///< A limit on memory would be exceeded.
    kCannotCreate = 73,  ///< An output file or folder that cannot be created.
    kInputOutput = 74,   ///< A read or write that failed midway.
};

/// A bad file, flag or scene. The message names the file, the element and what would be right, as in
/// `'sponza.gltf': mesh 'arch' primitive 2 has mode LINES; only TRIANGLES can be baked`.
/// Libraries throw it; only `cli/main.cpp` catches it. Programmer errors are asserts.
class InputError : public std::runtime_error {
public:
    InputError(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}

    ErrorKind kind() const { return kind_; }

private:
    ErrorKind kind_;
};

/// Thrown by long work that was asked to stop (SIGINT, SIGTERM). Nothing was written.
class Interrupted : public std::runtime_error {
public:
    Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace core
