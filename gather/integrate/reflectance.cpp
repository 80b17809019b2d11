#include "gather/integrate/reflectance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/sampling.h"

namespace gather {

namespace {

constexpr int kEntries = 64;
constexpr int kQuadrature = 64;

/// Mean of Schlick's (1 - V.H)^5 over cosine-weighted directions, by the cosine of V.
std::array<float, kEntries + 1> integrate_schlick() {
    std::array<float, kEntries + 1> table{};
    for (int entry = 0; entry <= kEntries; ++entry) {
        const float cosine = static_cast<float>(entry) / kEntries;
        const glm::vec3 outgoing(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
        double sum = 0.0;
        for (int j = 0; j < kQuadrature; ++j) {
            for (int i = 0; i < kQuadrature; ++i) {
                const glm::vec3 incoming =
                    core::sample_cosine_hemisphere({(static_cast<float>(i) + 0.5f) / kQuadrature,
                                                    (static_cast<float>(j) + 0.5f) / kQuadrature});
                const glm::vec3 half = glm::normalize(outgoing + incoming);
                const double rest = 1.0 - static_cast<double>(glm::dot(outgoing, half));
                sum += std::pow(std::clamp(rest, 0.0, 1.0), 5.0);
            }
        }
        table[static_cast<std::size_t>(entry)] = static_cast<float>(sum / (kQuadrature * kQuadrature));
    }
    return table;
}

}  // namespace

glm::vec3 diffuse_albedo(const core::Brdf& brdf, float cosine) {
    static const std::array<float, kEntries + 1> table = integrate_schlick();
    const float at = std::clamp(cosine, 0.0f, 1.0f) * kEntries;
    const auto low = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(kEntries - 1));
    const float mean = glm::mix(table[low], table[low + 1], at - static_cast<float>(low));
    const glm::vec3 f0 = brdf.dielectric_f0;
    const float brightest = std::max({f0.x, f0.y, f0.z});
    return brdf.diffuse * (1.0f - (brightest + (brdf.dielectric_f90 - brightest) * mean));
}

}  // namespace gather
