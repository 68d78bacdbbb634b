// Only this file uses Embree.
//
// Embree shares the buffers of meshes and curves with the shapes. Quadrics and patches are user geometries,
// for which callbacks ask the ShapeSet in double precision. Embree finds the nearest primitive and the place
// on it; position, normals and tangents are computed from the primitive itself, and so lie on the surface to
// within float32's rounding. A prototype is an Embree scene of its own that instances place in the world.
//
// A cut-out lets a ray pass with probability 1 - alpha. The decision uses a hash of the ray and the
// primitive, so that the same ray always meets the same surfaces.
#include "engine/scene/accelerator.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <deque>
#include <new>
#include <stdexcept>
#include <string>

#include "engine/base/error.h"
#include "engine/base/float_traps.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

struct DeviceDeleter {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct GeometryDeleter {
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<RTCDeviceTy, DeviceDeleter>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, SceneDeleter>;
using Geometry = std::unique_ptr<RTCGeometryTy, GeometryDeleter>;

// Embree 4 has another name for the context of a query, and takes it as one of a query's arguments.
#if RTC_VERSION_MAJOR >= 4
using QueryContext = RTCRayQueryContext;

void embree_initialise(QueryContext& context) {
    rtcInitRayQueryContext(&context);
}
void embree_intersect(RTCScene scene, QueryContext& context, RTCRayHit& found) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    rtcIntersect1(scene, &found, &arguments);
}
void embree_occluded(RTCScene scene, QueryContext& context, RTCRay& ray) {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context;
    rtcOccluded1(scene, &ray, &arguments);
}
#else
using QueryContext = RTCIntersectContext;

void embree_initialise(QueryContext& context) {
    rtcInitIntersectContext(&context);
}
void embree_intersect(RTCScene scene, QueryContext& context, RTCRayHit& found) {
    rtcIntersect1(scene, &context, &found);
}
void embree_occluded(RTCScene scene, QueryContext& context, RTCRay& ray) {
    rtcOccluded1(scene, &context, &ray);
}
#endif

// Records Embree's first error, because an exception must not pass through Embree's C frames.
struct EmbreeError {
    RTCError code = RTC_ERROR_NONE;
    std::string text;

    static void record(void* self, RTCError code, const char* text) {
        auto& error = *static_cast<EmbreeError*>(self);
        if (error.code != RTC_ERROR_NONE) return;
        error.code = code;
        error.text = text != nullptr ? text : "";
    }
    void check() const {
        if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
        if (code != RTC_ERROR_NONE) throw std::runtime_error("Embree: " + text);
    }
};

// Tells a callback which geometry it is called for.
struct GeometryUser {
    const ShapeSet* set;
    std::uint32_t geometry;
};

// Holds the context of one ray. Embree's part must be the first member: callbacks get a pointer to that.
struct RayContext {
    QueryContext embree;
    const Ray& ray;  // in the world
    const std::vector<Accelerator::Placed>& instances;
    unsigned first_instance;  // its geometry number in the world's scene
    const V3d& origin;
    bool shadow;                      // meets cut-outs as shadows do (shadow_alpha)
    int traps = FloatTraps::armed();  // traps for our callbacks; Embree itself runs without traps
    PrimitiveHit nearest = {};        // the user primitive that was met last, in full precision

    static RayContext& of(QueryContext* context) { return *reinterpret_cast<RayContext*>(context); }

