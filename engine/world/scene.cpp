// The only file that names Embree.
//
// Meshes lie in Embree as they lie in SceneParts (shared buffers); quadrics are one user geometry that asks
// QuadricShape. Embree says which primitive is nearest and where on it; position, normals and tangent are
// then made here from the primitive itself, in double, so they lie on the surface to within float32's
// rounding.
//
// Interfaces (pbrt's "interface" material) are not given to Embree at all: no ray has to step through them.
// One that carries a light is kept, as a black surface that emits. One that is a border between media is
// kept in a layer of its own, which only rays that ask for it meet (Embree's ray masks).
#include "engine/world/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

#include "engine/base/error.h"
#include "engine/base/frame.h"
#include "engine/world/quadric.h"

namespace lucerna {
namespace {

// Embree's limit for coordinates is 1.844e18.
constexpr float kLargest = 1e18F;

bool is_usable(const V3f& p) {
    return std::fabs(p.x) <= kLargest && std::fabs(p.y) <= kLargest && std::fabs(p.z) <= kLargest;
}

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

// Remembers Embree's first complaint: an exception must not pass through its C frames.
struct Complaint {
    RTCError code = RTC_ERROR_NONE;
    std::string text;

    static void note(void* self, RTCError code, const char* text) {
        auto& complaint = *static_cast<Complaint*>(self);
        if (complaint.code != RTC_ERROR_NONE) return;
        complaint.code = code;
        complaint.text = text != nullptr ? text : "";
    }
    void check() const {
        if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
        if (code != RTC_ERROR_NONE) throw std::runtime_error("Embree: " + text);
    }
};

V3f vertex_of(const Mesh& mesh, std::int32_t index) {
    assert(index >= 0 && static_cast<std::size_t>(index) < mesh.p.size());
    return mesh.p[static_cast<std::size_t>(index)];
}

V3d cross_of(const Mesh& mesh, const V3i& triangle) {
    const V3d p0(vertex_of(mesh, triangle.x));
    return (V3d(vertex_of(mesh, triangle.y)) - p0).cross(V3d(vertex_of(mesh, triangle.z)) - p0);
}

bool is_degenerate(const Mesh& mesh, const V3i& triangle) {
    for (int c = 0; c < 3; ++c) {
        if (!is_usable(vertex_of(mesh, triangle[c]))) return true;
    }
    return !(cross_of(mesh, triangle).length2() > 0);
}

// What a ray may meet: bits of Embree's masks.
constexpr unsigned kSurfaces = 1;
constexpr unsigned kBorders = 2;

// In which layer a surface stands; 0: it is not there.
unsigned layer_of(const SurfaceTraits& traits, const std::vector<Material>& materials) {
    assert(traits.material < materials.size());
    if (traits.light != kNoLight || !is_interface(materials[traits.material])) return kSurfaces;
    return traits.media.border ? kBorders : 0;
}

// The quadrics as Embree's callbacks see them.
struct QuadricLayer {
    std::vector<QuadricShape> shapes;  // one per present quadric
    std::vector<unsigned> layers;      // of the same index

