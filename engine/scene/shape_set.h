// The shapes of one frame of reference (the world's, or a prototype's), made ready to be met by rays.
//
// A geometry is a mesh, a set of curves, all quadrics together or all patches together; a primitive is one
// triangle, segment, quadric or patch of it. What the acceleration structure reports is a PrimitiveHit; the
// set turns it into a Hit.
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

// Where surfaces stand: a ray says which of them it meets.
inline constexpr unsigned kOpaque = 1;
inline constexpr unsigned kBorders = 2;  // nothing but a change of medium (an interface)
inline constexpr unsigned kPanes = 4;    // surfaces that may pass light in a straight line, unbent
inline constexpr unsigned kSurfaces = kOpaque | kPanes;

// Embree's limit for coordinates is 1.844e18.
inline constexpr float kLargestCoordinate = 1e18F;
inline bool is_usable(const V3f& p) {
    return std::fabs(p.x) <= kLargestCoordinate && std::fabs(p.y) <= kLargestCoordinate &&
           std::fabs(p.z) <= kLargestCoordinate;
}

// The box of what is there to be met, interfaces included.
Box3f bounds_of(const Shapes& shapes);

// The triangles that the scene keeps: those with an area and finite vertices, in their order.
std::vector<V3i> kept_triangles(const Mesh& mesh);

class ShapeSet {
  public:
    // Leaves out triangles of zero area or with a vertex that is no usable number, and gives every mesh the
    // spare vertex that Embree may read.
    ShapeSet(Shapes shapes, std::span<const Material> materials);

    // Geometries are numbered meshes first, then curves, then the quadrics, then the patches.
    std::uint32_t curves_begin() const { return static_cast<std::uint32_t>(shapes_.meshes.size()); }
    std::uint32_t quadrics_id() const {
        return curves_begin() + static_cast<std::uint32_t>(shapes_.curves.size());
    }
    std::uint32_t patches_id() const { return quadrics_id() + 1; }
    std::uint32_t geometries() const { return quadrics_id() + 2; }

    const SurfaceTraits& traits(std::uint32_t geometry, std::uint32_t primitive) const;
    // kOpaque, kPanes, kBorders, or 0 for a surface that is not there.
    unsigned layer(const SurfaceTraits& traits) const;

    // Quadrics and patches: the nearest crossing of that primitive with t_min < t <= t_max.
    std::optional<PrimitiveHit> cross(std::uint32_t geometry, std::uint32_t primitive, const LocalRay& ray,
                                      double t_min, double t_max) const;
    Box3f primitive_bounds(std::uint32_t geometry, std::uint32_t primitive) const;
    // The box of one primitive at which the medium changes, whatever its material; none: there is no such
    // primitive. Curves are not looked at, as they enclose nothing.
    std::optional<Box3f> a_border() const;

    // The same hit with all digits of double, worked out from the primitive. Embree's own t, u and v rest
    // on approximate reciprocals, whose last digits are not the same on every processor. Curves keep them.
    PrimitiveHit exact(const PrimitiveHit& hit, const LocalRay& ray) const;
    V2f uv(const PrimitiveHit& exact, const LocalRay& ray) const;
    // With its t.
    Hit hit(const PrimitiveHit& exact, const LocalRay& ray) const;
    // hit(exact(m, ray), ray), in its place.
    void exact_hit(const PrimitiveHit& m, const LocalRay& ray, Hit& hit) const;
    // Begins to fetch what hit() will read of a triangle: its corners' numbers, then, once these are there,
    // what stands at them.
    void prefetch_corners(const PrimitiveHit& hit) const {
        if (hit.geometry >= curves_begin()) return;
        __builtin_prefetch(&shapes_.meshes[hit.geometry].triangles[hit.primitive]);
    }
    void prefetch_vertices(const PrimitiveHit& hit) const;

    const Shapes& shapes() const { return shapes_; }
    std::uint32_t quadrics() const { return static_cast<std::uint32_t>(quadrics_.size()); }
    std::uint32_t patches() const { return static_cast<std::uint32_t>(patches_.size()); }

    // What can be met; surfaces that are only borders of media are not counted.
    struct Counts {
        std::uint64_t triangles = 0, quadrics = 0, patches = 0, curves = 0, degenerate_triangles = 0;
        std::uint64_t bytes = 0;  // of the shapes themselves
    };
    const Counts& counts() const { return counts_; }
    bool has_borders() const { return has_borders_; }
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
    // Notes what stands there; the layer.
    unsigned note(const SurfaceTraits& traits);
    Hit surface(const PrimitiveHit& exact, const LocalRay& ray) const;

    Shapes shapes_;
    std::span<const Material> materials_;
    std::vector<QuadricShape> quadrics_;       // those that are there
    std::vector<std::uint32_t> quadric_from_;  // of the same index: in shapes_.quadrics
    std::vector<PatchAddress> patches_;
    Counts counts_;
    bool has_borders_ = false, has_panes_ = false, has_specular_ = false;
};

// A lamp's shape, asked by rays.

// The shapes must be those that the scene holds; what they are made of does not matter here. `origin`: that
// of the scene, for the textures that cut holes.
std::unique_ptr<const LampShape> make_traced_shape(Shapes shapes, const V3d& origin = V3d(0.0));

}  // namespace lucerna
