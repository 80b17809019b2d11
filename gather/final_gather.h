// gather/final_gather.h: pictures from radiance cached in probes on the screen.
//
// Wright, "Radiance Caching for Real-Time Global Illumination", SIGGRAPH 2021 (Advances in Real-Time
// Rendering). Incoming light is coherent, normals are not: light is sampled sparsely by octahedral probes on
// the screen, filtered in probe space, and integrated over each pixel's BRDF. Direct light takes shadow rays
// at full resolution.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "core/render/renderer.h"
#include "gather/plan.h"
#include "gather/settings.h"

namespace gather {

/// Layers it can write beside the beauty: Depth, Normal, Albedo, Direct, IndirectDiffuse, IndirectSpecular,
/// HitDistance (of camera rays), BentNormal, Steps, Probes (where probes stand, by level: white uniform,
/// green and orange refined, red filled), RaysPerTexel and ProbeHitDistance (a tile's uniform probe, its map
/// spread over the tile), ProbeWeight (sum of a pixel's plane weights), FilmSamples. Those of probes are the
/// last frame's. Direct + IndirectDiffuse + IndirectSpecular is the beauty.
class FinalGather : public core::Renderer {
public:
    /// @param plan made from the same scene, size and settings
    FinalGather(const Settings& settings, const Plan& plan) : settings_(settings), plan_(plan) {}

    /// @throws core::InputError for unknown layers; core::Interrupted when asked to stop. A time budget ends
    /// after the frame that passes it. RenderInputs::crop is honoured: the whole picture's probes are made
    /// and the crop is cut from it.
    core::Frame render(const core::RenderInputs& inputs) override;

    /// Most bytes that a picture of this size takes in memory under any plan, its layers included.
    static std::uint64_t picture_bytes(int width, int height, const Settings& settings,
                                       const std::set<std::string>& aovs);

private:
    Settings settings_;
    Plan plan_;
};

}  // namespace gather
