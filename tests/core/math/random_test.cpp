#include "core/math/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace {

TEST(SampleSequence, FillsEveryElementaryIntervalOnce) {
    // A (0,2)-sequence in base 2: each of the boxes of area 1/256, of any shape, holds one of the first 256
    // points.
    for (const std::uint32_t key : {0u, 1u, 0xdeadbeefu}) {
        for (const std::uint32_t dimension : {0u, 1u, 17u}) {
            for (int split = 0; split <= 8; ++split) {
                std::set<std::pair<int, int>> boxes;
                for (std::uint32_t i = 0; i < 256; ++i) {
                    const glm::vec2 point = core::SampleSequence(key, i).point(dimension);
                    boxes.emplace(static_cast<int>(point.x * static_cast<float>(1 << split)),
                                  static_cast<int>(point.y * static_cast<float>(1 << (8 - split))));
                }
                EXPECT_EQ(boxes.size(), 256u)
                    << "key " << key << " dimension " << dimension << " split " << split;
            }
        }
    }
}

TEST(SampleSequence, DiffersByKeyAndDimension) {
    const glm::vec2 point = core::SampleSequence(1, 5).point(2);
    EXPECT_NE(point, core::SampleSequence(2, 5).point(2));
    EXPECT_NE(point, core::SampleSequence(1, 5).point(3));
    EXPECT_EQ(point, core::SampleSequence(1, 5).point(2));
}

TEST(SampleSequence, HasUncorrelatedDimensions) {
    // Pearson's r of n independent pairs has standard deviation 1/sqrt(n): 4 sigma at n = 4096 is 0.0625.
    for (const auto& [first, second] :
         std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}, {2, 9}, {3, 11}}) {
        double sum = 0.0;
        for (std::uint32_t i = 0; i < 4096; ++i) {
            const core::SampleSequence sequence(77, i);
            sum += (static_cast<double>(sequence.point(first).x) - 0.5) *
                   (static_cast<double>(sequence.point(second).x) - 0.5) * 12.0;
        }
        EXPECT_LT(std::abs(sum / 4096.0), 0.0625);
    }
}

TEST(SampleSequence, HasIndependentPointsThatAreUniform) {
    // Means and the correlation of 65,536 uniform pairs: 4 standard deviations, sqrt(1/12/n) and 1/sqrt(n).
    glm::dvec2 sum(0.0);
    double product = 0.0;
    for (std::uint32_t i = 0; i < 65536; ++i) {
        const glm::dvec2 point(core::SampleSequence(i % 256, i / 256).independent_point(5));
        sum += point;
        product += (point.x - 0.5) * (point.y - 0.5) * 12.0;
    }
    EXPECT_NEAR(sum.x / 65536.0, 0.5, 0.0046);
    EXPECT_NEAR(sum.y / 65536.0, 0.5, 0.0046);
    EXPECT_NEAR(product / 65536.0, 0.0, 0.0157);
}

TEST(UnitFloat, StaysBelowOne) {
    EXPECT_LT(core::unit_float(0xffffffffu), 1.0f);
    EXPECT_EQ(core::unit_float(0), 0.0f);
}

}  // namespace