    bool meets(unsigned shape, unsigned mask) const { return (layers[shape] & mask) != 0; }
};

void extend(Box3f& box, const Mesh& mesh) {
    for (const V3i& triangle : mesh.triangles) {
        if (is_degenerate(mesh, triangle)) continue;
        for (int c = 0; c < 3; ++c) box.extendBy(vertex_of(mesh, triangle[c]));
    }
}

// --- quadrics as Embree sees them
// ------------------------------------------------------------------------------

void quadric_bounds(const RTCBoundsFunctionArguments* args) {
    const auto& shapes = static_cast<const QuadricLayer*>(args->geometryUserPtr)->shapes;
    const Box3f& box = shapes[args->primID].bounds();
    RTCBounds& out = *args->bounds_o;
    out.lower_x = box.min.x, out.lower_y = box.min.y, out.lower_z = box.min.z;
    out.upper_x = box.max.x, out.upper_y = box.max.y, out.upper_z = box.max.z;
}

Ray ray_of(const RTCRay& r) {
    return {{r.org_x, r.org_y, r.org_z}, {r.dir_x, r.dir_y, r.dir_z}, r.tfar};
}

// Rays come one at a time (rtcIntersect1, rtcOccluded1), so a packet of width 1 is a plain struct.
void quadric_intersect(const RTCIntersectFunctionNArguments* args) {
    assert(args->N == 1);
    if (args->valid[0] == 0) return;
    const auto& quadrics = *static_cast<const QuadricLayer*>(args->geometryUserPtr);
    auto& rayhit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
    if (!quadrics.meets(args->primID, rayhit.ray.mask)) return;
    const std::optional<double> t = quadrics.shapes[args->primID].nearest(ray_of(rayhit.ray));
    if (!t) return;
    rayhit.ray.tfar = static_cast<float>(*t);
    rayhit.hit.geomID = args->geomID;
    rayhit.hit.primID = args->primID;
    rayhit.hit.instID[0] = args->context->instID[0];
}

void quadric_occluded(const RTCOccludedFunctionNArguments* args) {
    assert(args->N == 1);
    if (args->valid[0] == 0) return;
    const auto& quadrics = *static_cast<const QuadricLayer*>(args->geometryUserPtr);
    auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
    if (!quadrics.meets(args->primID, ray.mask)) return;
    if (quadrics.shapes[args->primID].nearest(ray_of(ray))) ray.tfar = -INFINITY;
}

// Embree aborts on rays that are not numbers.
bool is_usable(const V3f& o, const V3f& d, float t_max) {
    return is_usable(o) && is_usable(d) && !std::isnan(t_max);
}

RTCRay embree_ray(const V3f& o, const V3f& d, float t_max, unsigned layers) {
    RTCRay ray{};
    ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z;
    ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z;
    ray.tnear = 0;
    ray.tfar = t_max;
    ray.mask = layers;
    return ray;
}

// --- from a primitive to a Hit
// ---------------------------------------------------------------------------------

// The derivative of position by u; any tangent where the texture coordinates have none.
V3f tangent(const V3d& e1, const V3d& e2, const V2f uv[3], const V3f& n) {
    const double du1 = static_cast<double>(uv[1].x) - static_cast<double>(uv[0].x);
    const double dv1 = static_cast<double>(uv[1].y) - static_cast<double>(uv[0].y);
    const double du2 = static_cast<double>(uv[2].x) - static_cast<double>(uv[0].x);
    const double dv2 = static_cast<double>(uv[2].y) - static_cast<double>(uv[0].y);
    const double determinant = du1 * dv2 - dv1 * du2;
    const V3f dpdu((dv2 * e1 - dv1 * e2) / determinant);  // may be 0/0: looked at next
    return is_finite(dpdu) && dpdu.length2() > 0 ? dpdu : Frame(n).s;
}

// Turned into n's hemisphere; n itself where the interpolated one is no direction.
V3f shading_normal(const V3f& interpolated, const V3f& n) {
    const float length = interpolated.length();
    if (!(length > 0) || !std::isfinite(length)) return n;
    const V3f ns = interpolated / length;
    return ns.dot(n) < 0 ? -ns : ns;
}

float extent_of(const V3d& e1, const V3d& e2) {
    double largest = 0;
    for (int i = 0; i < 3; ++i) {
        largest = std::max({largest, std::fabs(e1[i]), std::fabs(e2[i]), std::fabs(e1[i] - e2[i])});
    }
    return static_cast<float>(largest);
}

Hit triangle_hit(const Mesh& mesh, std::uint32_t primitive, float b1, float b2) {
    const V3i& triangle = mesh.triangles[primitive];
    const V3d p0(vertex_of(mesh, triangle.x));
    const V3d e1 = V3d(vertex_of(mesh, triangle.y)) - p0;
    const V3d e2 = V3d(vertex_of(mesh, triangle.z)) - p0;
    const float b0 = 1 - b1 - b2;

    Hit hit;
    hit.at.p = V3f(p0 + static_cast<double>(b1) * e1 + static_cast<double>(b2) * e2);
    hit.at.n = V3f(e1.cross(e2).normalized());  // not 0: degenerate triangles were left out
    if (mesh.traits.reverse_orientation) hit.at.n.negate();
    hit.at.error = surface_error(hit.at.p, extent_of(e1, e2));

    const auto corner = [&triangle](int c) { return static_cast<std::size_t>(triangle[c]); };
    V2f uv[3] = {{0, 0}, {1, 0}, {1, 1}};  // pbrt's, for a triangle that has none
    if (!mesh.uv.empty()) {
        for (int c = 0; c < 3; ++c) uv[c] = mesh.uv[corner(c)];
    }
    hit.uv = b0 * uv[0] + b1 * uv[1] + b2 * uv[2];
    hit.dpdu = tangent(e1, e2, uv, hit.at.n);
    hit.dpdv = hit.at.n.cross(hit.dpdu);
    hit.ns = hit.at.n;
    if (!mesh.n.empty()) {
        hit.ns = shading_normal(b0 * mesh.n[corner(0)] + b1 * mesh.n[corner(1)] + b2 * mesh.n[corner(2)],
                                hit.at.n);
    }
    return hit;
}

Hit quadric_hit(const QuadricShape& shape, const Ray& ray, double t) {
    const QuadricShape::Surface surface = shape.at(ray, t);
    Hit hit;
    hit.at.p = V3f(surface.p);
    hit.at.n = V3f(surface.n);
    hit.at.error = surface_error(hit.at.p, shape.extent());
    hit.ns = hit.at.n;
    hit.dpdu = V3f(surface.dpdu);
    if (!(hit.dpdu.length2() > 0) || !is_finite(hit.dpdu)) hit.dpdu = Frame(hit.at.n).s;
    hit.dpdv = hit.at.n.cross(hit.dpdu);
    hit.uv = surface.uv;
    return hit;
}

}  // namespace

Box3f surface_bounds(const SceneParts& parts) {
    Box3f box;
    for (const Mesh& mesh : parts.meshes) extend(box, mesh);
    for (const Quadric& quadric : parts.quadrics) box.extendBy(QuadricShape(quadric).bounds());
    return box;
}

SceneSphere enclosing_sphere(const Box3f& box) {
    if (box.isEmpty()) return {};
    const V3d lower(box.min);
    const V3d upper(box.max);
    SceneSphere sphere;
    sphere.centre = V3f(0.5 * (lower + upper));
    // The centre was rounded; the radius makes up for it.
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

struct Scene::Impl {
    SceneParts parts;
    QuadricLayer quadrics;
    std::vector<SurfaceTraits> shape_traits;  // of the index that `quadrics` has
    LightPicker picker;
    std::vector<std::uint32_t> impostors;
    bool has_specular = false, has_borders = false;
    Box3f bounds;
    Counts counts;
    Counter rays, invalid_rays;

    // In the order of their making: the scene goes before the device, both before what they refer to.
    Complaint complaint;
    Device device;
    EmbreeScene embree;

    Impl(SceneParts given, const Workers& workers);
    void drop_degenerate(Mesh& mesh);
    void attach(Mesh& mesh, unsigned id);
    void attach_shapes(unsigned id);
    unsigned quadrics_id() const { return static_cast<unsigned>(parts.meshes.size()); }
};

Scene::Impl::Impl(SceneParts given, const Workers& workers) : parts(std::move(given)), picker(parts.lights) {
    for (std::uint32_t i = 0; i < parts.lights.size(); ++i) {
        if (parts.lights[i]->has_impostor()) impostors.push_back(i);
    }
    device.reset(rtcNewDevice(fmt::format("threads={}", std::max(1, workers.threads)).c_str()));
    if (!device) throw std::runtime_error("Embree: no device can be made on this machine");
    rtcSetDeviceErrorFunction(device.get(), &Complaint::note, &complaint);
    if (rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0) {
        throw std::runtime_error("Embree: this build of the library knows no ray masks");
    }
    embree.reset(rtcNewScene(device.get()));
    complaint.check();
    rtcSetSceneFlags(embree.get(), RTC_SCENE_FLAG_ROBUST);  // no cracks between neighbours

    for (Mesh& mesh : parts.meshes) drop_degenerate(mesh);
    bounds = surface_bounds(parts);
    for (unsigned id = 0; id < parts.meshes.size(); ++id) attach(parts.meshes[id], id);
    attach_shapes(quadrics_id());
    rtcCommitScene(embree.get());
    complaint.check();
}

void Scene::Impl::drop_degenerate(Mesh& mesh) {
    assert(mesh.n.empty() || mesh.n.size() == mesh.p.size());
    assert(mesh.uv.empty() || mesh.uv.size() == mesh.p.size());
    assert(mesh.traits.light == kNoLight ||
           static_cast<std::size_t>(mesh.traits.light) < parts.lights.size());
    counts.degenerate_triangles +=
        std::erase_if(mesh.triangles, [&mesh](const V3i& triangle) { return is_degenerate(mesh, triangle); });
}

void Scene::Impl::attach(Mesh& mesh, unsigned id) {
    const unsigned layer = layer_of(mesh.traits, parts.materials);
    if (mesh.triangles.empty() || layer == 0) return;
    if (layer == kSurfaces) {
        has_specular = has_specular || is_specular(parts.materials[mesh.traits.material]);
        counts.triangles += mesh.triangles.size();
    } else {
        has_borders = true;
    }
    // Embree reads vertices 16 bytes at a time and wants numbers in all of them, used or not.
    for (V3f& p : mesh.p) {
        if (!is_usable(p)) p = V3f(0, 0, 0);
    }
    const std::size_t vertices = mesh.p.size();
    mesh.p.emplace_back(0.0F, 0.0F, 0.0F);
    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.p.data(), 0,
                               sizeof(V3f), vertices);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(V3i), mesh.triangles.size());
    rtcSetGeometryMask(geometry.get(), layer);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(embree.get(), geometry.get(), id);
    complaint.check();
}

