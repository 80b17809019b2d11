// core/scene/mtl_file.h: the material libraries of OBJ files, brought to the one material that we have.
//
// Alias|Wavefront, "Advanced Visualizer" appendix B2, 1995, with the Pr, Pm and norm of its physically based
// extension (exocortex, 2014). Highlights of the Phong kind are approximated:
// - Ks k is a dielectric with a reflectance of 0.08 k head on, so that the customary 0.5 is glass and
// plastic,
//   and 0 is Lambert; so are illum 0 and 1, whatever Ks says.
// - Ns n is the roughness sqrt(alpha) with alpha^2 = 2 / (n + 2): Walter et al., "Microfacet Models for
//   Refraction through Rough Surfaces", 2007, section 5.2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "core/scene/material.h"
#include "core/scene/warning_list.h"

namespace core {

/// A picture that a material refers to, with its options -s, -o and -clamp.
struct MtlTexture {
    std::string file;      ///< As a path from the library's folder, with slashes.
    std::size_t line = 0;  ///< For messages.
    bool clamp = false;
    glm::mat3x2 uv_from_mesh_uv{{1, 0}, {0, 1}, {0, 0}};  ///< Where v = 0 is the top.
};

struct MtlMaterial {
    Material material;  ///< Complete but for the textures.
    std::optional<MtlTexture> color, emission, normal;
    /// Whether map_Ke stands without Ke: without the picture, nothing shines.
    bool emission_is_texture_alone = false;
};

using MtlLibrary = std::map<std::string, MtlMaterial, std::less<>>;

/// Adds the materials of an MTL file held in memory; of equal names the first counts. Colours are linear and
/// as they are, Ke in cd/m^2. What is left out is warned about. @throws InputError (kBadData) naming the line
void read_mtl(std::span<const std::uint8_t> bytes, const std::string& file_name, MtlLibrary& library,
              WarningList& warnings);

}  // namespace core
