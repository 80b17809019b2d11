// core/image/temporal.h: how restless a sequence of pictures is, and how fast it follows a change.
//
// The camera stands still; every frame has its own seed. A frame is linear radiance, row-major; all frames of
// a call have equal sizes. Y is Rec. 709 luminance. Results are NaN where a value is not finite.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

namespace core {

using Frame = std::vector<glm::vec3>;

/// sigma / mu: mean over pixels of the standard deviation of Y over the frames (unbiased variance) over
/// (|mean Y| + 0.01). @pre at least 2 frames
double temporal_deviation(std::span<const Frame> frames);

/// Mean of |T(I_t) - T(I_t-1)| over pixels and pairs of frames in a row, in [0, 1]. T is what a screen shows:
/// exposure `ev`, ACES, sRGB, then 0.2126 R' + 0.7152 G' + 0.0722 B'. The reference's own flicker is to be
/// subtracted by the caller. @pre at least 2 frames
double flicker(std::span<const Frame> frames, float ev);

/// What counts as having followed a change.
struct ReactionOptions {
    double tolerance = 0.05;  ///< Share of the change that may remain, (0, 1).
    /// Side of the blocks over which Y is averaged, pixels: noise of single pixels is not a late reaction.
    int block = 16;
};

/// Frames until a sequence has followed a change, such as a light that is switched: the smallest n for which
/// all frames from n on have sum |Y - Y_after| <= tolerance x sum |Y_before - Y_after|, sums over block
/// means. 0 where frames[0], the first after the change, has; nothing where the last frame has not, where a
/// value is not finite, or where nothing changed. @param before, after what it converges to without and with
/// the change
/// @pre there are frames; all pictures are rows of `width` pixels; block > 0
std::optional<std::size_t> reaction_frames(std::span<const Frame> frames, const Frame& before,
                                           const Frame& after, int width,
                                           const ReactionOptions& options = {});

}  // namespace core
