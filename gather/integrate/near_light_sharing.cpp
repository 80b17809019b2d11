#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/support/parallel.h"
#include "gather/integrate/bent_normal.h"

namespace gather {

namespace {

/// Pixels share whose shading normals have at least this cosine: their rays follow about the same one.
constexpr float kLeastNormalCosine = 0.95f;

/// Where the lobe reflects what is near, those share whose alpha and f0 differ by no more.
constexpr float kSameLobe = 0.02f;

/// Near light of some frame, before any is shared.
class Sharing {
public:
    Sharing(const VisibleSurfaces& visible, int radius, float plane_sharpness,
            const std::vector<NearLight>& own)
        : visible_(visible), radius_(radius), plane_sharpness_(plane_sharpness), own_(own) {}

    /// @param agreement set to that of all that share
    NearLight shared(std::size_t pixel, ProbeAgreement& agreement) const {
        const auto width = static_cast<std::size_t>(visible_.width);
        const glm::ivec2 at(pixel % width, pixel / width);
        const glm::ivec2 from = glm::max(at - radius_, glm::ivec2(0));
        const glm::ivec2 to = glm::min(at + radius_, glm::ivec2(visible_.width, visible_.height) - 1);
        const bool alone = own_[pixel].kind == NearLight::Kind::kAlone;
        NearLight result = own_[pixel];
        result.found = result.held = {};
        agreement = {};
        float total = 0.0f, open = 0.0f, compared = 0.0f;
        for (int y = from.y; y <= to.y; ++y) {
            for (int x = from.x; x <= to.x; ++x) {
                const std::size_t there = visible_.index(x, y);
                if (there != pixel && !share_a_plane(pixel, there)) continue;
                const NearLight& other = own_[there];
                // An open one says that the probes are right, and one that is alone has none to ask.
                if (other.kind == NearLight::Kind::kOpen && alone) continue;
                const float weight = tent(x - at.x) * tent(y - at.y);
                total += weight;
                if (other.kind == NearLight::Kind::kOpen) open += weight;
                add(weight, other.found, result.found);
                if (other.kind != NearLight::Kind::kCompared || alone) continue;
                compared += weight;
                add(weight, other.held, result.held);
                agreement.found += weight * other.agreement.found;
                agreement.held += weight * other.agreement.held;
            }
        }
        for (NearLight::Light* light : {&result.found, &result.held}) {
            light->irradiance /= total;
            light->specular /= total;
        }
        result.open_share = open / total;
        result.compared_share = compared / total;
        return result;
    }

private:
    float tent(int offset) const { return static_cast<float>(radius_ + 1 - std::abs(offset)); }

    bool share_a_plane(std::size_t pixel, std::size_t there) const {
        if (!visible_.surface(there)) return false;
        const core::SurfacePoint& point = visible_.points[pixel];
        const core::SurfacePoint& other = visible_.points[there];
        return glm::dot(point.frame.normal, other.frame.normal) >= kLeastNormalCosine &&
               (!reflects_near_light(point) || is_same_lobe(point.brdf, other.brdf)) &&
               is_same_plane(point, visible_.plane_scale(pixel), other, plane_sharpness_);
    }

    static bool is_same_lobe(const core::Brdf& one, const core::Brdf& other) {
        const glm::vec3 f0 = glm::abs(one.f0 - other.f0);
        return std::abs(one.alpha - other.alpha) <= kSameLobe && std::max({f0.x, f0.y, f0.z}) <= kSameLobe;
    }

    static void add(float weight, const NearLight::Light& light, NearLight::Light& sum) {
        sum.irradiance += weight * light.irradiance;
        sum.specular += weight * light.specular;
    }

    const VisibleSurfaces& visible_;
    int radius_;
    float plane_sharpness_;
    const std::vector<NearLight>& own_;
};

/// By pixel: whether any of its row within `radius` was compared.
void find_compared_in_row(const VisibleSurfaces& visible, const std::vector<NearLight>& own, int radius,
                          std::vector<std::uint8_t>& result) {
    result.resize(own.size());
    const auto width = static_cast<std::size_t>(visible.width);
    core::parallel_for(static_cast<std::size_t>(visible.height), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            const std::size_t first = y * width, last = first + width;
            std::fill(result.begin() + static_cast<std::ptrdiff_t>(first),
                      result.begin() + static_cast<std::ptrdiff_t>(last), std::uint8_t{0});
            for (std::size_t pixel = first; pixel < last; ++pixel) {
                if (own[pixel].kind != NearLight::Kind::kCompared) continue;
                const std::size_t reach = static_cast<std::size_t>(radius);
                const std::size_t from = pixel - std::min(reach, pixel - first);
                const std::size_t to = std::min(pixel + reach + 1, last);
                std::fill(result.begin() + static_cast<std::ptrdiff_t>(from),
                          result.begin() + static_cast<std::ptrdiff_t>(to), std::uint8_t{1});
            }
        }
    });
}

/// @param compared_in_row as find_compared_in_row() finds it
bool is_beside_compared(const VisibleSurfaces& visible, std::size_t pixel, int radius,
                        const std::vector<std::uint8_t>& compared_in_row) {
    const auto width = static_cast<std::size_t>(visible.width);
    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    for (int row = std::max(0, y - radius); row <= std::min(y + radius, visible.height - 1); ++row) {
        if (compared_in_row[visible.index(x, row)]) return true;
    }
    return false;
}

}  // namespace

void share_near_light(const VisibleSurfaces& visible, const IntegrateSettings& settings,
                      float plane_sharpness, std::uint32_t frame, const std::vector<BentNormal>& bent,
                      NearHistory& history, std::vector<NearLight>& near_light) {
    std::vector<NearLight>& own = history.before_sharing;
    near_light.swap(own);
    near_light.resize(own.size());
    const Sharing sharing(visible, settings.near_field_radius, plane_sharpness, own);
    history.openness.resize(own.size(), 0.0f);
    history.agreement.resize(own.size());
    history.compared.resize(own.size(), 0);
    const int radius = settings.near_field_radius;
    find_compared_in_row(visible, own, radius, history.compared_in_row);
    const auto frames_before = static_cast<float>(frame);
    core::parallel_for(own.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            float& openness = history.openness[pixel];
            openness += (bent[pixel].visibility - openness) / (frames_before + 1.0f);
            if (own[pixel].kind == NearLight::Kind::kCompared) history.compared[pixel] = 1;
            // What is open far and wide, as most is, has nothing to share.
            const bool open = own[pixel].kind == NearLight::Kind::kOpen;
            if (!visible.surface(pixel) ||
                (open && !is_beside_compared(visible, pixel, radius, history.compared_in_row))) {
                near_light[pixel] = own[pixel];
                continue;
            }
            ProbeAgreement found;
            near_light[pixel] = sharing.shared(pixel, found);
            ProbeAgreement& sum = history.agreement[pixel];
            // Frames that found all open, and compared nothing, agreed; their light was about what it is now.
            const float before = sum.held > 0.0f ? 0.0f : frames_before * found.held;
            sum.found += found.found + before;
            sum.held += found.held + before;
        }
    });
}

}  // namespace gather