    const Accelerator::Placed* placed(unsigned instance) const {
        return instance == RTC_INVALID_GEOMETRY_ID ? nullptr : &instances[instance - first_instance];
    }
    // Returns the ray in the frame of the shapes, in double, independent of Embree's rounded transformation.
    LocalRay local(unsigned instance) const {
        const Accelerator::Placed* there = placed(instance);
        return there ? there->placement.local(ray) : LocalRay{V3d(ray.o), V3d(ray.d)};
    }
};

std::uint64_t mixed(std::uint64_t state, std::uint32_t value) {  // one step of splitmix64 for each value
    std::uint64_t z = state + value + 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
}

// Returns a number in [0, 1) that is a function of the ray and the place on it.
float chance(const Ray& ray, unsigned instance, const PrimitiveHit& primitive_hit) {
    std::uint64_t state = 0;
    for (int i = 0; i < 3; ++i) {
        state = mixed(state, std::bit_cast<std::uint32_t>(ray.o[i]));
        state = mixed(state, std::bit_cast<std::uint32_t>(ray.d[i]));
    }
    const auto t = std::bit_cast<std::uint32_t>(static_cast<float>(primitive_hit.t));  // separates two walls
    for (const std::uint32_t id : {instance, primitive_hit.geometry, primitive_hit.primitive, t})
        state = mixed(state, id);
    return static_cast<float>(state >> 40) * 0x1p-24F;
}

bool has_cut_outs(const SurfaceTraits& traits) {
    return traits.alpha || traits.shadow_alpha;
}

// --- Embree callbacks. Rays come one at a time (rtcIntersect1, rtcOccluded1), so that a packet of width 1 is
// a plain struct.

// Tells whether the ray passes the surface there through a cut-out.
bool passes(const RayContext& context, unsigned instance, const ShapeSet& set,
            const PrimitiveHit& primitive_hit) {
    const SurfaceTraits& traits = set.traits(primitive_hit.geometry, primitive_hit.primitive);
    if (!has_cut_outs(traits)) return false;
    const V3d p = V3d(context.ray.o) + primitive_hit.t * V3d(context.ray.d) + context.origin;
    const TexturePoint at(set.uv(primitive_hit, context.local(instance)), p);
    const auto through = [&](const FloatTexture* texture) {
        if (!texture) return false;
        const float alpha = texture->at(at);
        return alpha < 1 && (!(alpha > 0) || chance(context.ray, instance, primitive_hit) >= alpha);
    };
    return through(traits.alpha.get()) || (context.shadow && through(traits.shadow_alpha.get()));
}

// Returns the nearest crossing of a quadric or patch that no cut-out removes.
std::optional<PrimitiveHit> cross(const RayContext& context, unsigned instance, const GeometryUser& user,
                                  std::uint32_t primitive, unsigned layers, double t_max) {
    const ShapeSet& set = *user.set;
    if ((set.layer(set.traits(user.geometry, primitive)) & layers) == 0) return std::nullopt;
    const LocalRay ray = context.local(instance);
    double t_min = 0;
    for (;;) {
        const auto primitive_hit = set.cross(user.geometry, primitive, ray, t_min, t_max);
        if (!primitive_hit || !passes(context, instance, set, *primitive_hit)) return primitive_hit;
        t_min = primitive_hit->t;
    }
}

void user_bounds(const RTCBoundsFunctionArguments* args) {
    const auto& user = *static_cast<const GeometryUser*>(args->geometryUserPtr);
    const Box3f box = user.set->primitive_bounds(user.geometry, args->primID);
    RTCBounds& out = *args->bounds_o;
    out.lower_x = box.min.x, out.lower_y = box.min.y, out.lower_z = box.min.z;
    out.upper_x = box.max.x, out.upper_y = box.max.y, out.upper_z = box.max.z;
}

void user_intersect(const RTCIntersectFunctionNArguments* args) {
    assert(args->N == 1);
    if (args->valid[0] == 0) return;
    RayContext& context = RayContext::of(args->context);
    const FloatTraps ours(context.traps);
    const auto& user = *static_cast<const GeometryUser*>(args->geometryUserPtr);
    auto& rayhit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
    const unsigned instance = args->context->instID[0];
    const auto primitive_hit =
        cross(context, instance, user, args->primID, rayhit.ray.mask, static_cast<double>(rayhit.ray.tfar));
    if (!primitive_hit) return;
    rayhit.ray.tfar = static_cast<float>(primitive_hit->t);
    rayhit.hit.geomID = args->geomID;
    rayhit.hit.primID = args->primID;
    rayhit.hit.instID[0] = instance;
    context.nearest = *primitive_hit;
}

void user_occluded(const RTCOccludedFunctionNArguments* args) {
    assert(args->N == 1);
    if (args->valid[0] == 0) return;
    const auto& user = *static_cast<const GeometryUser*>(args->geometryUserPtr);
    auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
    const RayContext& context = RayContext::of(args->context);
    const FloatTraps ours(context.traps);
    if (cross(context, args->context->instID[0], user, args->primID, ray.mask,
              static_cast<double>(ray.tfar))) {
        ray.tfar = -INFINITY;
    }
}

void cut_out(const RTCFilterFunctionNArguments* args) {
    assert(args->N == 1);
    if (args->valid[0] == 0) return;
    const auto& user = *static_cast<const GeometryUser*>(args->geometryUserPtr);
    const auto& ray = *reinterpret_cast<const RTCRay*>(args->ray);
    const auto& hit = *reinterpret_cast<const RTCHit*>(args->hit);
    const PrimitiveHit embrees{user.geometry,
                               hit.primID,
                               static_cast<double>(ray.tfar),
                               static_cast<double>(hit.u),
                               static_cast<double>(hit.v),
                               {hit.Ng_x, hit.Ng_y, hit.Ng_z}};
    const RayContext& context = RayContext::of(args->context);
    const FloatTraps ours(context.traps);
    const PrimitiveHit primitive_hit = user.set->exact(embrees, context.local(hit.instID[0]));
    if (passes(context, hit.instID[0], *user.set, primitive_hit)) args->valid[0] = 0;
}

RTCRay embree_ray(const Ray& from, unsigned layers) {
    RTCRay ray{};
    ray.org_x = from.o.x, ray.org_y = from.o.y, ray.org_z = from.o.z;
    ray.dir_x = from.d.x, ray.dir_y = from.d.y, ray.dir_z = from.d.z;
    ray.tnear = 0;
    ray.tfar = from.t_max;
    ray.mask = layers;
    return ray;
}

// Returns the nearest primitive that Embree finds. A user geometry's hit is in `context` in full precision.
RTCRayHit intersected(RTCScene scene, const Ray& ray, unsigned layers, RayContext& context) {
    RTCRayHit found;
    found.ray = embree_ray(ray, layers);
    found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    const FloatTraps embrees(kNoFaults);
    embree_intersect(scene, context.embree, found);
    return found;
}

RTCGeometryType type_of(Curves::Kind kind) {
    switch (kind) {
        case Curves::Kind::flat:
            return RTC_GEOMETRY_TYPE_FLAT_BEZIER_CURVE;
        case Curves::Kind::round:
            return RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE;
        case Curves::Kind::ribbon:
            break;
    }
    return RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_BEZIER_CURVE;
}

}  // namespace

