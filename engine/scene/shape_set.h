// Prepares the shapes of one frame of reference (the world's, or a prototype's) for rays.
//
// A geometry is a mesh, a set of curves, all quadrics together or all patches together; a primitive is one
// triangle, segment, quadric or patch of it. The acceleration structure reports a PrimitiveHit, which the set
// turns into a Hit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/scene/mesh.h"
#include "engine/scene/surface_hit.h"
#include "lights/light.h"

namespace lucerna {

// Surfaces are in layers. A ray states the layers that it meets.
inline constexpr unsigned kOpaque = 1;
inline constexpr unsigned kMediumInterfaces = 2;  // medium interfaces that are nothing else
inline constexpr unsigned kPanes = 4;             // surfaces that may pass light in a straight line, unbent
inline constexpr unsigned kSurfaces = kOpaque | kPanes;

// Embree's limit for coordinates is 1.844e18.
inline constexpr float kLargestCoordinate = 1e18F;
inline bool is_usable(const V3f& p) {
    return std::fabs(p.x) <= kLargestCoordinate && std::fabs(p.y) <= kLargestCoordinate &&
           std::fabs(p.z) <= kLargestCoordinate;
}

// Returns bounds of everything that rays may meet, interfaces included.
Box3f bounds_of(const Shapes& shapes);

// Returns the triangles that the scene keeps, in their order: those with an area and finite vertices.
std::vector<V3i> kept_triangles(const Mesh& mesh);

class ShapeSet {
  public:
    // Leaves out triangles of zero area or with an unusable vertex, and gives every mesh the padding vertex
    // that Embree may read.
    ShapeSet(Shapes shapes, std::span<const Material> materials);

    // Geometries are numbered in the order meshes, curves, quadrics, patches.
    std::uint32_t curves_begin() const { return static_cast<std::uint32_t>(shapes_.meshes.size()); }
    std::uint32_t quadrics_id() const {
        return curves_begin() + static_cast<std::uint32_t>(shapes_.curves.size());
    }
    std::uint32_t patches_id() const { return quadrics_id() + 1; }
    std::uint32_t geometries() const { return quadrics_id() + 2; }

    const SurfaceTraits& traits(std::uint32_t geometry, std::uint32_t primitive) const;
    // Returns kOpaque, kPanes, kMediumInterfaces, or 0 for a surface that no ray meets.
    unsigned layer(const SurfaceTraits& traits) const;

    // Returns the nearest crossing of a quadric or patch with t_min < t <= t_max.
    std::optional<PrimitiveHit> cross(std::uint32_t geometry, std::uint32_t primitive, const LocalRay& ray,
                                      double t_min, double t_max) const;
    Box3f primitive_bounds(std::uint32_t geometry, std::uint32_t primitive) const;
    // Returns the bounds of one primitive at which the medium changes, whatever its material; none if there
    // is no such primitive. Curves are ignored, because they enclose nothing.
    std::optional<Box3f> any_medium_interface() const;

    // Returns the hit in full double precision, computed from the primitive. Embree's own t, u and v depend
    // on approximate reciprocals, whose last digits differ between processors. Curves keep Embree's values.
    PrimitiveHit exact(const PrimitiveHit& hit, const LocalRay& ray) const;
    V2f uv(const PrimitiveHit& exact, const LocalRay& ray) const;
    // Returns the Hit, including its t.
    Hit hit(const PrimitiveHit& exact, const LocalRay& ray) const;
    // Writes hit(exact(m, ray), ray) to `hit`.
    void exact_hit(const PrimitiveHit& m, const LocalRay& ray, Hit& hit) const;
    // Returns none for patches and curves.
    std::optional<NormalField> normal_field(const PrimitiveHit& exact, const LocalRay& ray) const;
    // These prefetch the memory that hit() reads of a triangle: first its vertex indices, then, once these
    // are there, its vertices.
    void prefetch_corners(const PrimitiveHit& hit) const {
        if (hit.geometry >= curves_begin()) return;
        __builtin_prefetch(&shapes_.meshes[hit.geometry].triangles[hit.primitive]);
    }
    void prefetch_vertices(const PrimitiveHit& hit) const;

    const Shapes& shapes() const { return shapes_; }
    std::uint32_t quadrics() const { return static_cast<std::uint32_t>(quadrics_.size()); }
    std::uint32_t patches() const { return static_cast<std::uint32_t>(patches_.size()); }

    // Counts the shapes that rays may meet, without surfaces that are only medium interfaces.
    struct Counts {
        std::uint64_t triangles = 0, quadrics = 0, patches = 0, curves = 0, degenerate_triangles = 0;
        std::uint64_t bytes = 0;  // memory of the shapes themselves
    };
    const Counts& counts() const { return counts_; }
    bool has_medium_interfaces() const { return has_medium_interfaces_; }
    bool has_panes() const { return has_panes_; }
    bool has_specular() const { return has_specular_; }

  private:
    struct PatchAddress {
        std::uint32_t mesh, patch;
    };
    void take_meshes();
    void take_curves();
    void take_quadrics();
    void take_patches();
    // Records the properties of a surface and returns its layer.
    unsigned note(const SurfaceTraits& traits);
    Hit surface(const PrimitiveHit& exact, const LocalRay& ray) const;

    Shapes shapes_;
    std::span<const Material> materials_;
    std::vector<QuadricShape> quadrics_;       // those in a layer other than 0
    std::vector<std::uint32_t> quadric_from_;  // index in shapes_.quadrics of each element of quadrics_
    std::vector<PatchAddress> patches_;
    Counts counts_;
    bool has_medium_interfaces_ = false, has_panes_ = false, has_specular_ = false;
};

// Returns a lamp's shape that is intersected by rays. The shapes must be those in the scene; their materials
// do not matter. `origin` is the scene's origin, for the textures of cut-outs.
std::unique_ptr<const LampShape> make_traced_shape(Shapes shapes, const V3d& origin = V3d(0.0));

}  // namespace lucerna
