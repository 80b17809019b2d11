// core/scene/sky.h: light from infinitely far away: nothing, a constant, or a latitude-longitude picture.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/support/hash.h"

namespace core {

/// Radiance by direction, with importance sampling. Immutable once built; thread-safe.
///
/// Mapping of a picture: +Y is the top row; the middle column looks along -Z, u grows towards +X
/// (so the picture is seen from inside with east to the right); `rotation` turns it about +Y.
class Sky {
public:
    /// Black.
    Sky() = default;

    /// The same radiance from everywhere, cd/m^2. @pre finite, >= 0
    static Sky constant(const glm::vec3& radiance);

    /// @param image beauty in R, G, B, cd/m^2. @throws InputError for texels below 0, above 1e20 or not
    /// finite, by name.
    static Sky latitude_longitude(const Image& image, float rotation, const std::string& name);

    /// Reads a .hdr or .exr. @throws InputError
    static Sky read(const std::filesystem::path& path, float rotation);

    bool black() const { return black_; }

    /// Radiance from `direction` (unit), bilinear between texels.
    glm::vec3 radiance(const glm::vec3& direction) const;

    struct Sample {
        glm::vec3 direction{0.0f};
        glm::vec3 radiance{0.0f};
        float pdf = 0.0f;  ///< Per steradian; 0: no sample.
    };
    /// A direction with a pdf that follows the luminance; positive wherever radiance() is.
    Sample sample(const glm::vec2& u) const;
    float pdf(const glm::vec3& direction) const;

    /// Adds all that decides the radiance to a content hash.
    void add_to(Hasher& hasher) const;

    /// Mean luminance over the sphere, cd/m^2.
    float mean_luminance() const { return mean_luminance_; }

private:
    friend struct SkySplit split_sky(const Sky& sky, float ratio);

    struct Map;  // The texels and their distribution.

    /// Takes size, texels and rotation, and derives the rest.
    static Sky from_map(std::shared_ptr<Map> map);

    bool black_ = true;
    glm::vec3 constant_{0.0f};
    float mean_luminance_ = 0.0f;
    std::shared_ptr<const Map> map_;
};

/// A sky as a sum: base.radiance(d) + peaks.radiance(d) is the whole's in every direction, up to rounding.
struct SkySplit {
    Sky base;
    Sky peaks;
};

/// Puts what is brighter than `ratio` times the mean luminance into `peaks`, texel by texel and keeping its
/// colour. Where nothing is, `base` shares the texels of `sky` and `peaks` is black; at 0 it is the reverse.
/// @param ratio >= 0
SkySplit split_sky(const Sky& sky, float ratio);

}  // namespace core
