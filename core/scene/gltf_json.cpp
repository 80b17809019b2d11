#include "core/scene/gltf_json.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/support/error.h"

namespace core {

namespace {

constexpr int kMaximumDepth = 200;

/// What a character of the text can cost once parsed, in bytes on a 64-bit machine: a container on the heap,
/// a value in an array that has just grown, a member's node and key.
constexpr std::size_t kBytesPerContainer = 64;
constexpr std::size_t kBytesPerComma = 40;
constexpr std::size_t kBytesPerMember = 96;
/// Room for a scene of some 300,000 nodes with matrices and names.
constexpr std::size_t kMaximumParsedBytes = std::size_t{320} << 20;

/// Walks the brackets without building anything; strings are skipped.
void check_limits(std::string_view text, const std::string& file_name) {
    int depth = 0;
    std::size_t parsed_bytes = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') {
                ++i;
            } else if (c == '"') {
                in_string = false;
            }
            continue;
        }
        if (c == '"') in_string = true;
        if (c == '[' || c == '{') ++depth;
        if (c == ']' || c == '}') --depth;
        if (c == '[' || c == '{') parsed_bytes += kBytesPerContainer;
        if (c == ',') parsed_bytes += kBytesPerComma;
        if (c == ':') parsed_bytes += kBytesPerMember;
        if (depth > kMaximumDepth) {
            throw InputError(ErrorKind::kBadData,
                             fmt::format("'{}': JSON is nested more than {} deep at byte {}", file_name,
                                         kMaximumDepth, i));
        }
        if (parsed_bytes > kMaximumParsedBytes) {
            throw InputError(ErrorKind::kBadData,
                             fmt::format("'{}': JSON would take more than {} MiB; at most that is parsed",
                                         file_name, kMaximumParsedBytes >> 20));
        }
    }
}

}  // namespace

nlohmann::json parse_limited_json(std::string_view text, const std::string& file_name) {
    check_limits(text, file_name);
    try {
        return nlohmann::json::parse(text);
    } catch (const nlohmann::json::exception& error) {
        // The library begins with its own name and number in brackets, and quotes what may be a long string.
        constexpr std::size_t kShown = 200;
        const std::string_view reason = error.what();
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': not valid JSON: {}", file_name,
                                                          reason.substr(reason.find("] ") + 2, kShown)));
    }
}

JsonElement::JsonElement(const nlohmann::json& value, std::string file_name)
    : value_(&value), file_name_(std::move(file_name)) {}

JsonElement::JsonElement(const nlohmann::json& value, const JsonElement& parent, std::string path)
    : value_(&value), file_name_(parent.file_name_), path_(std::move(path)) {}

std::string JsonElement::where() const {
    return path_.empty() ? fmt::format("'{}'", file_name_) : fmt::format("'{}': {}", file_name_, path_);
}

void JsonElement::fail(const std::string& reason) const {
    throw InputError(ErrorKind::kBadData, fmt::format("{}: {}", where(), reason));
}

bool JsonElement::is_object() const {
    return value_->is_object();
}

bool JsonElement::has(const char* key) const {
    if (!value_->is_object()) fail("must be an object");
    return value_->contains(key);
}

std::optional<JsonElement> JsonElement::find(const char* key) const {
    if (!value_->is_object()) fail("must be an object");
    const auto member = value_->find(key);
    if (member == value_->end()) return std::nullopt;
    return JsonElement(*member, *this, path_.empty() ? key : fmt::format("{}.{}", path_, key));
}

JsonElement JsonElement::require(const char* key) const {
    std::optional<JsonElement> member = find(key);
    if (!member) fail(fmt::format("'{}' is missing", key));
    return *std::move(member);
}

std::size_t JsonElement::size() const {
    if (!value_->is_array()) fail("must be an array");
    return value_->size();
}

