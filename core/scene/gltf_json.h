// core/scene/gltf_json.h: JSON that knows where it stands, so that whatever is wrong with it can be named.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace core {

/// Parses JSON text. Depth and the memory that it takes are limited before anything is built.
/// @param file_name for messages. @throws InputError (kBadData)
nlohmann::json parse_limited_json(std::string_view text, const std::string& file_name);

/// One value of a JSON document with its path in it. Refers to the document, which must outlive it.
/// Every accessor throws InputError (kBadData) naming file and path if the value is of the wrong kind.
class JsonElement {
public:
    JsonElement(const nlohmann::json& value, std::string file_name);

    /// `'file': meshes[2] 'arch'.primitives[0]: reason`.
    [[noreturn]] void fail(const std::string& reason) const;
    /// The part of that message before the reason, with and without the file.
    std::string where() const;
    const std::string& path() const { return path_; }

    bool is_object() const;
    bool has(const char* key) const;
    /// The member of an object, if there.
    std::optional<JsonElement> find(const char* key) const;
    JsonElement require(const char* key) const;

    /// Elements of an array.
    std::size_t size() const;
    JsonElement at(std::size_t index) const;

    /// Keys of an object, sorted.
    std::vector<std::string> keys() const;

    /// The extension of that name in this object's `extensions`, if there.
    std::optional<JsonElement> extension(const char* name) const;

    double number() const;
    bool boolean() const;
    std::string text() const;
    /// A whole number >= 0. JSON numbers like 3.0 count.
    std::uint64_t unsigned_integer() const;
    /// An index into an array of `count` elements called `what`.
    std::size_t index(std::size_t count, const char* what) const;

    double number_or(const char* key, double fallback) const;
    std::string text_or(const char* key, const std::string& fallback) const;
    bool boolean_or(const char* key, bool fallback) const;
    std::uint64_t unsigned_or(const char* key, std::uint64_t fallback) const;

    /// An array of exactly `count` numbers.
    std::vector<double> numbers(std::size_t count) const;
    glm::dvec2 vec2_or(const char* key, const glm::dvec2& fallback) const;
    glm::dvec3 vec3_or(const char* key, const glm::dvec3& fallback) const;
    glm::dvec4 vec4_or(const char* key, const glm::dvec4& fallback) const;

private:
    JsonElement(const nlohmann::json& value, const JsonElement& parent, std::string path);

    const nlohmann::json* value_;
    std::string file_name_;
    std::string path_;
};

}  // namespace core
