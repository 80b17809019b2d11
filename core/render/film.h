// core/render/film.h: where the samples of a picture are summed, batch by batch.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <set>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace core {

/// What one path brings home for its pixel.
struct FilmSample {
    glm::vec3 radiance{0.0f};  ///< All of it.
    glm::vec3 direct{0.0f};
    glm::vec3 indirect_diffuse{0.0f};
    bool hit = false;  ///< The camera ray met a surface; the rest is only valid then.
    float depth = 0.0f;
    float distance = 0.0f;
    glm::vec3 normal{0.0f};
    glm::vec3 albedo{0.0f};
    float steps = 0.0f;  ///< Of the camera ray; valid for misses too.
};

/// Sums over samples, for one picture. Distinct pixels may be added to from distinct threads. The order of
/// adding within a pixel decides the last bits.
class Film {
public:
    /// @param layers beside the beauty; names as in PathTracer.
    Film(int width, int height, int batch_count, const std::set<std::string>& layers);

    /// Memory that the same film and the picture developed from it take.
    static std::uint64_t bytes(int width, int height, int batch_count, const std::set<std::string>& layers);

    /// True if only the beauty is wanted: then `radiance` and `hit` of a sample are enough.
    bool beauty_only() const { return !auxiliary_; }

    void add(std::size_t pixel, int batch, const FilmSample& sample);

    /// The picture after `sample_count` samples a pixel, dealt to the batches in turn.
    Image develop(int sample_count) const;

private:
    struct Auxiliary {
        glm::vec3 direct{0.0f}, indirect_diffuse{0.0f}, normal{0.0f}, albedo{0.0f};
        float depth = 0.0f, distance = 0.0f, steps = 0.0f;
    };

    bool wants(const char* layer) const { return layers_.count(layer) != 0; }
    void develop_variance(const std::vector<glm::vec3>& mean, int sample_count, Image& image) const;
    void develop_auxiliary(const std::vector<glm::vec3>& mean, int sample_count, Image& image) const;

    int width_;
    int height_;
    int batch_count_;
    std::set<std::string> layers_;
    bool auxiliary_;
    std::vector<glm::vec3> radiance_;  ///< Pixel-major, one sum a batch.
    std::vector<std::uint32_t> hit_count_;
    std::vector<Auxiliary> sums_;  ///< Empty if only the beauty (and its variance) is wanted.
};

}  // namespace core
