// The scene: immutable, shared by all threads, owner of what it refers to.
//
// Positions are relative to origin(), the centre of the world's bounds in double precision, so that a scene
// far from (0,0,0) keeps float32's bits for its shape; a prototype's are relative to a middle of its own.
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
#include "engine/scene/path_account.h"
#include "lights/light.h"
#include "lights/light_tree.h"

namespace lucerna {

// The world's own shapes, and prototypes that instances place in it.
struct SceneParts : Shapes {
    std::vector<Shapes> prototypes;  // surfaces of these carry no light
    std::vector<Instance> instances;
    std::vector<Material> materials;
    std::vector<std::unique_ptr<Light>> lights;
    LightGroups light_groups;
    std::optional<FluxUnit> unit;  // that the scene states for all of its light; none: each has its own
    SceneMedia media;
    V3d origin{0, 0, 0};  // world position of the parts' (0,0,0)
};

// The box of all surfaces, interfaces included; empty if there are none. For lights that must know the
// scene's sphere before the Scene is made.
Box3f surface_bounds(const SceneParts& parts);
// A sphere around the box; the unit sphere for an empty one.
SceneSphere enclosing_sphere(const Box3f& box);

// Where a ray met a surface.
struct Hit {
    SurfacePoint at;  // n is the shape's geometric normal: outside, or the emitting side
    V3f ns;           // shading normal, in n's hemisphere
    V3f wo{0, 0, 0};  // back along the ray that met it, unit; 0 if no ray did
    V3f dpdu;         // tangent along u, not normalised, never zero
    V3f dpdv;         // tangent along v, not normalised, never zero
    V2f uv;
    float t = 0;
    std::uint32_t material = 0;
    std::int32_t light = kNoLight;
    std::uint32_t primitive = 0;  // of the shape; of a mesh, the triangle
    MediumInterface media;
};

// Where a ray hits a primitive, as the acceleration structure says it: before the surface there is evaluated.
// `u`, `v` as surface_hit.h has them; not used by quadrics.
struct PrimitiveHit {
    std::uint32_t geometry = 0, primitive = 0;
    double t = 0, u = 0, v = 0;
    V3f n{0, 0, 0};  // of a curve, as Embree says
};
inline constexpr std::uint32_t kNoInstance = 0xffffffffU;
// The closest hit along a ray, and the instance whose primitive it is.
struct ClosestHit {
    PrimitiveHit primitive;
    std::uint32_t instance = kNoInstance;  // kNoInstance: one of the world's own shapes
};

// The way from x to x + distance·w, begun off x's surface. Of length 0 where it begins beyond its end, so
// that there is no room for anything between the two.
Ray way_from(const SurfacePoint& x, const V3f& w, float distance);
// The way between two surface points, both of which are moved off their surfaces.
Ray way_between(const SurfacePoint& x, const SurfacePoint& y);

class Scene {
  public:
    // Builds the acceleration structure. Triangles of zero area or with a non-finite vertex are left out and
    // counted; parts of instances' maps that cannot be inverted are the caller's fault.
    explicit Scene(SceneParts parts, const Workers& workers = {});
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    // The nearest surface at 0 < t <= ray.t_max. Interface materials are passed through; one that carries a
    // light is a black surface instead.
    std::optional<Hit> intersect(const Ray& ray) const;
    // intersect() in steps, for callers with many rays at hand: what memory is slow to bring of one surface
    // comes while other rays are traced. First closest_hit(); then, other work later, prefetch_corners(),
    // prefetch_vertices() and intersect() with the same ray. Any of the two in between may be left out.
    std::optional<ClosestHit> closest_hit(const Ray& ray) const;
    void prefetch_corners(const ClosestHit& closest) const;
    void prefetch_vertices(const ClosestHit& closest) const;
    Hit intersect(const Ray& ray, const ClosestHit& closest) const;
    void intersect(const Ray& ray, const ClosestHit& closest, Hit& hit) const;  // in its place
    // closest_hit() and prefetch_corners() of each ray.
    void closest_hits(std::span<const Ray> rays, std::span<std::optional<ClosestHit>> closest) const;
    // The t of that hit, and nothing else of it.
    float distance(const Ray& ray, const ClosestHit& closest) const;
    // The number of the object that was met, from 1: the world's own shapes come first, in the order in which
    // they are kept, then the instances.
    std::uint32_t object_of(const ClosestHit& closest) const;
    // As intersect(), but interfaces that are borders between media count, too: is_border() tells.
    std::optional<Hit> intersect_with_borders(const Ray& ray) const;
    // The nearest interface that is a border between media, whatever surfaces stand before it.
    std::optional<Hit> intersect_border(const Ray& ray) const;
    // True if nothing is there but a change of medium.
    bool is_border(const Hit& hit) const;
    // The nearest surface that may pass light straight on (Bsdf::straight_share()), whatever stands before
    // it. `shadow` as in blocked().
    std::optional<Hit> intersect_pane(const Ray& ray, bool shadow) const;
    // True if any other surface is met: nothing passes. A shadow ray meets cut-outs as shadows do.
    bool blocked(const Ray& ray, bool shadow) const;
    // True if nothing but interfaces stands between x and x + distance·w. The start is moved off x's surface.
    bool unoccluded(const SurfacePoint& x, const V3f& w, float distance) const;
    // The same between two points in space, from `from` to from + way. True where these have met: there is no
    // room for anything between them.
    bool unoccluded_along(const V3f& from, const V3f& way) const;

