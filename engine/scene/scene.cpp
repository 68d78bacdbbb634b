// Implements the scene: prepared shapes and the acceleration structure over them.
//
// Interfaces (pbrt's "interface" material) are not in the acceleration structure, so that no ray has to step
// through them. An interface that carries a light is kept as a black surface that emits. A medium interface
// is kept in a layer of its own, which only rays that ask for it meet.
#include "engine/scene/scene.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>

#include "engine/base/vec.h"
#include "engine/scene/accelerator.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/shape_set.h"

namespace lucerna {
namespace {

// Embree aborts on rays that are not finite.
bool is_usable_ray(const Ray& ray) {
    return is_usable(ray.o) && is_usable(ray.d) && !std::isnan(ray.t_max);
}

// Returns a box around the image of a box under an affine map.
Box3f carried(const Box3f& box, const M44d& m) {
    if (box.isEmpty()) return {};
    const Box3d to = carried_box(Box3d(V3d(box.min), V3d(box.max)), m);
    return {V3f(to.min), V3f(to.max)};
}

// Returns some particle of the light. Several tries are needed, because a sample may yield no particle.
std::optional<LeSample> first_particle(const Light& light) {
    constexpr std::uint32_t kTries = 64;
    for (std::uint32_t i = 0; i < kTries; ++i) {
        Sampler sampler(0, Purpose::emission, 0, i);
        if (auto emitted = light.sample_Le({sampler.next2(), sampler.next2(), i})) return emitted;
    }
    return std::nullopt;
}

}  // namespace

Box3f surface_bounds(const SceneParts& parts) {
    Box3f box = bounds_of(parts);
    std::vector<Box3f> prototypes;
    for (const Shapes& shapes : parts.prototypes) prototypes.push_back(bounds_of(shapes));
    for (const Instance& instance : parts.instances) {
        box.extendBy(carried(prototypes[instance.prototype], instance.world_from_prototype));
    }
    return box;
}

SceneSphere enclosing_sphere(const Box3f& box) {
    if (box.isEmpty()) return {};
    const V3d lower(box.min);
    const V3d upper(box.max);
    SceneSphere sphere;
    sphere.centre = V3f(0.5 * (lower + upper));
    // The radius compensates for the rounding of the centre.
    const V3d reach(std::max(upper.x - static_cast<double>(sphere.centre.x),
                             static_cast<double>(sphere.centre.x) - lower.x),
                    std::max(upper.y - static_cast<double>(sphere.centre.y),
                             static_cast<double>(sphere.centre.y) - lower.y),
                    std::max(upper.z - static_cast<double>(sphere.centre.z),
                             static_cast<double>(sphere.centre.z) - lower.z));
    sphere.radius = static_cast<float>(reach.length()) * (1 + kSurfaceUlps);
    if (!(sphere.radius > 0)) sphere.radius = 1;
    return sphere;
}

float diagonal_with_media(const Scene& scene) {
    Box3d box(V3d(scene.bounds().min), V3d(scene.bounds().max));
    if (scene.bounds().isEmpty()) box.makeEmpty();
    box.extendBy(bounds_of(scene.media()));
    const double length = box.isEmpty() ? 0.0 : box.size().length();
    return length > 0 ? static_cast<float>(length) : 1.0F;
}

struct Scene::Impl {
    SceneParts parts;  // without shapes and prototypes, which the sets own
    LightPicker picker;
    LightTree light_tree;
    std::vector<std::uint32_t> impostors;
    std::vector<bool> on_solid_surfaces;  // per light
    bool has_sky = false, has_specular = false, has_medium_interfaces = false, has_panes = false;
    Box3f bounds;
    std::optional<Box3f> any_medium_interface;
    Counts counts;
    Counter rays, invalid_rays;
    std::unique_ptr<const ShapeSet> world;
    std::vector<ShapeSet> prototypes;
    std::vector<Accelerator::Placed> instances;
    std::unique_ptr<const Accelerator> accelerator;
    struct LightPlace {
        std::int32_t medium = kNoMedium;
        Rgb reach{1.0F};
    };
    std::vector<LightPlace> light_places;

    const ShapeSet& set_of(const ClosestHit& closest) const {
        return closest.instance == kNoInstance ? *world : prototypes[instances[closest.instance].prototype];
    }
    // Returns the ray in the frame of the shape that it met.
    LocalRay local(const Ray& ray, const ClosestHit& closest) const {
        if (closest.instance != kNoInstance) return instances[closest.instance].placement.local(ray);
        return {V3d(ray.o), V3d(ray.d)};
    }

