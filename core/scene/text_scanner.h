// core/scene/text_scanner.h: words and numbers of a text file, with the line they stand in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace core {

/// Walks through a text that it does not own. Lines end with \n, \r\n or \r; words are what blanks separate.
class TextScanner {
public:
    /// @param joins_lines whether a backslash before the end of a line continues it, as in OBJ.
    explicit TextScanner(std::string_view text, bool joins_lines = false)
        : text_(text), joins_lines_(joins_lines) {}

    /// The next word of this line; empty at its end.
    std::string_view word_in_line();
    /// The next word of this line or of those after it; empty at the end of the text.
    std::string_view word();
    /// What is left of this line without blanks around it.
    std::string_view rest_of_line();
    /// Goes to the start of the next line; false if there is none.
    bool next_line();

    /// Of the line that the scanner stands in, from 1.
    std::size_t line_number() const { return line_number_; }
    /// How many bytes lie before the scanner.
    std::size_t offset() const { return offset_; }

private:
    void skip_blanks();
    std::size_t line_end_length(std::size_t offset) const;
    std::size_t continuation_length(std::size_t offset) const;

    std::string_view text_;
    bool joins_lines_;
    std::size_t offset_ = 0;
    std::size_t line_number_ = 1;
};

/// A whole word as a number in decimal or scientific notation, or as inf or nan, whatever the locale; too
/// small ones are 0, too large ones infinite. Nothing if it is no number.
std::optional<double> parse_number(std::string_view word);

/// A whole word as a decimal integer that 64 bits hold.
std::optional<std::int64_t> parse_integer(std::string_view word);

/// The same bytes, not copied.
std::string_view as_text(std::span<const std::uint8_t> bytes);

/// ASCII letters in lower case.
std::string lower_case(std::string_view text);

/// What a message quotes of a file: the first 80 bytes, control characters as question marks.
std::string quotable(std::string_view text);

}  // namespace core