int embree_version() {
    return RTC_VERSION_MAJOR;
}

struct Accelerator::Impl {
    const ShapeSet& world;
    const std::vector<ShapeSet>& sets;  // those of the prototypes
    const std::vector<Placed>& instances;
    V3d origin;
    std::deque<GeometryUser> users;  // a deque, because callbacks keep the elements' addresses
    std::deque<std::vector<std::uint32_t>> curve_starts;  // shared with Embree
    std::atomic<std::int64_t> bytes{0};

    // The order matters: the scenes are destroyed before the device, and both before what they refer to.
    EmbreeError error;
    Device device;
    std::vector<EmbreeScene> prototypes;
    EmbreeScene scene;

    Impl(const ShapeSet& own, const std::vector<ShapeSet>& of_prototypes, const std::vector<Placed>& placed,
         const V3d& at, int threads);
    void open_device(int threads);
    EmbreeScene fill(const ShapeSet& set);
    void attach_mesh(RTCScene to, const ShapeSet& set, std::uint32_t id);
    void attach_curves(RTCScene to, const ShapeSet& set, std::uint32_t id);
    void attach_user(RTCScene to, const ShapeSet& set, std::uint32_t id, std::uint32_t primitives);
    void attach_instance(std::uint32_t index);
    void finish(RTCScene to, RTCGeometry geometry, const ShapeSet& set, std::uint32_t id);

    RayContext context(const Ray& ray, bool shadow) const {
        RayContext made{{}, ray, instances, world.geometries(), origin, shadow};
        embree_initialise(made.embree);
        return made;
    }
};

