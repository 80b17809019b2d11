// core/image/block_errors.h: a picture's error by blocks of pixels, and the intervals that follow from it.
//
// Blocks, not pixels, count as independent, since neighbours may share noise. Two intervals come from them.
//
// mean_error: the error of one picture. Delete-one jackknife over the blocks. It takes the variation of the
// error over the picture for uncertainty, too, so that it is rather too wide.
//
// paired_difference: of two methods on the same view, against the same reference. The square of the
// reference's noise is in both, and cancels block by block. What the view itself makes of the difference (a
// silhouette that one of them misses) is no uncertainty, either: as much of it as independent renderings of
// the same methods foretell is taken away before the scatter of the blocks is counted. Each block is foretold
// by a least-squares fit to all others (Allen, "The Relationship Between Variable Selection and Data
// Augmentation and a Method for Prediction", Technometrics 1974); whatever the prediction is worth, a block's
// distance from it is on average no less than the block's own noise, so that the interval is never too
// narrow by it. Student's t, degrees of freedom after Satterthwaite, "An Approximate Distribution of
// Estimates of Variance Components", Biometrics Bulletin 1946: few where a few blocks hold most of the
// scatter. What is too rare to have been seen in any block is in neither interval.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/image/error_interval.h"

namespace core {

/// Square blocks that cover a picture, smaller at the right and lower edge: 16 x 16 pixels, halved until
/// there are 32 blocks or the blocks are pixels.
class PixelBlocks {
public:
    /// @pre both > 0
    PixelBlocks(int picture_width, int picture_height);

    int columns() const { return columns_; }
    int rows() const { return rows_; }

    /// The block of a pixel; both count row by row.
    std::size_t of(std::size_t pixel) const;

private:
    int width_ = 0, size_ = 0, columns_ = 0, rows_ = 0;
};

/// Errors of a picture's pixels, summed over its blocks.
struct BlockErrors {
    int columns = 0, rows = 0;   ///< Of blocks.
    std::vector<double> sums;    ///< Row by row.
    std::vector<double> pixels;  ///< In each block.

    explicit BlockErrors(const PixelBlocks& blocks);
    BlockErrors() = default;
};

/// (1 - share) a + share b, block by block: the error between two rungs of a ladder. @pre equal blocks
BlockErrors mixed(const BlockErrors& a, const BlockErrors& b, double share);

/// Adds `weight` times `other`, block by block; an empty `sum` becomes that. @pre equal blocks otherwise
void accumulate(BlockErrors& sum, const BlockErrors& other, double weight);

/// Mean over the pixels, with its jackknife interval; unbounded where there is one block, NaN where a sum is
/// not finite.
ErrorInterval mean_error(const BlockErrors& errors);

/// Mean of a - b over the pixels, with its paired interval, which leaves 0 out where the methods can be told
/// apart; unbounded where there is one block, NaN where a sum is not finite.
/// @param predictors errors of either method on the same view against the same reference, from other random
/// numbers than those of `a` and `b`; may be empty. Few: each costs a degree of freedom.
/// @param hidden_share of the variance, added to it: the reference's noise e also makes 2 (I_b - I_a) e,
/// which predictors share. Samples of a and b over those of the reference.
/// @pre equal blocks
ErrorInterval paired_difference(const BlockErrors& a, const BlockErrors& b,
                                std::span<const BlockErrors> predictors, double hidden_share);

}  // namespace core
