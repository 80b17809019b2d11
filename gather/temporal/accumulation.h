// gather/temporal/accumulation.h: frames to a picture.
#pragma once

#include <glm/glm.hpp>
#include <set>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace gather {

/// One sample of a pixel in one frame.
struct FramePixel {
    glm::vec3 direct{0.0f};  ///< Emission seen directly included.
    glm::vec3 indirect_diffuse{0.0f};
    glm::vec3 indirect_specular{0.0f};
    bool surface = false;  ///< What follows is valid only then.
    float depth = 0.0f;
    float distance = 0.0f;
    glm::vec3 normal{0.0f};
    glm::vec3 albedo{0.0f};
    glm::vec3 bent_normal{0.0f};
    float probe_support = 0.0f;
    float steps = 0.0f;  ///< Valid for misses too.
};

/// Sums samples over the frames, and divides by their number. A still camera's history is the sum itself: no
/// tap is rejected.
/// Distinct pixels may be added to from distinct threads.
class Accumulation {
public:
    Accumulation(int width, int height, std::set<std::string> layers);

    /// Forgets all frames: the picture is what follows.
    void clear();

    /// Adds a sample of the frame under way to its pixel.
    void add(std::size_t pixel, const FramePixel& value);

    /// The mean of each pixel's samples, with the layers asked for. @pre every pixel has a sample
    core::Image develop() const;

    static std::uint64_t bytes(int width, int height, const std::set<std::string>& layers);

private:
    struct Sum {
        glm::vec3 direct{0.0f}, indirect_diffuse{0.0f}, indirect_specular{0.0f};
        float count = 0.0f, surface_count = 0.0f;
    };
    struct AuxiliarySum {
        glm::vec3 normal{0.0f}, albedo{0.0f}, bent_normal{0.0f};
        float depth = 0.0f, distance = 0.0f, probe_support = 0.0f, steps = 0.0f;
    };

    int width_;
    int height_;
    std::set<std::string> layers_;
    bool auxiliary_;
    std::vector<Sum> sums_;
    std::vector<AuxiliarySum> auxiliary_sums_;
};

}  // namespace gather
