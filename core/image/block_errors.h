// core/image/block_errors.h: the error of a picture, summed over blocks of pixels: what intervals are made
// of.
//
// Blocks, not pixels, count as independent, since neighbours may share noise. Two intervals come from them.
//
// mean_error: the error of one picture. Delete-one jackknife over all blocks. It takes the variation of the
// error over the picture for uncertainty, too, so that it is rather too wide.
//
// paired_difference: of two methods on the same view, against the same reference. Whatever both share cancels
// block by block: the square of the reference's noise, and what makes a block hard for either. Variance
// within groups of neighbouring blocks (a stratified sample: Cochran, "Sampling Techniques", Wiley 1977,
// chapter 5) leaves out what still varies slowly over the picture; degrees of freedom after Satterthwaite,
// "An Approximate Distribution of Estimates of Variance Components", Biometrics Bulletin 1946, so that the
// interval is wide where a few blocks hold most of the difference.
#pragma once

#include <cstddef>
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

/// Mean over the pixels, with its jackknife interval; unbounded where there is one block, NaN where a sum is
/// not finite.
ErrorInterval mean_error(const BlockErrors& errors);

/// Mean of a - b over the pixels, with its paired interval; unbounded where there is one block, NaN where a
/// sum is not finite. The interval leaves 0 out where the methods can be told apart. @pre equal blocks
ErrorInterval paired_difference(const BlockErrors& a, const BlockErrors& b);

}  // namespace core
