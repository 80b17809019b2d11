// core/scene/ply_header.h: what a PLY file says about itself before its data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/text_scanner.h"

namespace core {

enum class PlyFormat : std::uint8_t { kText, kLittleEndian, kBigEndian };

enum class PlyType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::size_t byte_count(PlyType type);
bool is_integer(PlyType type);
/// Of an integer type.
double smallest_value(PlyType type);
double largest_value(PlyType type);

/// One column of an element: a number, or a list with its length before it.
struct PlyProperty {
    std::string name;
    PlyType type = PlyType::kFloat32;  ///< Of the number, or of each in the list.
    bool is_list = false;
    PlyType count_type = PlyType::kUint8;
};

/// A table of the file.
struct PlyElement {
    std::string name;
    std::uint64_t count = 0;  ///< Rows.
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    PlyFormat format = PlyFormat::kText;
    std::vector<PlyElement> elements;  ///< In the order of the data.
    bool names_textures = false;       ///< Comments `TextureFile`, as some programs write them.
};

/// Reads the header and leaves the scanner where the data begin. @throws InputError (kBadData) naming the
/// line
PlyHeader read_ply_header(TextScanner& scanner, const std::string& file_name);

}  // namespace core
