#include "core/scene/text_scanner.h"

#include <charconv>
#include <limits>
#include <system_error>

namespace core {

namespace {

bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r';
}

bool is_line_end(char c) {
    return c == '\n' || c == '\r';
}

/// from_chars takes no plus sign.
std::string_view without_plus(std::string_view word) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
    return word;
}

}  // namespace

std::size_t TextScanner::line_end_length(std::size_t offset) const {
    if (offset >= text_.size() || !is_line_end(text_[offset])) return 0;
    return text_.compare(offset, 2, "\r\n") == 0 ? 2 : 1;
}

std::size_t TextScanner::continuation_length(std::size_t offset) const {
    if (!joins_lines_ || offset >= text_.size() || text_[offset] != '\\') return 0;
    const std::size_t line_end = line_end_length(offset + 1);
    return line_end == 0 ? 0 : 1 + line_end;
}

void TextScanner::skip_blanks() {
    while (offset_ < text_.size()) {
        if (const std::size_t length = continuation_length(offset_)) {
            offset_ += length;
            ++line_number_;
        } else if (is_blank(text_[offset_]) && line_end_length(offset_) == 0) {
            ++offset_;
        } else {
            return;
        }
    }
}

std::string_view TextScanner::word_in_line() {
    skip_blanks();
    const std::size_t begin = offset_;
    while (offset_ < text_.size() && !is_blank(text_[offset_]) && !is_line_end(text_[offset_]) &&
           continuation_length(offset_) == 0) {
        ++offset_;
    }
    return text_.substr(begin, offset_ - begin);
}

std::string_view TextScanner::word() {
    for (;;) {
        const std::string_view found = word_in_line();
        if (!found.empty() || !next_line()) return found;
    }
}

std::string_view TextScanner::rest_of_line() {
    skip_blanks();
    const std::size_t begin = offset_;
    while (offset_ < text_.size() && !is_line_end(text_[offset_])) ++offset_;
    std::size_t end = offset_;
    while (end > begin && is_blank(text_[end - 1])) --end;
    return text_.substr(begin, end - begin);
}

bool TextScanner::next_line() {
    while (offset_ < text_.size() && !is_line_end(text_[offset_])) {
        if (const std::size_t length = continuation_length(offset_)) {
            offset_ += length;
            ++line_number_;
        } else {
            ++offset_;
        }
    }
    if (offset_ >= text_.size()) return false;
    offset_ += line_end_length(offset_);
    ++line_number_;
    return true;
}

std::optional<double> parse_number(std::string_view word) {
    word = without_plus(word);
    double value = 0.0;
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (rest != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        // from_chars does not tell too small from too large: the former have a negative exponent, or zeros in
        // front.
        const std::size_t exponent = word.find_first_of("eE");
        const bool tiny =
            exponent == word.npos ? word[word.find_first_not_of('-')] < '1' : word[exponent + 1] == '-';
        value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    }
    return value;
}

std::optional<std::int64_t> parse_integer(std::string_view word) {
    word = without_plus(word);
    std::int64_t value = 0;
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (rest != word.data() + word.size() || error != std::errc()) return std::nullopt;
    return value;
}

std::string_view as_text(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string lower_case(std::string_view text) {
    std::string result(text);
    for (char& c : result) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return result;
}

std::string quotable(std::string_view text) {
    constexpr std::size_t kShown = 80;
    std::string result(text.substr(0, kShown));
    for (char& c : result) {
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    }
    return text.size() <= kShown ? result : result + "...";
}

}  // namespace core
