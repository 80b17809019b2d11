#include "core/scene/text_scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using core::parse_number;
using core::TextScanner;

TEST(TextScanner, CountsLinesWhateverEndsThem) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        const std::string text = "one  two" + end + end + "\t three" + end + "four";
        TextScanner scanner(text);
        EXPECT_EQ(scanner.word_in_line(), "one");
        EXPECT_EQ(scanner.word_in_line(), "two");
        EXPECT_EQ(scanner.word_in_line(), "");
        EXPECT_EQ(scanner.line_number(), 1u);
        EXPECT_EQ(scanner.word(), "three");
        EXPECT_EQ(scanner.line_number(), 3u);
        EXPECT_EQ(scanner.word(), "four");
        EXPECT_EQ(scanner.line_number(), 4u);
        EXPECT_EQ(scanner.word(), "");
        EXPECT_FALSE(scanner.next_line());
        EXPECT_EQ(scanner.offset(), text.size());
    }
}

TEST(TextScanner, GivesTheRestOfALineWithoutBlanksAround) {
    TextScanner scanner("name  two words \t\r\nnext");
    EXPECT_EQ(scanner.word_in_line(), "name");
    EXPECT_EQ(scanner.rest_of_line(), "two words");
    EXPECT_TRUE(scanner.next_line());
    EXPECT_EQ(scanner.rest_of_line(), "next");
}

TEST(TextScanner, JoinsLinesAfterABackslashWhereAsked) {
    const std::string text = "f 1 \\\n2\\\r\n3 a\\b\nv";
    TextScanner joining(text, true);
    for (const char* word : {"f", "1", "2", "3", "a\\b", ""}) EXPECT_EQ(joining.word_in_line(), word);
    EXPECT_EQ(joining.line_number(), 3u);
    TextScanner plain(text);
    for (const char* word : {"f", "1", "\\", ""}) EXPECT_EQ(plain.word_in_line(), word);
    TextScanner skipping(text, true);
    EXPECT_TRUE(skipping.next_line());
    EXPECT_EQ(skipping.line_number(), 4u);
    EXPECT_EQ(skipping.word_in_line(), "v");
}

TEST(TextScanner, ReadsNumbersInEveryNotation) {
    EXPECT_EQ(parse_number("1"), 1.0);
    EXPECT_EQ(parse_number("+1.5e2"), 150.0);
    EXPECT_EQ(parse_number("-.25"), -0.25);
    EXPECT_EQ(parse_number("3."), 3.0);
    EXPECT_EQ(parse_number("1E-3"), 1e-3);
    EXPECT_EQ(parse_number("1e-999"), 0.0);
    EXPECT_EQ(parse_number("-1e-999"), 0.0);
    EXPECT_EQ(parse_number("0." + std::string(400, '0') + "1"), 0.0);
    EXPECT_EQ(parse_number("1e999"), std::numeric_limits<double>::infinity());
    EXPECT_EQ(parse_number(std::string(400, '9')), std::numeric_limits<double>::infinity());
    EXPECT_TRUE(std::isnan(*parse_number("nan")));
    for (const char* wrong : {"", "+", "-", "1x", "0x10", "1,5", "+-1", "++1", "e5", "1e", "."}) {
        EXPECT_FALSE(parse_number(wrong)) << wrong;
    }
}

TEST(TextScanner, ReadsIntegersThatFit) {
    EXPECT_EQ(core::parse_integer("+12"), 12);
    EXPECT_EQ(core::parse_integer("-9223372036854775808"), std::numeric_limits<std::int64_t>::min());
    for (const char* wrong : {"", "9223372036854775808", "1.0", "1 ", "-"}) {
        EXPECT_FALSE(core::parse_integer(wrong)) << wrong;
    }
}

TEST(TextScanner, QuotesNoControlCharacters) {
    EXPECT_EQ(core::quotable(std::string("a\0b\x1b[1m", 7)), "a?b?[1m");
    EXPECT_EQ(core::quotable(std::string(500, 'x')), std::string(80, 'x') + "...");
}

}  // namespace