    Impl(SceneParts given, const Workers& workers);
    void take_shapes();
    void count();
};

Scene::Impl::Impl(SceneParts given, const Workers& workers)
    : parts(std::move(given)), picker(parts.lights), light_tree(parts.lights) {
    for (std::uint32_t i = 0; i < parts.lights.size(); ++i) {
        if (!parts.lights[i]->has_impostor()) continue;
        impostors.push_back(i);
        has_sky = has_sky || !parts.lights[i]->bounds();
    }
    bounds = surface_bounds(parts);
    take_shapes();
    accelerator =
        std::make_unique<const Accelerator>(*world, prototypes, instances, parts.origin, workers.threads);
    count();
}

void Scene::Impl::take_shapes() {
    const auto lit = [this](const auto& shapes) {
        return std::ranges::all_of(shapes, [this](const auto& shape) {
            return shape.traits.light == kNoLight ||
                   static_cast<std::size_t>(shape.traits.light) < parts.lights.size();
        });
    };
    assert(lit(parts.meshes) && lit(parts.quadrics) && lit(parts.patches) && lit(parts.curves));
    (void)lit;
    std::vector<bool> cut_out(parts.lights.size());
    on_solid_surfaces.resize(parts.lights.size());
    const auto look_at = [&](const auto& shapes) {
        for (const auto& shape : shapes) {
            if (shape.traits.light == kNoLight) continue;
            const auto light = static_cast<std::size_t>(shape.traits.light);
            cut_out[light] = cut_out[light] || shape.traits.alpha;
            on_solid_surfaces[light] = !cut_out[light];
        }
    };
    look_at(parts.meshes), look_at(parts.quadrics), look_at(parts.patches), look_at(parts.curves);
    world = std::make_unique<const ShapeSet>(std::move(static_cast<Shapes&>(parts)), parts.materials);
    any_medium_interface = world->any_medium_interface();
    prototypes.reserve(parts.prototypes.size());
    for (Shapes& shapes : parts.prototypes) prototypes.emplace_back(std::move(shapes), parts.materials);
    parts.prototypes.clear();
    instances.reserve(parts.instances.size());
    for (const Instance& instance : parts.instances) {
        assert(instance.prototype < prototypes.size());
        instances.push_back({instance.prototype, InstancePlacement(instance.world_from_prototype)});
        if (any_medium_interface) continue;
        if (const auto own = prototypes[instance.prototype].any_medium_interface())
            any_medium_interface = carried(*own, instance.world_from_prototype);
    }
    parts.instances = {};
}

void Scene::Impl::count() {
    const auto add = [this](const ShapeSet& set) {
        const ShapeSet::Counts& own = set.counts();
        counts.triangles += own.triangles;
        counts.quadrics += own.quadrics;
        counts.patches += own.patches;
        counts.curves += own.curves;
        counts.degenerate_triangles += own.degenerate_triangles;
        counts.geometry_bytes += own.bytes;
        has_specular = has_specular || set.has_specular();
        has_medium_interfaces = has_medium_interfaces || set.has_medium_interfaces();
        has_panes = has_panes || set.has_panes();
    };
    add(*world);
    for (const ShapeSet& set : prototypes) add(set);
    counts.prototypes = prototypes.size();
    counts.instances = instances.size();
    counts.triangles_seen = world->counts().triangles;
    for (const auto& placed : instances) {
        counts.triangles_seen += prototypes[placed.prototype].counts().triangles;
    }
    counts.geometry_bytes += accelerator->bytes() + instances.capacity() * sizeof(instances[0]);
}

Scene::Scene(SceneParts parts, const Workers& workers)
    : impl_(std::make_unique<Impl>(std::move(parts), workers)) {
    // This comes last, because it traces rays through the finished scene.
    auto& places = impl_->light_places;
    places.resize(lights().size());
    if (media().empty()) return;
    parallel_chunks(workers, static_cast<std::int64_t>(places.size()), [&](std::int64_t i) {
        const Light& light = *lights()[static_cast<std::size_t>(i)];
        Impl::LightPlace& place = places[static_cast<std::size_t>(i)];
        const auto first = first_particle(light);
        if (!first) return;
        place.medium = medium_around(*this, first->from, first->d);
        if (light.is_at_infinity()) place.reach = passes_without_end(media(), place.medium);
    });
}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::optional<Hit> Scene::intersect(const Ray& ray) const {
    return nearest(ray, kSurfaces);
}

std::optional<Hit> Scene::intersect_with_medium_interfaces(const Ray& ray) const {
    return nearest(ray, kSurfaces | kMediumInterfaces);
}

std::optional<Hit> Scene::intersect_medium_interface(const Ray& ray) const {
    return nearest(ray, kMediumInterfaces);
}

bool Scene::is_medium_interface(const Hit& hit) const {
    return hit.light == kNoLight && is_interface(impl_->parts.materials[hit.material]);
}

std::optional<ClosestHit> Scene::closest_hit(const Ray& ray, unsigned layers, bool shadow) const {
    if (!is_usable_ray(ray)) {
        impl_->invalid_rays.add();
        return std::nullopt;
    }
    impl_->rays.add();
    std::optional<ClosestHit> closest;
    impl_->accelerator->nearest(ray, layers, closest, shadow);
    return closest;
}

std::optional<ClosestHit> Scene::closest_hit(const Ray& ray) const {
    return closest_hit(ray, kSurfaces);
}

void Scene::closest_hits(std::span<const Ray> rays, std::span<std::optional<ClosestHit>> closest) const {
    assert(closest.size() == rays.size());
    std::uint64_t invalid = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        closest[i].reset();
        if (!is_usable_ray(rays[i])) {
            ++invalid;
            continue;
        }
        impl_->accelerator->nearest(rays[i], kSurfaces, closest[i]);
        if (closest[i]) prefetch_corners(*closest[i]);
    }
    // The counter is updated once for all rays, because contended updates are slow.
    impl_->rays.add(rays.size() - invalid);
    if (invalid > 0) impl_->invalid_rays.add(invalid);
}