Accelerator::Impl::Impl(const ShapeSet& own, const std::vector<ShapeSet>& of_prototypes,
                        const std::vector<Placed>& placed, const V3d& at, int threads)
    : world(own), sets(of_prototypes), instances(placed), origin(at) {
    const FloatTraps embrees(kNoFaults);
    open_device(threads);
    for (const ShapeSet& set : sets) {
        prototypes.push_back(fill(set));
        rtcCommitScene(prototypes.back().get());
        error.check();
    }
    scene = fill(world);
    for (std::uint32_t i = 0; i < instances.size(); ++i) attach_instance(i);
    rtcCommitScene(scene.get());
    error.check();
}

void Accelerator::Impl::open_device(int threads) {
    const int count = std::max(1, threads);
    require_threads(2 * count);  // Embree's and ours
    std::string settings = fmt::format("threads={}", count);
    if (!embree_isa().empty()) settings += fmt::format(",isa={}", embree_isa());
    device.reset(rtcNewDevice(settings.c_str()));
    if (!device) {
        throw InputError(
            fmt::format("Embree cannot create a device with {} threads (Embree error {}): threads may be "
                        "limited; use fewer --threads",
                        count, static_cast<int>(rtcGetDeviceError(nullptr))));
    }
    rtcSetDeviceErrorFunction(device.get(), &EmbreeError::record, &error);
    if (rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0) {
        throw std::runtime_error("Embree: this build of the library does not support ray masks");
    }
    rtcSetDeviceMemoryMonitorFunction(
        device.get(),
        [](void* self, ssize_t change, bool) {
            static_cast<Impl*>(self)->bytes += change;
            return true;
        },
        this);
}

EmbreeScene Accelerator::Impl::fill(const ShapeSet& set) {
    EmbreeScene made(rtcNewScene(device.get()));
    error.check();
    rtcSetSceneFlags(made.get(), RTC_SCENE_FLAG_ROBUST);  // no cracks between neighbours
    for (std::uint32_t id = 0; id < set.curves_begin(); ++id) attach_mesh(made.get(), set, id);
    for (std::uint32_t id = set.curves_begin(); id < set.quadrics_id(); ++id) {
        attach_curves(made.get(), set, id);
    }
    attach_user(made.get(), set, set.quadrics_id(), set.quadrics());
    attach_user(made.get(), set, set.patches_id(), set.patches());
    return made;
}

void Accelerator::Impl::attach_mesh(RTCScene to, const ShapeSet& set, std::uint32_t id) {
    const Mesh& mesh = set.shapes().meshes[id];
    if (mesh.triangles.empty() || set.layer(mesh.traits) == 0) return;
    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    // The last vertex is padding, because Embree reads 16 bytes at a time.
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.p.data(), 0,
                               sizeof(V3f), mesh.p.size() - 1);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(V3i), mesh.triangles.size());
    finish(to, geometry.get(), set, id);
}

void Accelerator::Impl::attach_curves(RTCScene to, const ShapeSet& set, std::uint32_t id) {
    const Curves& curves = set.shapes().curves[id - set.curves_begin()];
    if (curves.segments.empty() || set.layer(curves.traits) == 0) return;
    std::vector<std::uint32_t>& starts = curve_starts.emplace_back(curves.segments.size());
    for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = static_cast<std::uint32_t>(4 * i);
    const Geometry geometry(rtcNewGeometry(device.get(), type_of(curves.kind)));
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                               curves.control.data(), 0, sizeof(Curves::V4f), curves.control.size());
    if (!curves.n.empty()) {  // the last normal is padding, too, as for vertices
        rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3,
                                   curves.n.data(), 0, sizeof(V3f), curves.n.size() - 1);
    }
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, starts.data(), 0,
                               sizeof(std::uint32_t), starts.size());
    constexpr float kPieces = 16;  // number of straight pieces by which Embree approximates a flat segment
    if (curves.kind == Curves::Kind::flat) rtcSetGeometryTessellationRate(geometry.get(), kPieces);
    finish(to, geometry.get(), set, id);
}