    // How many of the rays meet a surface, by the acceleration structure alone: no Hit is made, no ray is
    // counted. For measuring. The rays must be of usable numbers.
    std::uint64_t count_hits(std::span<const Ray> rays, const Workers& workers) const;

    Bsdf bsdf(const Hit& hit) const;

    std::span<const std::unique_ptr<Light>> lights() const;
    const LightGroups& light_groups() const;
    // SceneParts::unit; what the scene's images are in is told by scene_unit() (quantity.h).
    std::optional<FluxUnit> stated_unit() const;
    // Lights chosen in proportion to their power.
    const LightPicker& picker() const;
    // Lights chosen by what each may send to the place that asks.
    const LightTree& light_tree() const;
    // Indices of the lights for which Le() can answer.
    std::span<const std::uint32_t> impostors() const;
    bool has_sky() const;  // whether one of these has no place: seen from everywhere, in every direction
    std::span<const Material> materials() const;
    bool has_specular() const;
    const SceneMedia& media() const;
    bool has_borders() const;  // whether intersect_border() can find anything
    bool has_panes() const;    // whether intersect_pane() can
    // A box around some surface at which the medium changes, whatever its material: who looks towards it
    // from anywhere meets that surface or another such one. None: there is no such surface.
    const std::optional<Box3f>& a_border() const;
    // Whether surfaces carry the light, all of them without cut-outs: it is met wherever its surface is.
    bool is_on_solid_surfaces(std::uint32_t light) const;
    // The medium of the borders in which a light's particles begin. A light has one place, as in pbrt: of a
    // lamp that reaches into several, the first particle decides.
    std::int32_t medium_of_light(std::uint32_t light) const;
    // What is left of a light's particles when they enter the scene: 1, but for lights at infinity in a
    // medium without bounds, from which nothing comes.
    const Rgb& reach_of_light(std::uint32_t light) const;

    const Box3f& bounds() const;  // empty for an empty scene
    SceneSphere sphere() const;   // radius 1 for an empty scene
    const V3d& origin() const;

    // What is held once, however often instances show it. Curves are counted by their segments.
    struct Counts {
        std::uint64_t triangles = 0, quadrics = 0, patches = 0, curves = 0, degenerate_triangles = 0;
        std::uint64_t prototypes = 0, instances = 0;
        std::uint64_t triangles_seen = 0;  // with every instance's own
        std::uint64_t geometry_bytes = 0;  // shapes and acceleration structure, about
    };
    Counts counts() const;
    // Rays traced since construction; for statistics.
    std::uint64_t rays() const;
    // Rays that were not numbers (NaN, or beyond 1e18): they meet nothing, see nothing, and are counted.
    // Anything but 0 is a fault of whoever made them.
    std::uint64_t invalid_rays() const;

  private:
    std::optional<ClosestHit> closest_hit(const Ray& ray, unsigned layers, bool shadow = false) const;
    bool occluded(const Ray& ray, unsigned layers) const;
    std::optional<Hit> nearest(const Ray& ray, unsigned layers, bool shadow = false) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// Length of the bounds' diagonal, scene units; 1 where there is nothing, or only a point.
inline float diagonal(const Scene& scene) {
    const float length = scene.bounds().isEmpty() ? 0.0F : scene.bounds().size().length();
    return length > 0 ? length : 1.0F;
}
// The same of all surfaces and all media that have bounds.
float diagonal_with_media(const Scene& scene);

}  // namespace lucerna