void Scene::prefetch_corners(const ClosestHit& closest) const {
    impl_->set_of(closest).prefetch_corners(closest.primitive);
}

void Scene::prefetch_vertices(const ClosestHit& closest) const {
    impl_->set_of(closest).prefetch_vertices(closest.primitive);
}

std::optional<Hit> Scene::nearest(const Ray& ray, unsigned layers, bool shadow) const {
    const auto closest = closest_hit(ray, layers, shadow);
    if (!closest) return std::nullopt;
    return intersect(ray, *closest);
}

float Scene::distance(const Ray& ray, const ClosestHit& closest) const {
    const auto t =
        static_cast<float>(impl_->set_of(closest).exact(closest.primitive, impl_->local(ray, closest)).t);
    return std::min(t, ray.t_max);  // rounding may put it beyond t_max
}

std::optional<NormalField> Scene::normal_field(const Ray& ray, const ClosestHit& closest) const {
    const ShapeSet& set = impl_->set_of(closest);
    const LocalRay local = impl_->local(ray, closest);
    const auto field = set.normal_field(set.exact(closest.primitive, local), local);
    if (!field || !(field->value.length2() > 0)) return std::nullopt;
    if (closest.instance == kNoInstance) return field;
    return field->in_frame(impl_->instances[closest.instance].placement.to_local);
}

Hit Scene::intersect(const Ray& ray, const ClosestHit& closest) const {
    Hit hit;
    intersect(ray, closest, hit);
    return hit;
}

void Scene::intersect(const Ray& ray, const ClosestHit& closest, Hit& hit) const {
    const PrimitiveHit& primitive = closest.primitive;
    const ShapeSet& set = impl_->set_of(closest);
    set.exact_hit(primitive, impl_->local(ray, closest), hit);
    if (closest.instance != kNoInstance) hit = impl_->instances[closest.instance].placement.world(hit);
    const SurfaceTraits& traits = set.traits(primitive.geometry, primitive.primitive);
    hit.t = std::min(hit.t, ray.t_max);  // rounding may put it beyond t_max
    hit.wo = -ray.d;
    hit.material = traits.material;
    hit.light = traits.light;
    hit.primitive = primitive.primitive;
    hit.media = traits.media;
}

Ray way_from(const SurfacePoint& x, const V3f& w, float distance) {
    Ray ray{x.towards(w), w, distance};
    if (!std::isfinite(distance)) return ray;
    // The start is moved along the normal, but the end must stay: a large surface's shift would carry an
    // oblique ray past a small lamp, which would then shadow itself.
    const V3f way = x.p + distance * w - ray.o;
    if (way.dot(w) <= 0) {  // the start is already beyond the end
        ray.t_max = 0;
        return ray;
    }
    ray.t_max = way.length();
    ray.d = way / ray.t_max;  // > 0, because way has a component along w
    return ray;
}

Ray way_between(const SurfacePoint& x, const SurfacePoint& y) {
    const V3f w = y.p - x.p;
    const V3f begin = x.towards(w), way = y.towards(-w) - begin;
    const float distance = way.length();
    return distance > 0 ? way_from(SurfacePoint{begin}, way / distance, distance) : Ray{begin, w, 0};
}

