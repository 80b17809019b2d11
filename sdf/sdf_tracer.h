// sdf/sdf_tracer.h: core::Tracer over baked distance fields.
//
// The ray is transformed and not the field: o' = M^-1 o, d' = M^-1 d, unnormalised, so that t is shared by
// all instances and by the triangle tracer, and scale, shear and mirrors are exact.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"
#include "sdf/brick_grid.h"
#include "sdf/entry_kernel.h"
#include "sdf/field_table.h"
#include "sdf/hit_kernel.h"
#include "sdf/instance_tree.h"
#include "sdf/sphere_trace.h"
#include "sdf/triangle_ray_tree.h"

namespace sdf {

/// Finds hits by walking the fields of all instances front to back. Hits on solids lie on the exact surface
/// of the trilinear field; triangle and barycentrics are the closest point of the closest stored triangle.
/// Sheets and walls too thin for the lattice are held by a shell of half a voxel on either side, so that no
/// ray slips between samples; where a ray meets a shell, the stored triangles within decide whether and where
/// it hits, so that such surfaces are as thin and as wide as they are.
class SdfTracer : public core::Tracer {
public:
    /// Work done since construction, over all threads.
    struct Statistics {
        std::uint64_t rays = 0;
        std::uint64_t steps = 0;      ///< Cells and empty blocks visited.
        std::uint64_t exhausted = 0;  ///< Rays that ran into the step cap.
    };

    /// @param scene must outlive the tracer.
    /// @param grids by mesh index; instances of a mesh without a grid are not there for rays.
    /// @pre grids.size() == scene.meshes.size()
    /// @throws core::InputError (kOutOfMemory) where the fields are too large for a FieldAtlas
    SdfTracer(const core::Scene& scene, std::vector<std::shared_ptr<const BrickGrid>> grids,
              HitMode hit_mode = HitMode::kCubic);

    void trace_closest(const core::RayStream& rays, core::HitStream& hits) const override;
    void trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const override;

    /// The largest distance measured at the bake between mesh and field surface; rounding alone for sheets.
    float start_offset(std::uint32_t instance) const override;

    Statistics statistics() const;

    /// Memory held by grids and instances.
    std::size_t bytes() const;

    /// One instance, ready for rays.
    struct PlacedGrid {
        const BrickGrid* grid = nullptr;
        FieldAtlas::Place place;
        const TriangleRayTree* triangles = nullptr;  ///< Of the mesh; null if nothing is thickened.
        glm::dmat3 voxel_from_world_direction{1.0};
        glm::mat3 world_from_voxel_gradient{1.0f};  ///< Up to a factor.
        glm::dvec3 voxel_origin{0.0};               ///< Voxel coordinates of the world's origin.
        double world_from_voxel_scale = 1.0;        ///< Largest stretch of one voxel, in world units.
        float start_offset = 0.0f;
        bool is_sheet = false;         ///< Nothing but shells.
        bool is_opaque = false;        ///< No shells and no alpha.
        bool is_opaque_solid = false;  ///< Every crossing is a visible surface.
    };

private:
    struct Asked;
    struct LocalRay;
    struct Passage;
    struct Surface;
    struct Traced;
    struct Work;
    enum class IfUnmet : std::uint8_t;
    enum class Stands : std::uint8_t;

    /// The one path of both queries: finished(begin, end, Work&) for each block of rays. Stops at any hit if
    /// `any`.
    template <typename Finished>
    void trace(const core::RayStream& rays, bool any, const Finished& finished) const;
    /// Traces rays begin to end - 1 together.
    void trace_block(std::size_t begin, std::size_t end, bool any, Work& work) const;
    /// Brings every leaving ray to the next instance whose field it may meet, if there is one.
    void enter_next_instances(Work& work) const;
    /// Takes all active rays through the field that each has come to.
    void march_active(bool any, Work& work) const;
    /// Takes the crossing that the kernels found, number `at` of work.met, or adds it to work.going_on.
    void finish_crossing(std::size_t at, bool any, Work& work) const;
    /// Fills work.surface with what lies at the crossings of work.met.
    void find_surfaces(Work& work) const;
    /// Takes the rays of work.going_on to their first visible surface or to the end of their passage.
    void go_on(Work& work) const;
    LocalRay local_ray(const core::Ray& ray, std::uint32_t slot, const Traced& traced, bool any) const;
    /// The rest of a passage, for the kernels.
    MarchRay march_ray(const LocalRay& local, const Passage& passage) const;
    static Crossing crossing_of(const MarchHit& march_hit, double from, const Passage& passage);
    void keep_nearer(const NearestHit& found, Traced& traced) const;
    /// Takes a crossing if it is a visible surface, asks for triangles if it may be; else the ray goes on.
    void take_crossing(LocalRay& ray, const Crossing& crossing, const Surface& here, Work& work) const;
    /// The same where there is nothing but shells: the triangles answer for the rest of the passage.
    void take_sheet(LocalRay& ray, const Crossing& crossing, Work& work) const;
    static Stands stands_for(const PlacedGrid& placed, const Surface& here);
    /// Asks for the first visible triangle that the ray truly meets in [t_min, t_max].
    void ask(LocalRay& ray, double t_min, double t_max, const Surface& here, IfUnmet if_unmet,
             Work& work) const;
    /// Answers all that was asked.
    void answer(Work& work) const;
    /// Takes a triangle that was met, if it is visible there.
    bool take_triangle(const LocalRay& ray, const TriangleQuery& query, Work& work) const;
    /// What becomes of a ray that has met no triangle.
    void settle(LocalRay& ray, const Surface& here, IfUnmet if_unmet, Work& work) const;
    /// The end of a passage behind whose place there is no crossing: within a shell it may meet a triangle
    /// yet.
    void ask_at_end(LocalRay& ray, Work& work) const;
    /// Whether the field is negative at a place along the ray, or does not say.
    static bool may_be_inside(const LocalRay& ray, double t);
    Surface surface_found(const Work& work, std::size_t at, std::int32_t triangle_base) const;
    /// The normal that faces the ray: of the triangle itself, or of the field.
    glm::vec3 triangle_side(const core::Ray& ray, const NearestHit& nearest) const;
    glm::vec3 field_side(const core::Ray& ray, const NearestHit& nearest) const;
    /// Whether a point of a triangle lies so deep in a shell that no field passes there.
    bool is_within_shell(const NearestHit& nearest, const glm::vec3& position) const;
    core::Hit finish(const core::Ray& ray, const NearestHit& nearest) const;

    const core::Scene& scene_;
    std::vector<std::shared_ptr<const BrickGrid>> grids_;
    std::vector<TriangleRayTree> triangles_;  ///< By mesh; empty where nothing is thickened.
    FieldAtlas atlas_;
    HitMode hit_mode_;
    std::vector<PlacedGrid> placed_;
    std::vector<FieldPlacement> placements_;  ///< Of the same instances, for the kernels.
    std::vector<HitPlacement> hit_placements_;
    InstanceTree tree_;
    std::uint32_t only_instance_ = core::kNoIndex;  ///< If there is exactly one.
    bool has_alpha_ = false;
    mutable std::atomic<std::uint64_t> ray_count_{0};
    mutable std::atomic<std::uint64_t> step_count_{0};
    mutable std::atomic<std::uint64_t> exhausted_count_{0};
};

}  // namespace sdf
