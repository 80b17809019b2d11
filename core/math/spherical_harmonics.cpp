#include "core/math/spherical_harmonics.h"

#include "core/math/sampling.h"

namespace core {

Sh sh_basis(const glm::vec3& d) {
    return {0.282094792f,
            0.488602512f * d.y,
            0.488602512f * d.z,
            0.488602512f * d.x,
            1.092548431f * d.x * d.y,
            1.092548431f * d.y * d.z,
            0.315391565f * (3.0f * d.z * d.z - 1.0f),
            1.092548431f * d.x * d.z,
            0.546274215f * (d.x * d.x - d.y * d.y)};
}

Sh sh_clamped_cosine(const glm::vec3& normal) {
    Sh result = sh_basis(normal);
    for (std::size_t i = 0; i < kShCount; ++i) {
        result[i] *= i == 0 ? kPi : i < 4 ? 2.0f * kPi / 3.0f : 0.25f * kPi;
    }
    return result;
}

}  // namespace core
