// A scene is immutable, shared by all threads, and owns what it refers to.
//
// Positions are relative to origin(), the centre of the world's bounds in double precision, so that a scene
// far from (0,0,0) keeps float32's precision. A prototype's positions are relative to a centre of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/material.h"
#include "engine/scene/medium.h"
#include "engine/scene/mesh.h"
#include "engine/scene/normal_field.h"
#include "engine/scene/path_account.h"
#include "lights/light.h"
#include "lights/light_tree.h"

namespace lucerna {

// Holds the world's own shapes, and prototypes that instances place in it.
struct SceneParts : Shapes {
    std::vector<Shapes> prototypes;  // their surfaces carry no light
    std::vector<Instance> instances;
    std::vector<Material> materials;
    std::vector<std::unique_ptr<Light>> lights;
    LightGroups light_groups;
    std::optional<FluxUnit> unit;  // unit that the scene states for all lights; none: each light has its own
    SceneMedia media;
    V3d origin{0, 0, 0};  // world position of the parts' (0,0,0)
};

// Returns bounds of all surfaces, interfaces included; empty if there are none. Lights need the scene's
// sphere before the Scene exists.
Box3f surface_bounds(const SceneParts& parts);
// Returns a sphere around the box; the unit sphere for an empty one.
SceneSphere enclosing_sphere(const Box3f& box);

// Describes a place where a ray met a surface.
struct Hit {
    SurfacePoint at;  // n is the shape's geometric normal: outside, or the emitting side
    V3f ns;           // shading normal, in n's hemisphere
    V3f wo{0, 0, 0};  // direction back along the ray, unit; 0 if there was no ray
    V3f dpdu;         // tangent along u, not normalised, never zero
    V3f dpdv;         // tangent along v, not normalised, never zero
    V2f uv;
    float t = 0;
    std::uint32_t material = 0;
    std::int32_t light = kNoLight;
    std::uint32_t primitive = 0;  // index within the shape; of a mesh, the triangle
    MediumInterface media;
};

// Holds a hit of a primitive as the acceleration structure reports it, before the surface is evaluated. `u`
// and `v` are defined in surface_hit.h; quadrics don't use them.
struct PrimitiveHit {
    std::uint32_t geometry = 0, primitive = 0;
    double t = 0, u = 0, v = 0;
    V3f n{0, 0, 0};  // a curve's normal from Embree
};
inline constexpr std::uint32_t kNoInstance = 0xffffffffU;
// Holds the closest hit along a ray, and the instance to which its primitive belongs.
struct ClosestHit {
    PrimitiveHit primitive;
    std::uint32_t instance = kNoInstance;  // kNoInstance: one of the world's own shapes
};

// Returns the ray from x to x + distance·w, which begins off x's surface. Its length is 0 where it would
// begin beyond its end, so that nothing can be between the two.
Ray way_from(const SurfacePoint& x, const V3f& w, float distance);
// Returns the ray between two surface points, both of which are moved off their surfaces.
Ray way_between(const SurfacePoint& x, const SurfacePoint& y);

class Scene {
  public:
    // Builds the acceleration structure. Triangles of zero area or with a non-finite vertex are left out and
    // counted. The caller ensures that instances' maps are invertible.
    explicit Scene(SceneParts parts, const Workers& workers = {});
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    // Returns the nearest surface at 0 < t <= ray.t_max. Rays pass interface materials, but one that carries
    // a light is a black surface.
    std::optional<Hit> intersect(const Ray& ray) const;
    // The following functions split intersect() into steps for callers with many rays, so that memory latency
    // of one surface overlaps with tracing other rays. Call closest_hit() first; later, after other work,
    // prefetch_corners(), prefetch_vertices() and intersect() with this ray. The prefetches are optional.
    std::optional<ClosestHit> closest_hit(const Ray& ray) const;
    void prefetch_corners(const ClosestHit& closest) const;
    void prefetch_vertices(const ClosestHit& closest) const;
    Hit intersect(const Ray& ray, const ClosestHit& closest) const;
    void intersect(const Ray& ray, const ClosestHit& closest, Hit& hit) const;  // writes to `hit`
    // Calls closest_hit() and prefetch_corners() for each ray.
    void closest_hits(std::span<const Ray> rays, std::span<std::optional<ClosestHit>> closest) const;
    // Returns a field along Hit::ns or -Hit::ns at the hit of this ray, without any relief of the material;
    // none for shapes of which it is not known (patches, curves).
    std::optional<NormalField> normal_field(const Ray& ray, const ClosestHit& closest) const;
    // Returns only the t of that hit.
    float distance(const Ray& ray, const ClosestHit& closest) const;
    // Returns the hit object's number, from 1: the world's own shapes in their order, then the instances.
    std::uint32_t object_of(const ClosestHit& closest) const;
    // Returns the nearest surface or medium interface; is_medium_interface() tells them apart.
    std::optional<Hit> intersect_with_medium_interfaces(const Ray& ray) const;
    // Returns the nearest surface that is only a medium interface, whatever surfaces are before it.
    std::optional<Hit> intersect_medium_interface(const Ray& ray) const;
    // Tells whether the hit is only a medium interface.
    bool is_medium_interface(const Hit& hit) const;
    // Returns the nearest surface that may pass light straight on (Bsdf::straight_share()), whatever is
    // before it. `shadow` as in blocked().
    std::optional<Hit> intersect_pane(const Ray& ray, bool shadow) const;
    // Tells whether an opaque surface is met. A shadow ray meets cut-outs as shadows do.
    bool blocked(const Ray& ray, bool shadow) const;
    // Tells whether only interfaces are between x and x + distance·w. The start is moved off x's surface.
    bool unoccluded(const SurfacePoint& x, const V3f& w, float distance) const;
    // Tells this for two points in space, `from` and from + way. True if they coincide.
    bool unoccluded_along(const V3f& from, const V3f& way) const;

