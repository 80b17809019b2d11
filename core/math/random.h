// core/math/random.h: random numbers that depend only on what they are for: (seed, pixel, sample, dimension).
//
// Owen-scrambled Sobol points by hashing: Burley, "Practical Hash-based Owen Scrambling", JCGT 2020. Each
// named dimension is an independently scrambled and shuffled 2D sequence, so dropping a use shifts nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace core {

/// A well-mixed 32-bit hash of up to four words.
std::uint32_t hash_words(std::uint32_t a, std::uint32_t b = 0, std::uint32_t c = 0, std::uint32_t d = 0);

/// The largest float below 1.
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

/// Uniform in [0, 1).
float unit_float(std::uint32_t bits);

/// One low-discrepancy sequence of points for one pixel (or probe).
class SampleSequence {
public:
    /// @param key what the sequence is for: hash of seed, pixel, batch.
    SampleSequence(std::uint32_t key, std::uint32_t sample_index) : key_(key), index_(sample_index) {}

    /// The point of this sample in `dimension`, a number that names the use. Over sample_index 0, 1, 2, ...
    /// the points of one dimension are a (0,2)-sequence in base 2.
    glm::vec2 point(std::uint32_t dimension) const;

    /// Two independent uniform numbers in [0, 1): cheaper, and not stratified.
    glm::vec2 independent_point(std::uint32_t dimension) const;

    /// 32 bits that no point uses, for hashes such as Ray::seed.
    std::uint32_t bits(std::uint32_t dimension) const;

private:
    std::uint32_t key_;
    std::uint32_t index_;
};

}  // namespace core
