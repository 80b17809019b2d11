// sdf/sampled_field.h: one mesh's baked field as plain data: what a .vdb file holds, without OpenVDB.
//
// Samples lie on the lattice p = origin + voxel_size * ijk of the mesh's local space, in leaves of 8^3. Only
// a narrow band round the surface is stored ("active" samples); elsewhere the field is +-background.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace sdf {

/// Samples along one side of a leaf.
inline constexpr int kLeafSide = 8;
inline constexpr int kLeafSize = kLeafSide * kLeafSide * kLeafSide;

/// Half-width of the stored band, in voxels; also the background value.
inline constexpr float kBandVoxels = 4.0f;

/// No field spans more voxels than this along a side; its lattice coordinates lie within half of it and the
/// band.
inline constexpr int kMostVoxelsAlongSide = 2048;

/// Half the thickness that a sheet (or a solid too thin for the lattice) is given, in voxels. Under trilinear
/// sampling the inside of a sheet needs 0.50 to be ray-tight in every orientation, borders and wires 0.71 and
/// specks 0.87. More costs nothing but time: where a ray meets the shell, the triangles within decide.
inline constexpr double kHalfThicknessVoxels = 0.9;

/// What the components of a mesh turned out to be.
enum class MeshClass : std::uint8_t {
    kSolid,  ///< Every component encloses a volume: signed distance.
    kSheet,  ///< None does: distance minus a half-thickness.
    kMixed,
};

/// "solid", "sheet" or "mixed", as reports and metadata spell it.
std::string_view class_name(MeshClass value);

/// How a triangle is represented.
enum class Feature : std::uint8_t {
    kSurface,   ///< By the zero of its signed distance.
    kSheet,     ///< By its distance less the half-thickness.
    kThinWall,  ///< In part or whole like a sheet: it bounds a solid too thin for the lattice there, or a
                ///< hole.
};

/// Distances between the mesh and the trilinear surface of its field, in voxels, over area-uniform samples.
struct ErrorFigures {
    double mean = 0.0;
    double p99 = 0.0;
    double max = 0.0;
};

/// Stored samples held against the exact winding number of the solids.
struct SignMismatches {
    std::uint32_t samples = 0;  ///< How many were looked at.
    std::uint32_t wrong = 0;    ///< Those on the wrong side.
};

/// What is known of a baked field besides its samples; the .vdb's metadata.
struct FieldInfo {
    MeshClass mesh_class = MeshClass::kSolid;
    double voxel_size = 0.0;           ///< h, local units.
    glm::dvec3 origin{0.0};            ///< Local position of lattice point (0, 0, 0).
    double half_thickness = 0.0;       ///< tau, local units; 0 where nothing is inflated.
    bool clean_level_set = false;      ///< Closed, signed, nothing inflated: a level set in OpenVDB's sense.
    std::uint32_t triangle_count = 0;  ///< Of the source mesh.
    std::uint32_t dropped_faces = 0;   ///< Faces the bake could not use.
    ErrorFigures error_voxels;         ///< Mesh -> field; on inflated features beyond the half-thickness.
    ErrorFigures error_field_voxels;   ///< Field -> mesh; likewise.
    SignMismatches sign_mismatches;    ///< Farther than 0.01 voxel from the surface.
    std::string source_hash;           ///< Of the mesh's geometry.
    std::string settings_hash;         ///< Of everything else that decides the samples.
    std::vector<std::string> warnings;
};

/// 8^3 samples; x runs slowest, z fastest, as in OpenVDB's leaves.
struct FieldLeaf {
    glm::ivec3 origin{0};                     ///< Lattice coordinates of the first sample, multiples of 8.
    std::array<float, kLeafSize> distance{};  ///< Local units, negative inside.
    std::array<std::int32_t, kLeafSize> triangle{};  ///< Closest source triangle; -1 where inactive.
    std::array<std::uint64_t, kLeafSize / 64> active{};

    static int index(int x, int y, int z) { return (x * kLeafSide + y) * kLeafSide + z; }
    bool is_active(int i) const { return (active[i / 64] >> (i % 64)) & 1; }
    void set_active(int i) { active[i / 64] |= std::uint64_t{1} << (i % 64); }
};

/// A baked mesh.
struct SampledField {
    FieldInfo info;
    std::vector<FieldLeaf> leaves;  ///< Sorted by origin (x, then y, then z).
    /// One entry a source triangle; empty where all are Feature::kSurface.
    std::vector<Feature> features;

    float background() const { return static_cast<float>(kBandVoxels * info.voxel_size); }
};

}  // namespace sdf
