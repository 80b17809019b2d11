// core/image/ssim.h: structural similarity of two pictures as a screen shows them.
//
// Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
// Similarity", IEEE Transactions on Image Processing 2004. We differ at the border: windows are cut off there
// and their weights scaled to a sum of 1, so that pictures of any size have a value.
#pragma once

#include <glm/glm.hpp>
#include <span>

namespace core {

/// Mean SSIM over all pixels, in [-1, 1]; 1 for equal pictures. Windows of 11 x 11 pixels, Gaussian weights
/// of sigma 1.5, K1 = 0.01, K2 = 0.03, range 1. Of radiance, it compares one value a pixel: exposed with the
/// automatic_exposure of the *reference*, ACES, sRGB, then 0.2126 R' + 0.7152 G' + 0.0722 B'. NaN where a
/// value is not finite. Same bits at any thread count.
/// @pre test.size() == reference.size() == width * height > 0
double ssim(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width, int height);

}  // namespace core