    // Returns how many of the rays meet a surface, by the acceleration structure alone: it makes no Hit and
    // counts no ray. It serves measurements. The rays must be finite.
    std::uint64_t count_hits(std::span<const Ray> rays, const Workers& workers) const;

    Bsdf bsdf(const Hit& hit) const;

    std::span<const std::unique_ptr<Light>> lights() const;
    const LightGroups& light_groups() const;
    // Returns SceneParts::unit; scene_unit() (quantity.h) returns the unit of the scene's images.
    std::optional<FluxUnit> stated_unit() const;
    // Chooses lights in proportion to their power.
    const LightPicker& picker() const;
    // Chooses lights by what each may send to the place that is lit.
    const LightTree& light_tree() const;
    // Returns the indices of the lights for which Le() may return a value.
    std::span<const std::uint32_t> impostors() const;
    bool has_sky() const;  // whether one of these has no bounds: seen from everywhere, in every direction
    std::span<const Material> materials() const;
    bool has_specular() const;
    const SceneMedia& media() const;
    bool has_medium_interfaces() const;  // whether intersect_medium_interface() can find anything
    bool has_panes() const;              // whether intersect_pane() can
    // Returns bounds of some surface at which the medium changes, whatever its material, or none if there is
    // no such surface. A ray towards it from anywhere meets it or another such surface.
    const std::optional<Box3f>& any_medium_interface() const;
    // Tells whether surfaces carry the light, all of them without cut-outs: then rays always meet it.
    bool is_on_solid_surfaces(std::uint32_t light) const;
    // Returns the medium of the interfaces in which a light's particles begin. As in pbrt, a light is in one
    // medium; for a lamp that extends into several, its first particle decides.
    std::int32_t medium_of_light(std::uint32_t light) const;
    // Returns the factor of a light's particles when they enter the scene: 1, except that nothing arrives
    // from lights at infinity through an unbounded medium.
    const Rgb& reach_of_light(std::uint32_t light) const;

    const Box3f& bounds() const;  // empty for an empty scene
    SceneSphere sphere() const;   // radius 1 for an empty scene
    const V3d& origin() const;

    // Counts shapes once, however often instances show them. Curves are counted by their segments.
    struct Counts {
        std::uint64_t triangles = 0, quadrics = 0, patches = 0, curves = 0, degenerate_triangles = 0;
        std::uint64_t prototypes = 0, instances = 0;
        std::uint64_t triangles_seen = 0;  // including those of every instance
        std::uint64_t geometry_bytes = 0;  // shapes and acceleration structure, approximate
    };
    Counts counts() const;
    // Returns the number of rays traced since construction, for statistics.
    std::uint64_t rays() const;
    // Returns the number of rays that were not finite (NaN, or beyond 1e18); they meet nothing. Any number
    // but 0 indicates an error of the caller.
    std::uint64_t invalid_rays() const;

  private:
    std::optional<ClosestHit> closest_hit(const Ray& ray, unsigned layers, bool shadow = false) const;
    bool occluded(const Ray& ray, unsigned layers) const;
    std::optional<Hit> nearest(const Ray& ray, unsigned layers, bool shadow = false) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// Returns the length of the bounds' diagonal, scene units; 1 for an empty scene or a single point.
inline float diagonal(const Scene& scene) {
    const float length = scene.bounds().isEmpty() ? 0.0F : scene.bounds().size().length();
    return length > 0 ? length : 1.0F;
}
// Returns the diagonal of all surfaces and all media that have bounds.
float diagonal_with_media(const Scene& scene);

}  // namespace lucerna
