// core/image/hdr.h: Radiance pictures (.hdr), the form in which most skies come.
//
// Ward, "Real Pixels", Graphics Gems II, 1991, and the format's description in the Radiance reference manual.
// A reader of our own, for what a lenient decoder lets pass: a file that ends early, scanlines of the wrong
// length, XYZE data and the EXPOSURE that a value must be divided by.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/image/image.h"

namespace core {

/// Reads R, G, B from a .hdr file: mantissa / 256 x 2^(exponent - 128), divided by the header's EXPOSURE.
/// Only the usual orientation `-Y height +X width` is taken.
/// @throws InputError kNoInput where no regular file can be opened; kBadData for a damaged file, more than
/// 2^28 pixels, another orientation or another format than 32-bit_rle_rgbe, by name
Image read_hdr(const std::filesystem::path& path);

/// The same for bytes at hand; `name` is used in messages.
Image decode_hdr(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace core
