// tests/core/support/hash_test.cpp: hashes tell contents apart, and only contents.
#include "core/support/hash.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>

namespace {

std::string hash_of(std::string_view bytes) {
    core::Hasher hasher;
    hasher.add_bytes(bytes.data(), bytes.size());
    return hasher.hex();
}

TEST(Hasher, GivesThePublishedValueOfXxh3ForNoBytes) {
    // XXH3_128bits of the empty input with seed 0, from xxHash's own test vectors.
    EXPECT_EQ(hash_of(""), "99aa06d3014798d86001c324468d497f");
}

TEST(Hasher, DoesNotDependOnHowBytesAreSplit) {
    core::Hasher hasher;
    hasher.add_bytes("ab", 2);
    hasher.add_bytes("", 0);
    hasher.add_bytes("cd", 2);
    EXPECT_EQ(hasher.hex(), hash_of("abcd"));
    EXPECT_EQ(hasher.hex(), hasher.hex());
}

TEST(Hasher, ChangesWithEveryBit) {
    const std::string text(100, 'x');
    for (std::size_t i = 0; i < text.size(); ++i) {
        std::string changed = text;
        changed[i] ^= 1;
        EXPECT_NE(hash_of(changed), hash_of(text));
    }
}

TEST(Hasher, TellsWhereOneRangeEndsAndTheNextBegins) {
    core::Hasher one, other;
    one.add_text("ab");
    one.add_text("c");
    other.add_text("a");
    other.add_text("bc");
    EXPECT_NE(one.hex(), other.hex());
    const std::array<std::uint16_t, 2> values{1, 2};
    core::Hasher range;
    range.add_range(std::span<const std::uint16_t>(values));
    core::Hasher by_hand;
    by_hand.add(std::size_t{2});
    by_hand.add(std::uint16_t{1});
    by_hand.add(std::uint16_t{2});
    EXPECT_EQ(range.hex(), by_hand.hex());
}

}  // namespace
