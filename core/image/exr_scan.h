// core/image/exr_scan.h: reads an EXR header byte by byte and refuses what must not reach a decoder.
//
// OpenEXR allocates what a header asks for. This scan, free of any library, bounds that first: attributes
// inside the file, sizes within limits, and no more pixels than the file's bytes could expand to. Layout of
// the file: "The OpenEXR File Layout", openexr.com.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace core {

/// Accepts the start of a file that has one flat part within the limits of exr.h.
/// @throws InputError kBadData naming `name`, the element and the limit otherwise
void scan_exr_header(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace core
