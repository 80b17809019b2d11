// sdf/vdb_scan.h: walks a .vdb byte by byte and refuses what must not reach OpenVDB.
//
// OpenVDB believes what a file says: sizes of strings, chunks and lists are allocated and filled before they
// are compared with anything. This scan, free of any library, bounds all of them first. It follows the file
// format 222 to 224 (OpenVDB 2.0 to 10): header, metadata, and of each grid its descriptor, metadata, map,
// topology and buffers. What lies inside compressed chunks is not looked at; their headers are.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace sdf {

/// Accepts a whole file whose grids are trees of the usual shape (5, 4, 3) with bools, masks, 32- or 64-bit
/// integers, floats, doubles or vectors of three.
/// @throws core::InputError naming `name` and the grid: kBadData for anything else and for whatever does not
/// fit together, kOutOfMemory if the grids would take far more memory than such a file should
void scan_vdb(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace sdf
