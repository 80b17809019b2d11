// gather/temporal/accumulation.h: frames to a picture.
#pragma once

#include <glm/glm.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace gather {

/// One sample of a pixel in one frame.
struct FramePixel {
    glm::vec3 direct{0.0f};  ///< Emission seen directly included.
    glm::vec3 indirect_diffuse{0.0f};
    glm::vec3 indirect_specular{0.0f};
    /// Control variates: of mean 0, and the picture takes a share of them.
    glm::vec3 diffuse_control{0.0f};
    glm::vec3 specular_control{0.0f};
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
    /// @param controlled frames bring control variates
    Accumulation(int width, int height, std::set<std::string> layers, bool controlled);

    /// Forgets all frames: the picture is what follows.
    void clear();

    /// Adds a sample of the frame under way to its pixel.
    void add(std::size_t pixel, const FramePixel& value);

    /// The mean of each pixel's samples, with the layers asked for. @pre every pixel has a sample
    /// @param control_shares of each pixel, how much of its control variates is taken; empty if not
    /// controlled
    core::Image develop(std::span<const float> control_shares) const;

    static std::uint64_t bytes(int width, int height, const std::set<std::string>& layers);
    static constexpr std::size_t kControlBytes =
        2 * sizeof(glm::vec3);  ///< A pixel's, besides, if controlled.

private:
    struct Sum {
        glm::vec3 direct{0.0f}, indirect_diffuse{0.0f}, indirect_specular{0.0f};
        float count = 0.0f, surface_count = 0.0f;
    };
    struct ControlSum {
        glm::vec3 diffuse{0.0f}, specular{0.0f};
    };
    static_assert(sizeof(ControlSum) == kControlBytes);
    struct AuxiliarySum {
        glm::vec3 normal{0.0f}, albedo{0.0f}, bent_normal{0.0f};
        float depth = 0.0f, distance = 0.0f, probe_support = 0.0f, steps = 0.0f;
    };

    int width_;
    int height_;
    std::set<std::string> layers_;
    bool auxiliary_;
    bool controlled_;
    std::vector<Sum> sums_;
    std::vector<ControlSum> control_sums_;
    std::vector<AuxiliarySum> auxiliary_sums_;
};

}  // namespace gather
