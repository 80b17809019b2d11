#include "core/scene/ply_header.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "core/support/error.h"

namespace core {

namespace {

struct TypeName {
    std::string_view name;
    PlyType type;
};
constexpr std::array<TypeName, 16> kTypeNames = {{{"char", PlyType::kInt8},
                                                  {"int8", PlyType::kInt8},
                                                  {"uchar", PlyType::kUint8},
                                                  {"uint8", PlyType::kUint8},
                                                  {"short", PlyType::kInt16},
                                                  {"int16", PlyType::kInt16},
                                                  {"ushort", PlyType::kUint16},
                                                  {"uint16", PlyType::kUint16},
                                                  {"int", PlyType::kInt32},
                                                  {"int32", PlyType::kInt32},
                                                  {"uint", PlyType::kUint32},
                                                  {"uint32", PlyType::kUint32},
                                                  {"float", PlyType::kFloat32},
                                                  {"float32", PlyType::kFloat32},
                                                  {"double", PlyType::kFloat64},
                                                  {"float64", PlyType::kFloat64}}};

class HeaderReader {
public:
    HeaderReader(TextScanner& scanner, const std::string& file_name)
        : scanner_(scanner), file_name_(file_name) {}

    PlyHeader read() {
        if (scanner_.rest_of_line() != "ply") fail("a PLY file begins with the line 'ply'");
        for (;;) {
            next_line();
            const std::string_view keyword = scanner_.word_in_line();
            if (keyword == "end_header") {
                if (!has_format_) fail("the header ends without a line 'format'");
                scanner_.next_line();
                return std::move(header_);
            }
            if (keyword == "format") {
                read_format();
            } else if (keyword == "element") {
                read_element();
            } else if (keyword == "property") {
                read_property();
            } else if (keyword == "comment" || keyword == "obj_info") {
                if (scanner_.word_in_line() == "TextureFile") header_.names_textures = true;
            } else if (!keyword.empty()) {
                fail(fmt::format("'{}' is none of format, comment, obj_info, element, property, end_header",
                                 quotable(keyword)));
            }
        }
    }

private:
    [[noreturn]] void fail(const std::string& reason) const {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': line {}: {}", file_name_, scanner_.line_number(), reason));
    }

    void next_line() {
        if (!scanner_.next_line()) fail("the file ends within its header; end_header must stand there");
    }

    void read_format() {
        const std::string_view format = scanner_.word_in_line();
        const std::string_view version = scanner_.word_in_line();
        if (format == "ascii") {
            header_.format = PlyFormat::kText;
        } else if (format == "binary_little_endian") {
            header_.format = PlyFormat::kLittleEndian;
        } else if (format == "binary_big_endian") {
            header_.format = PlyFormat::kBigEndian;
        } else {
            fail(fmt::format("'{}' is no format; ascii, binary_little_endian and binary_big_endian are",
                             quotable(format)));
        }
        has_format_ = true;
        if (version != "1.0") fail(fmt::format("version '{}' is not read; 1.0 is", quotable(version)));
    }

    void read_element() {
        const std::string_view name = scanner_.word_in_line();
        const std::optional<std::int64_t> count = parse_integer(scanner_.word_in_line());
        if (name.empty() || !count || *count < 0) fail("an element needs a name and a count from 0 up");
        if (!element_names_.emplace(name).second) {
            fail(fmt::format("there are two elements '{}'", quotable(name)));
        }
        header_.elements.push_back({std::string(name), static_cast<std::uint64_t>(*count), {}});
        property_names_.clear();
    }

    void read_property() {
        if (header_.elements.empty()) fail("a property stands before any element");
        PlyProperty property;
        std::string_view type = scanner_.word_in_line();
        if (type == "list") {
            property.is_list = true;
            property.count_type = type_of(scanner_.word_in_line());
            if (!is_integer(property.count_type)) fail("the length of a list must be of an integer type");
            type = scanner_.word_in_line();
        }
        property.type = type_of(type);
        property.name = scanner_.word_in_line();
        if (property.name.empty()) fail("the property has no name");
        PlyElement& element = header_.elements.back();
        if (!property_names_.insert(property.name).second) {
            fail(fmt::format("element '{}' has two properties '{}'", quotable(element.name),
                             quotable(property.name)));
        }
        element.properties.push_back(std::move(property));
    }

    PlyType type_of(std::string_view name) const {
        for (const TypeName& known : kTypeNames) {
            if (known.name == name) return known.type;
        }
        fail(fmt::format("'{}' is no type; char, uchar, short, ushort, int, uint, float and double are",
                         quotable(name)));
    }

    TextScanner& scanner_;
    const std::string& file_name_;
    PlyHeader header_;
    bool has_format_ = false;
    std::set<std::string, std::less<>> element_names_, property_names_;
};

}  // namespace

std::size_t byte_count(PlyType type) {
    switch (type) {
        case PlyType::kInt8:
        case PlyType::kUint8:
            return 1;
        case PlyType::kInt16:
        case PlyType::kUint16:
            return 2;
        case PlyType::kInt32:
        case PlyType::kUint32:
        case PlyType::kFloat32:
            return 4;
        case PlyType::kFloat64:
            break;
    }
    return 8;
}

bool is_integer(PlyType type) {
    return type != PlyType::kFloat32 && type != PlyType::kFloat64;
}

double smallest_value(PlyType type) {
    switch (type) {
        case PlyType::kInt8:
            return std::numeric_limits<std::int8_t>::min();
        case PlyType::kInt16:
            return std::numeric_limits<std::int16_t>::min();
        case PlyType::kInt32:
            return std::numeric_limits<std::int32_t>::min();
        default:
            return 0.0;
    }
}

double largest_value(PlyType type) {
    const double half = std::ldexp(1.0, static_cast<int>(8 * byte_count(type)) - 1);
    return smallest_value(type) < 0.0 ? half - 1.0 : 2.0 * half - 1.0;
}

PlyHeader read_ply_header(TextScanner& scanner, const std::string& file_name) {
    return HeaderReader(scanner, file_name).read();
}

}  // namespace core