JsonElement JsonElement::at(std::size_t index) const {
    if (index >= size()) fail(fmt::format("must have more than {} elements", index));
    const nlohmann::json& value = (*value_)[index];
    std::string path = fmt::format("{}[{}]", path_, index);
    if (value.is_object()) {
        const auto name = value.find("name");
        if (name != value.end() && name->is_string()) {
            path += fmt::format(" '{}'", name->get_ref<const std::string&>());
        }
    }
    return JsonElement(value, *this, std::move(path));
}

std::vector<std::string> JsonElement::keys() const {
    if (!value_->is_object()) fail("must be an object");
    std::vector<std::string> result;
    for (const auto& [key, value] : value_->items()) result.push_back(key);
    return result;
}

std::optional<JsonElement> JsonElement::extension(const char* name) const {
    const std::optional<JsonElement> extensions = find("extensions");
    if (!extensions) return std::nullopt;
    std::optional<JsonElement> found = extensions->find(name);
    if (found && !found->is_object()) found->fail("must be an object");
    return found;
}

double JsonElement::number() const {
    if (!value_->is_number()) fail("must be a number");
    const double value = value_->get<double>();
    if (!std::isfinite(value)) fail("must be a finite number");
    return value;
}

bool JsonElement::boolean() const {
    if (!value_->is_boolean()) fail("must be true or false");
    return value_->get<bool>();
}

std::string JsonElement::text() const {
    if (!value_->is_string()) fail("must be a string");
    return value_->get<std::string>();
}

std::uint64_t JsonElement::unsigned_integer() const {
    if (value_->is_number_unsigned()) return value_->get<std::uint64_t>();
    if (value_->is_number_float()) {
        // 2^53: above it a double no longer tells neighbours apart.
        const double value = value_->get<double>();
        if (value >= 0.0 && value <= 9007199254740992.0 && value == std::floor(value)) {
            return static_cast<std::uint64_t>(value);
        }
    }
    fail("must be a whole number that is not negative");
}

std::size_t JsonElement::index(std::size_t count, const char* what) const {
    const std::uint64_t value = unsigned_integer();
    if (value >= count) fail(fmt::format("is {}, but the file has {} {}", value, count, what));
    return static_cast<std::size_t>(value);
}

double JsonElement::number_or(const char* key, double fallback) const {
    const auto member = find(key);
    return member ? member->number() : fallback;
}

std::string JsonElement::text_or(const char* key, const std::string& fallback) const {
    const auto member = find(key);
    return member ? member->text() : fallback;
}

bool JsonElement::boolean_or(const char* key, bool fallback) const {
    const auto member = find(key);
    return member ? member->boolean() : fallback;
}

std::uint64_t JsonElement::unsigned_or(const char* key, std::uint64_t fallback) const {
    const auto member = find(key);
    return member ? member->unsigned_integer() : fallback;
}

std::vector<double> JsonElement::numbers(std::size_t count) const {
    if (size() != count) fail(fmt::format("must be an array of {} numbers", count));
    std::vector<double> result;
    result.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const nlohmann::json& value = (*value_)[i];
        const double number = value.is_number() ? value.get<double>() : std::nan("");
        if (!std::isfinite(number)) at(i).fail("must be a finite number");
        result.push_back(number);
    }
    return result;
}

glm::dvec2 JsonElement::vec2_or(const char* key, const glm::dvec2& fallback) const {
    const auto member = find(key);
    if (!member) return fallback;
    const std::vector<double> v = member->numbers(2);
    return {v[0], v[1]};
}

glm::dvec3 JsonElement::vec3_or(const char* key, const glm::dvec3& fallback) const {
    const auto member = find(key);
    if (!member) return fallback;
    const std::vector<double> v = member->numbers(3);
    return {v[0], v[1], v[2]};
}

glm::dvec4 JsonElement::vec4_or(const char* key, const glm::dvec4& fallback) const {
    const auto member = find(key);
    if (!member) return fallback;
    const std::vector<double> v = member->numbers(4);
    return {v[0], v[1], v[2], v[3]};
}

}  // namespace core