void Scene::Impl::attach_shapes(unsigned id) {
    for (const Quadric& quadric : parts.quadrics) {
        const unsigned layer = layer_of(quadric.traits, parts.materials);
        if (layer == 0) continue;
        if (layer == kSurfaces) {
            has_specular = has_specular || is_specular(parts.materials[quadric.traits.material]);
            ++counts.quadrics;
        } else {
            has_borders = true;
        }
        quadrics.shapes.emplace_back(quadric);
        quadrics.layers.push_back(layer);
        shape_traits.push_back(quadric.traits);
    }
    if (quadrics.shapes.empty()) return;
    const Geometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(quadrics.shapes.size()));
    rtcSetGeometryMask(geometry.get(), kSurfaces | kBorders);  // the callbacks look at each one's
    rtcSetGeometryUserData(geometry.get(), &quadrics);
    rtcSetGeometryBoundsFunction(
        geometry.get(), [](const RTCBoundsFunctionArguments* args) { quadric_bounds(args); }, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), &quadric_intersect);
    rtcSetGeometryOccludedFunction(geometry.get(), &quadric_occluded);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(embree.get(), geometry.get(), id);
    complaint.check();
}

Scene::Scene(SceneParts parts, const Workers& workers)
    : impl_(std::make_unique<Impl>(std::move(parts), workers)) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

