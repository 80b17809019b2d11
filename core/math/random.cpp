#include "core/math/random.h"

namespace core {

namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    return x;
}

/// A permutation in which each bit depends only on itself and lower ones: an Owen scramble of the reversed
/// word (Laine and Karras 2011, with the constants that Vegdahl measured to mix best, 2021).
std::uint32_t permute_low_to_high(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/// The second Sobol dimension before its bit reversal: bit j stands for (1 + x)^j over GF(2), so the map is
/// the Pascal matrix modulo 2, a Kronecker power that factors into five masked shifts.
std::uint32_t pascal_transform(std::uint32_t x) {
    x ^= (x & 0xaaaaaaaau) >> 1;
    x ^= (x & 0xccccccccu) >> 2;
    x ^= (x & 0xf0f0f0f0u) >> 4;
    x ^= (x & 0xff00ff00u) >> 8;
    x ^= (x & 0xffff0000u) >> 16;
    return x;
}

std::uint32_t mix(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0x735a2d97u;
    x ^= x >> 15;
    return x;
}

}  // namespace

std::uint32_t hash_words(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    std::uint32_t hash = mix(a + 0x9e3779b9u);
    hash = mix(hash ^ (b + 0x7f4a7c15u));
    hash = mix(hash ^ (c + 0x85ebca6bu));
    return mix(hash ^ (d + 0xc2b2ae35u));
}

float unit_float(std::uint32_t bits) {
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

glm::vec2 SampleSequence::point(std::uint32_t dimension) const {
    const std::uint32_t seed = mix(key_ ^ (dimension * 0x9e3779b9u + 0x632be5abu));
    const std::uint32_t shuffled = permute_low_to_high(reverse_bits(index_), seed);
    // `shuffled` is the bit-reversed shuffled index, which is at once the first Sobol coordinate.
    const std::uint32_t shuffled_index = reverse_bits(shuffled);
    const std::uint32_t x = reverse_bits(permute_low_to_high(shuffled_index, mix(seed ^ 0x68bc21ebu)));
    const std::uint32_t y =
        reverse_bits(permute_low_to_high(pascal_transform(shuffled_index), mix(seed ^ 0x02e5be93u)));
    return {unit_float(x), unit_float(y)};
}

glm::vec2 SampleSequence::independent_point(std::uint32_t dimension) const {
    const std::uint32_t first =
        mix(mix(key_ + dimension * 0x9e3779b9u) ^ (index_ * 0x85ebca6bu + 0x27d4eb2fu));
    const std::uint32_t second = mix(first ^ 0x6a09e667u);
    return {unit_float(first), unit_float(second)};
}

std::uint32_t SampleSequence::bits(std::uint32_t dimension) const {
    return mix(mix(key_ ^ (dimension * 0xc2b2ae35u)) + index_ * 0x9e3779b9u);
}

}  // namespace core