void Accelerator::Impl::attach_user(RTCScene to, const ShapeSet& set, std::uint32_t id,
                                    std::uint32_t primitives) {
    if (primitives == 0) return;
    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    users.push_back({&set, id});
    rtcSetGeometryUserPrimitiveCount(geometry.get(), primitives);
    rtcSetGeometryMask(geometry.get(),
                       kSurfaces | kMediumInterfaces);  // callbacks check each primitive's layer
    rtcSetGeometryUserData(geometry.get(), &users.back());
    rtcSetGeometryBoundsFunction(
        geometry.get(), [](const RTCBoundsFunctionArguments* args) { user_bounds(args); }, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), &user_intersect);
    rtcSetGeometryOccludedFunction(geometry.get(), &user_occluded);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(to, geometry.get(), id);
    error.check();
}

void Accelerator::Impl::finish(RTCScene to, RTCGeometry geometry, const ShapeSet& set, std::uint32_t id) {
    const SurfaceTraits& traits = set.traits(id, 0);
    rtcSetGeometryMask(geometry, set.layer(traits));
    if (has_cut_outs(traits)) {
        users.push_back({&set, id});
        rtcSetGeometryUserData(geometry, &users.back());
        rtcSetGeometryIntersectFilterFunction(geometry, &cut_out);
        rtcSetGeometryOccludedFilterFunction(geometry, &cut_out);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(to, geometry, id);
    error.check();
}

void Accelerator::Impl::attach_instance(std::uint32_t index) {
    const Placed& placed = instances[index];
    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(geometry.get(), prototypes[placed.prototype].get());
    // Imath's rows are the images of the axes, which are Embree's columns.
    float columns[12];
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 3; ++j) {
            columns[3 * i + j] = static_cast<float>(placed.placement.to_world[i][j]);
        }
    }
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcSetGeometryMask(geometry.get(), kSurfaces | kMediumInterfaces);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene.get(), geometry.get(), world.geometries() + index);
    error.check();
}

Accelerator::Accelerator(const ShapeSet& world, const std::vector<ShapeSet>& prototypes,
                         const std::vector<Placed>& instances, const V3d& origin, int threads)
    : impl_(std::make_unique<Impl>(world, prototypes, instances, origin, threads)) {}
Accelerator::~Accelerator() = default;

void Accelerator::nearest(const Ray& ray, unsigned layers, std::optional<ClosestHit>& closest,
                          bool shadow) const {
    RayContext context = impl_->context(ray, shadow);
    const RTCRayHit found = intersected(impl_->scene.get(), ray, layers, context);
    const RTCHit& hit = found.hit;
    if (hit.geomID == RTC_INVALID_GEOMETRY_ID) return;

    const std::uint32_t instance =
        hit.instID[0] == RTC_INVALID_GEOMETRY_ID ? kNoInstance : hit.instID[0] - impl_->world.geometries();
    const ShapeSet& set =
        instance == kNoInstance ? impl_->world : impl_->sets[impl_->instances[instance].prototype];
    if (hit.geomID >= set.quadrics_id()) {
        closest = ClosestHit{context.nearest, instance};
        return;
    }
    closest = ClosestHit{{hit.geomID,
                          hit.primID,
                          static_cast<double>(found.ray.tfar),
                          static_cast<double>(hit.u),
                          static_cast<double>(hit.v),
                          {hit.Ng_x, hit.Ng_y, hit.Ng_z}},
                         instance};
}

bool Accelerator::occluded(const Ray& from, unsigned layers) const {
    RTCRay ray = embree_ray(from, layers);
    RayContext context = impl_->context(from, true);
    const FloatTraps embrees(kNoFaults);
    embree_occluded(impl_->scene.get(), context.embree, ray);
    return !(ray.tfar >= 0);  // Embree sets tfar to -infinity for an occluded ray
}

std::uint64_t Accelerator::count_hits(std::span<const Ray> rays, unsigned layers) const {
    std::uint64_t hits = 0;
    for (const Ray& ray : rays) {
        RayContext context = impl_->context(ray, false);
        const RTCRayHit found = intersected(impl_->scene.get(), ray, layers, context);
        hits += found.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
    return hits;
}

std::uint64_t Accelerator::bytes() const {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, impl_->bytes));
}

}  // namespace lucerna