std::optional<Hit> Scene::hit(const Ray& ray) const {
    return nearest(ray, kSurfaces);
}

std::optional<Hit> Scene::hit_or_border(const Ray& ray) const {
    return nearest(ray, kSurfaces | kBorders);
}

std::optional<Hit> Scene::hit_border(const Ray& ray) const {
    return nearest(ray, kBorders);
}

bool Scene::is_border(const Hit& hit) const {
    return hit.light == kNoLight && is_interface(impl_->parts.materials[hit.material]);
}

std::optional<Hit> Scene::nearest(const Ray& ray, unsigned layers) const {
    if (!is_usable(ray.o, ray.d, ray.t_max)) {
        impl_->invalid_rays.add();
        return std::nullopt;
    }
    impl_->rays.add();
    RTCRayHit found{};
    found.ray = embree_ray(ray.o, ray.d, ray.t_max, layers);
    found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(impl_->embree.get(), &context, &found);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

    const std::uint32_t primitive = found.hit.primID;
    Hit hit;
    const SurfaceTraits* traits = nullptr;
    if (found.hit.geomID == impl_->quadrics_id()) {
        // The callback could only leave a float32 distance: solve once more for the exact one.
        const QuadricShape& shape = impl_->quadrics.shapes[primitive];
        const std::optional<double> t = shape.nearest(ray);
        hit = quadric_hit(shape, ray, t.value_or(static_cast<double>(found.ray.tfar)));
        traits = &impl_->shape_traits[primitive];
    } else {
        const Mesh& mesh = impl_->parts.meshes[found.hit.geomID];
        hit = triangle_hit(mesh, primitive, found.hit.u, found.hit.v);
        traits = &mesh.traits;
    }
    hit.wo = -ray.d;
    hit.t = found.ray.tfar;
    hit.material = traits->material;
    hit.light = traits->light;
    hit.media = traits->media;
    return hit;
}

bool Scene::visible(const SurfacePoint& x, const V3f& w, float distance) const {
    const V3f start = x.towards(w);
    // The start already lies a little on the way; the end shall not move on.
    const float t_max = distance - std::fmax(0.0F, (start - x.p).dot(w));
    if (t_max <= 0) return true;
    if (!is_usable(start, w, t_max)) {
        impl_->invalid_rays.add();
        return false;
    }
    impl_->rays.add();
    RTCRay ray = embree_ray(start, w, t_max, kSurfaces);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(impl_->embree.get(), &context, &ray);
    return ray.tfar >= 0;  // Embree marks what is hidden with -infinity
}

Bsdf Scene::bsdf(const Hit& hit) const {
    const Material& material = impl_->parts.materials[hit.material];
    if (is_interface(material)) return {BlackLobe{}, hit.ns, hit.at.n, hit.dpdu};  // one that carries a light
    return make_bsdf(material, hit, impl_->parts.origin);
}

std::span<const std::unique_ptr<Light>> Scene::lights() const {
    return impl_->parts.lights;
}
const LightPicker& Scene::picker() const {
    return impl_->picker;
}
std::span<const std::uint32_t> Scene::impostors() const {
    return impl_->impostors;
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
bool Scene::has_borders() const {
    return impl_->has_borders;
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