bool Scene::occluded(const Ray& ray, unsigned layers) const {
    if (ray.t_max == 0) return false;
    if (!is_usable_ray(ray)) {
        impl_->invalid_rays.add();
        return true;
    }
    impl_->rays.add();
    return impl_->accelerator->occluded(ray, layers);
}

bool Scene::blocked(const Ray& ray, bool shadow) const {
    return shadow ? occluded(ray, kOpaque) : closest_hit(ray, kOpaque).has_value();
}

std::optional<Hit> Scene::intersect_pane(const Ray& ray, bool shadow) const {
    return nearest(ray, kPanes, shadow);
}

bool Scene::unoccluded(const SurfacePoint& x, const V3f& w, float distance) const {
    return !occluded(way_from(x, w, distance), kSurfaces);
}

bool Scene::unoccluded_along(const V3f& from, const V3f& way) const {
    const float distance = way.length();
    return !(distance > 0) || unoccluded(SurfacePoint{from}, way / distance, distance);
}

std::uint64_t Scene::count_hits(std::span<const Ray> rays, const Workers& workers) const {
    constexpr std::int64_t kGrain = 4096;
    std::atomic<std::uint64_t> hits{0};
    parallel_ranges(workers, static_cast<std::int64_t>(rays.size()), kGrain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
                        const auto first = static_cast<std::size_t>(begin);
                        const auto count = static_cast<std::size_t>(end - begin);
                        hits += impl_->accelerator->count_hits(rays.subspan(first, count), kSurfaces);
                    });
    return hits;
}

Bsdf Scene::bsdf(const Hit& hit) const {
    const Material& material = impl_->parts.materials[hit.material];
    if (is_interface(material)) return {BlackLobe{}, hit.ns, hit.at.n, hit.dpdu};  // one that carries a light
    return make_bsdf(material, hit, impl_->parts.origin);
}

std::span<const std::unique_ptr<Light>> Scene::lights() const {
    return impl_->parts.lights;
}
const LightGroups& Scene::light_groups() const {
    return impl_->parts.light_groups;
}
std::optional<FluxUnit> Scene::stated_unit() const {
    return impl_->parts.unit;
}
std::uint32_t Scene::object_of(const ClosestHit& closest) const {
    const ShapeSet& world = *impl_->world;
    const std::uint32_t first_quadric = world.quadrics_id(), patches = first_quadric + world.quadrics();
    if (closest.instance != kNoInstance) return patches + 2 + closest.instance;
    const auto& [geometry, primitive] = std::pair(closest.primitive.geometry, closest.primitive.primitive);
    if (geometry < first_quadric) return 1 + geometry;
    return 1 + (geometry == first_quadric ? first_quadric + primitive : patches);
}
const LightTree& Scene::light_tree() const {
    return impl_->light_tree;
}
const LightPicker& Scene::picker() const {
    return impl_->picker;
}
std::span<const std::uint32_t> Scene::impostors() const {
    return impl_->impostors;
}
bool Scene::has_sky() const {
    return impl_->has_sky;
}
std::span<const Material> Scene::materials() const {
    return impl_->parts.materials;
}
bool Scene::has_specular() const {
    return impl_->has_specular;
}
const SceneMedia& Scene::media() const {
    return impl_->parts.media;
}
const std::optional<Box3f>& Scene::any_medium_interface() const {
    return impl_->any_medium_interface;
}

bool Scene::has_medium_interfaces() const {
    return impl_->has_medium_interfaces;
}
bool Scene::has_panes() const {
    return impl_->has_panes;
}
bool Scene::is_on_solid_surfaces(std::uint32_t light) const {
    return impl_->on_solid_surfaces[light];
}
std::int32_t Scene::medium_of_light(std::uint32_t light) const {
    return impl_->light_places[light].medium;
}
const Rgb& Scene::reach_of_light(std::uint32_t light) const {
    return impl_->light_places[light].reach;
}
const Box3f& Scene::bounds() const {
    return impl_->bounds;
}
SceneSphere Scene::sphere() const {
    return enclosing_sphere(impl_->bounds);
}
const V3d& Scene::origin() const {
    return impl_->parts.origin;
}
Scene::Counts Scene::counts() const {
    return impl_->counts;
}
std::uint64_t Scene::rays() const {
    return impl_->rays.total();
}
std::uint64_t Scene::invalid_rays() const {
    return impl_->invalid_rays.total();
}

}  // namespace lucerna
