// core/render/light_sampler.h: which light to sample from a point, and with what density.
//
// All light sources of a scene in groups: each punctual light, the sun, the sky, and each instance with
// emissive triangles. A group is chosen by an estimate of the irradiance it could send, half of the
// probability shared evenly so that a bright source behind a wall cannot starve a weak one in view; then a
// direction or a point within the group. Every choice is unbiased: a group gets probability 0 only where it
// cannot send light.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/sampling.h"
#include "core/scene/scene.h"

namespace core {

/// A point that receives light through the hemisphere about its geometric normal.
struct LightReceiver {
    glm::vec3 position{0.0f};
    glm::vec3 normal{0.0f, 0.0f, 1.0f};
};

/// The lights a sampler is to know, beside all of scene.lights, which always belong.
struct LightSubset {
    const Sky* sky = nullptr;            ///< In place of the scene's; null: no sky.
    std::vector<std::uint8_t> emitters;  ///< By instance: whether its emissive triangles are sampled.
};

/// Immutable once built; thread-safe. Cost of a choice is linear in the number of groups.
class LightSampler {
public:
    /// @pre `scene` outlives the sampler.
    explicit LightSampler(const Scene& scene);

    /// @pre `scene` and `subset.sky` outlive the sampler; subset.emitters has one entry per instance.
    LightSampler(const Scene& scene, const LightSubset& subset);

    bool empty() const { return groups_.empty(); }
    std::size_t group_count() const { return groups_.size(); }

    /// What turns an importance into a probability at one receiver: p = scale x importance + floor.
    struct Selection {
        float scale = 0.0f;
        float floor = 0.0f;
    };

    struct Sample {
        glm::vec3 direction{0.0f};  ///< Unit, towards the light.
        float distance = 0.0f;      ///< Infinite for sky and sun.
        glm::vec3 radiance{0.0f};   ///< Irradiance at normal incidence if `delta`.
        float pdf = 0.0f;           ///< Per steradian, or the bare probability if `delta`; 0: no sample.
        bool delta = false;
        std::uint32_t instance = kNoIndex;  ///< Of an emissive triangle.
    };

    /// The probabilities of all groups as seen from `receiver`.
    Selection selection(const LightReceiver& receiver) const;

    /// @param u in [0, 1): x chooses the group, and what that leaves of it the place within. So points that
    /// are stratified in two dimensions stay so within each group.
    Sample sample(const LightReceiver& receiver, const Selection& selection, const glm::vec2& u) const;

    /// Density with which sample() would have chosen the direction of a ray that hit an emissive triangle; 0
    /// for an instance that is not sampled.
    /// @param distance from the receiver to the hit; `direction` unit, from the receiver.
    float emitter_pdf(const LightReceiver& receiver, const Selection& selection, std::uint32_t instance,
                      std::uint32_t triangle, const glm::vec3& direction, float distance) const;

    /// Whether the instance's emissive triangles are among what sample() chooses from.
    bool samples_emitter(std::uint32_t instance) const { return group_of_instance_[instance] != kNoIndex; }

    /// Whether any part of the triangle may emit, be it sampled or not.
    bool emits(std::uint32_t instance, std::uint32_t triangle) const;

    /// Light that a ray which leaves the scene meets. With `receiver` and `selection` of where it started,
    /// each source is weighted against light sampling by the power heuristic; without, it counts in full.
    glm::vec3 escaped_radiance(const glm::vec3& direction) const;
    glm::vec3 weighted_escaped_radiance(const LightReceiver& receiver, const Selection& selection,
                                        const glm::vec3& direction, float direction_pdf) const;

private:
    enum class Kind : std::uint8_t { kLight, kSky, kEmitter };

    struct Group {
        Kind kind = Kind::kLight;
        std::uint32_t index = 0;  ///< Of the light in the scene, or of the emitter.
        glm::vec3 center{0.0f};
        float radius = 0.0f;
        float strength = 0.0f;  ///< Luminous power over pi (emitters), irradiance (sky): see importance().
    };

    struct EmissiveTriangle {
        glm::vec3 origin{0.0f}, edge1{0.0f}, edge2{0.0f}, normal{0.0f};
        float area = 0.0f;
        std::uint32_t triangle = 0;
    };

    /// The emissive triangles of one instance.
    struct Emitter {
        std::uint32_t instance = 0;
        std::vector<EmissiveTriangle> triangles;
        std::vector<std::uint32_t> entry_of_triangle;  ///< kNoIndex where a triangle does not emit.
        Distribution1D distribution;                   ///< Over `triangles`, by power.
    };

    /// @param least_emission by material, luminance
    void add_emitter(std::uint32_t instance, bool sampled, std::span<const float> least_emission);
    /// A group and its probability; null: none can send light. `remainder` is u_group stretched to [0, 1)
    /// over the group's share.
    struct Choice {
        const Group* group = nullptr;
        float probability = 0.0f;
        float remainder = 0.0f;
    };
    Choice choose(const LightReceiver& receiver, const Selection& selection, float u_group) const;
    Sample sample_group(const Choice& choice, const LightReceiver& receiver, const glm::vec2& u) const;
    float importance(const Group& group, const LightReceiver& receiver) const;
    float group_probability(const Group& group, const LightReceiver& receiver,
                            const Selection& selection) const;
    Sample sample_emitter(const Emitter& emitter, const LightReceiver& receiver, const glm::vec2& u) const;

    const Scene& scene_;
    const Sky* sky_;  ///< Null: none.
    std::vector<Group> groups_;
    std::vector<Emitter> emitters_;
    std::vector<std::uint32_t> group_of_instance_;  ///< kNoIndex where nothing is sampled.
    std::vector<std::uint8_t> may_emit_;            ///< By instance: any part's material emits.
    std::vector<std::uint32_t> escaped_groups_;     ///< Groups that a ray can meet by missing everything.
};

/// Weight of a sample drawn with `pdf` against another strategy that has `other_pdf` for it (Veach and
/// Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, power 2).
inline float power_heuristic(float pdf, float other_pdf) {
    const float ratio = other_pdf / pdf;
    return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace core
