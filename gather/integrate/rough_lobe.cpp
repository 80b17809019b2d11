#include "gather/integrate/rough_lobe.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/brdf.h"

namespace gather {

namespace {

constexpr int kRoughnessSteps = 8;
constexpr int kCosineSteps = 16;
constexpr int kQuadrature = 64;

/// The functions that a lobe mirrored at the plane of x and z leaves: 1; z, x; 3z^2 - 1, xz, x^2 - y^2.
constexpr std::array<std::size_t, 6> kEven = {0, 2, 3, 6, 7, 8};

/// Coefficients of kEven with Fresnel's term left out, split: f0 times `base` and f90 times `grazing`.
struct Lobe {
    std::array<float, 6> base{}, grazing{};
};

/// @param cosine of the view direction, which lies in the plane of x and z
Lobe project(float roughness, float cosine) {
    const glm::vec3 outgoing(std::sqrt(std::max(0.0f, 1.0f - cosine * cosine)), 0.0f, cosine);
    core::Brdf brdf;
    brdf.f0 = brdf.f90 = glm::vec3(1.0f);
    brdf.alpha = std::max(core::kMinimumAlpha, roughness * roughness);
    Lobe lobe;
    for (int j = 0; j < kQuadrature; ++j) {
        for (int i = 0; i < kQuadrature; ++i) {
            const glm::vec2 u((static_cast<float>(i) + 0.5f) / kQuadrature,
                              (static_cast<float>(j) + 0.5f) / kQuadrature);
            const core::BrdfSample sample = core::sample_specular(brdf, outgoing, u);
            if (!(sample.pdf > 0.0f)) continue;
            const float weight = sample.value.specular.x * sample.incoming.z / sample.pdf;
            const glm::vec3 half = glm::normalize(outgoing + sample.incoming);
            const float rest = std::clamp(1.0f - glm::dot(outgoing, half), 0.0f, 1.0f);
            const float grazing = rest * rest * rest * rest * rest;
            const core::Sh basis = core::sh_basis(sample.incoming);
            for (std::size_t k = 0; k < kEven.size(); ++k) {
                const float value = weight * basis[kEven[k]] / (kQuadrature * kQuadrature);
                lobe.base[k] += (1.0f - grazing) * value;
                lobe.grazing[k] += grazing * value;
            }
        }
    }
    return lobe;
}

class LobeTable {
public:
    LobeTable() {
        for (int r = 0; r <= kRoughnessSteps; ++r) {
            for (int c = 0; c <= kCosineSteps; ++c) {
                const float root = static_cast<float>(c) / kCosineSteps;
                const float cosine = std::max(root * root, 1e-3f);
                lobes_[index(r, c)] = project(static_cast<float>(r) / kRoughnessSteps, cosine);
            }
        }
    }

    /// Bilinear in roughness and the cosine's root: lobes change fastest at grazing angles.
    Lobe at(float roughness, float cosine) const {
        const float r = std::clamp(roughness, 0.0f, 1.0f) * kRoughnessSteps;
        const float c = std::sqrt(std::clamp(cosine, 0.0f, 1.0f)) * kCosineSteps;
        const int r0 = std::min(static_cast<int>(r), kRoughnessSteps - 1);
        const int c0 = std::min(static_cast<int>(c), kCosineSteps - 1);
        Lobe result;
        for (int dr = 0; dr < 2; ++dr) {
            for (int dc = 0; dc < 2; ++dc) {
                const float weight = std::abs(1.0f - static_cast<float>(dr) - (r - static_cast<float>(r0))) *
                                     std::abs(1.0f - static_cast<float>(dc) - (c - static_cast<float>(c0)));
                const Lobe& lobe = lobes_[index(r0 + dr, c0 + dc)];
                for (std::size_t k = 0; k < kEven.size(); ++k) {
                    result.base[k] += weight * lobe.base[k];
                    result.grazing[k] += weight * lobe.grazing[k];
                }
            }
        }
        return result;
    }

private:
    static std::size_t index(int r, int c) { return static_cast<std::size_t>(r * (kCosineSteps + 1) + c); }
    std::array<Lobe, (kRoughnessSteps + 1) * (kCosineSteps + 1)> lobes_;
};

/// The functions kEven of a frame, as combinations of the world's: products of directions are symmetric
/// matrices without a trace, and those five numbers.
class TurnedBasis {
public:
    TurnedBasis(const glm::vec3& x, const glm::vec3& y, const glm::vec3& z) {
        functions_[0][0] = 1.0f;
        set_linear(1, z);
        set_linear(2, x);
        // With the constants of core::sh_basis.
        set_quadratic(3, 0.315391565f * 3.0f, z, z);
        set_quadratic(4, 1.092548431f, x, z);
        set_quadratic(5, 0.546274215f, x, x);
        set_quadratic(5, -0.546274215f, y, y);
    }
    const core::Sh& operator[](std::size_t k) const { return functions_[k]; }

private:
    void set_linear(std::size_t k, const glm::vec3& axis) {
        functions_[k][1] = axis.y;
        functions_[k][2] = axis.z;
        functions_[k][3] = axis.x;
    }
    /// Adds scale (a . d)(b . d), up to a constant that the others of its function make up for.
    void set_quadratic(std::size_t k, float scale, const glm::vec3& a, const glm::vec3& b) {
        core::Sh& sh = functions_[k];
        sh[4] += scale * (a.x * b.y + a.y * b.x) / 1.092548431f;
        sh[5] += scale * (a.y * b.z + a.z * b.y) / 1.092548431f;
        sh[7] += scale * (a.x * b.z + a.z * b.x) / 1.092548431f;
        const float xx = scale * a.x * b.x, yy = scale * a.y * b.y, zz = scale * a.z * b.z;
        sh[6] += (2.0f * zz - xx - yy) / (6.0f * 0.315391565f);
        sh[8] += (xx - yy) / (2.0f * 0.546274215f);
    }
    std::array<core::Sh, 6> functions_{};
};

}  // namespace

core::ShColor rough_lobe(const core::SurfacePoint& surface, const glm::vec3& outgoing) {
    static const LobeTable table;
    const glm::vec3& normal = surface.frame.normal;
    const float cosine = glm::dot(normal, outgoing);
    const Lobe lobe = table.at(std::sqrt(surface.brdf.alpha), cosine);
    const glm::vec3 along = outgoing - cosine * normal;
    const float length = glm::length(along);
    // Seen from straight above the lobe is round: any axis will do.
    const glm::vec3 x = length > 1e-6f ? along / length : surface.frame.tangent;
    const TurnedBasis basis(x, glm::cross(normal, x), normal);
    core::ShColor result{};
    for (std::size_t k = 0; k < kEven.size(); ++k) {
        const glm::vec3 weight = surface.brdf.f0 * lobe.base[k] + surface.brdf.f90 * lobe.grazing[k];
        for (std::size_t i = 0; i < core::kShCount; ++i) result[i] += weight * basis[k][i];
    }
    return result;
}

}  // namespace gather
