#include "engine/scene/shape_set.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>

#include "engine/scene/scene.h"

namespace lucerna {
namespace {

V3f vertex_of(const Mesh& mesh, std::int32_t index) {
    assert(index >= 0 && static_cast<std::size_t>(index) < mesh.p.size());
    return mesh.p[static_cast<std::size_t>(index)];
}

bool is_degenerate(const Mesh& mesh, const V3i& triangle) {
    const V3f a = vertex_of(mesh, triangle.x), b = vertex_of(mesh, triangle.y),
              c = vertex_of(mesh, triangle.z);
    if (!is_usable(a) || !is_usable(b) || !is_usable(c)) return true;
    const V3d origin(a);
    return !((V3d(b) - origin).cross(V3d(c) - origin).length2() > 0);
}

V3f point_of(const Curves::V4f& control) {
    return {control.x, control.y, control.z};
}

// A Bézier curve lies within the hull of its control points, its surface within their largest radius of it.
void extend(Box3f& box, const Curves& curves) {
    for (const Curves::V4f& control : curves.control) {
        const V3f reach(std::fabs(control.w));
        box.extendBy(point_of(control) - reach);
        box.extendBy(point_of(control) + reach);
    }
}

Box3f patch_box(const BilinearMesh& mesh, std::size_t patch) {
    Box3f box;
    for (const std::int32_t vertex : mesh.patches[patch]) {
        box.extendBy(mesh.p[static_cast<std::size_t>(vertex)]);
    }
    return box;
}

template <typename Value>
std::uint64_t bytes_of(const std::vector<Value>& values) {
    return values.capacity() * sizeof(Value);
}

}  // namespace

Box3f bounds_of(const Shapes& shapes) {
    Box3f box;
    for (const Mesh& mesh : shapes.meshes) {
        for (const V3i& triangle : mesh.triangles) {
            if (is_degenerate(mesh, triangle)) continue;
            for (int c = 0; c < 3; ++c) box.extendBy(vertex_of(mesh, triangle[c]));
        }
    }
    for (const Quadric& quadric : shapes.quadrics) box.extendBy(QuadricShape(quadric).bounds());
    for (const BilinearMesh& mesh : shapes.patches) {
        for (std::size_t i = 0; i < mesh.patches.size(); ++i) box.extendBy(patch_box(mesh, i));
    }
    for (const Curves& curves : shapes.curves) extend(box, curves);
    return box;
}

std::vector<V3i> kept_triangles(const Mesh& mesh) {
    std::vector<V3i> kept;
    kept.reserve(mesh.triangles.size());
    std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(kept),
                 [&mesh](const V3i& triangle) { return !is_degenerate(mesh, triangle); });
    return kept;
}

ShapeSet::ShapeSet(Shapes shapes, std::span<const Material> materials)
    : shapes_(std::move(shapes)), materials_(materials) {
    take_meshes();
    take_curves();
    take_quadrics();
    take_patches();
}

unsigned ShapeSet::layer(const SurfaceTraits& traits) const {
    assert(traits.material < materials_.size());
    const Material& material = materials_[traits.material];
    if (!is_interface(material)) return may_pass_straight(material) ? kPanes : kOpaque;
    if (traits.light != kNoLight) return kOpaque;  // Scene::bsdf() makes it black
    return traits.media.is_interface ? kMediumInterfaces : 0;
}

unsigned ShapeSet::note(const SurfaceTraits& traits) {
    const unsigned where = layer(traits);
    has_medium_interfaces_ = has_medium_interfaces_ || where == kMediumInterfaces;
    has_panes_ = has_panes_ || where == kPanes;
    has_specular_ = has_specular_ || ((where & kSurfaces) != 0 && is_specular(materials_[traits.material]));
    return where;
}

void ShapeSet::take_meshes() {
    for (Mesh& mesh : shapes_.meshes) {
        assert(mesh.n.empty() || mesh.n.size() == mesh.p.size());
        assert(mesh.uv.empty() || mesh.uv.size() == mesh.p.size());
        std::vector<V3i> kept = kept_triangles(mesh);
        counts_.degenerate_triangles += mesh.triangles.size() - kept.size();
        mesh.triangles = std::move(kept);
        if (mesh.triangles.empty()) continue;
        if ((note(mesh.traits) & kSurfaces) != 0) counts_.triangles += mesh.triangles.size();
        // Embree reads vertices 16 bytes at a time and requires all of them to be finite, used or not.
        for (V3f& p : mesh.p) {
            if (!is_usable(p)) p = V3f(0, 0, 0);
        }
        mesh.p.reserve(mesh.p.size() + 1);
        mesh.p.emplace_back(0.0F, 0.0F, 0.0F);
        counts_.bytes += bytes_of(mesh.p) + bytes_of(mesh.triangles) + bytes_of(mesh.n) + bytes_of(mesh.uv);
    }
}

void ShapeSet::take_curves() {
    for (Curves& curves : shapes_.curves) {
        assert(curves.control.size() == 4 * curves.segments.size());
        assert((curves.kind == Curves::Kind::ribbon) == !curves.n.empty());
        if (!curves.segments.empty() && (note(curves.traits) & kSurfaces) != 0) {
            counts_.curves += curves.segments.size();
        }
        if (!curves.n.empty()) curves.n.emplace_back(0.0F, 0.0F, 0.0F);  // padding, as for vertices
        counts_.bytes += bytes_of(curves.control) + bytes_of(curves.n) + bytes_of(curves.segments);
    }
}

void ShapeSet::take_quadrics() {
    for (std::uint32_t i = 0; i < shapes_.quadrics.size(); ++i) {
        const unsigned where = note(shapes_.quadrics[i].traits);
        if (where == 0) continue;
        if ((where & kSurfaces) != 0) ++counts_.quadrics;
        quadrics_.emplace_back(shapes_.quadrics[i]);
        quadric_from_.push_back(i);
    }
    counts_.bytes += bytes_of(quadrics_) + bytes_of(quadric_from_) + bytes_of(shapes_.quadrics);
}

void ShapeSet::take_patches() {
    for (std::uint32_t i = 0; i < shapes_.patches.size(); ++i) {
        const BilinearMesh& mesh = shapes_.patches[i];
        counts_.bytes += bytes_of(mesh.p) + bytes_of(mesh.patches) + bytes_of(mesh.n) + bytes_of(mesh.uv);
        if (mesh.patches.empty()) continue;
        const unsigned where = note(mesh.traits);
        if (where == 0) continue;
        if ((where & kSurfaces) != 0) counts_.patches += mesh.patches.size();
        for (std::uint32_t k = 0; k < mesh.patches.size(); ++k) patches_.push_back({i, k});
    }
    counts_.bytes += bytes_of(patches_);
}

const SurfaceTraits& ShapeSet::traits(std::uint32_t geometry, std::uint32_t primitive) const {
    if (geometry < curves_begin()) return shapes_.meshes[geometry].traits;
    if (geometry < quadrics_id()) return shapes_.curves[geometry - curves_begin()].traits;
    if (geometry == quadrics_id()) return shapes_.quadrics[quadric_from_[primitive]].traits;
    return shapes_.patches[patches_[primitive].mesh].traits;
}

std::optional<PrimitiveHit> ShapeSet::cross(std::uint32_t geometry, std::uint32_t primitive,
                                            const LocalRay& ray, double t_min, double t_max) const {
    if (geometry == quadrics_id()) {
        const std::optional<double> t = quadrics_[primitive].nearest(ray.o, ray.d, t_min, t_max);
        if (!t) return std::nullopt;
        return PrimitiveHit{geometry, primitive, *t};
    }
    const PatchAddress& at = patches_[primitive];
    const auto crossing = PatchShape(shapes_.patches[at.mesh], at.patch).nearest(ray.o, ray.d, t_min, t_max);
    if (!crossing) return std::nullopt;
    return PrimitiveHit{geometry, primitive, crossing->t, crossing->u, crossing->v};
}

Box3f ShapeSet::primitive_bounds(std::uint32_t geometry, std::uint32_t primitive) const {
    if (geometry == quadrics_id()) return quadrics_[primitive].bounds();
    const PatchAddress& at = patches_[primitive];
    Box3f box = patch_box(shapes_.patches[at.mesh], at.patch);
    // A flat patch has a flat box; the slack covers the rounding of the ray.
    V3f far;
    for (int j = 0; j < 3; ++j) far[j] = std::max(std::fabs(box.min[j]), std::fabs(box.max[j]));
    const V3f size = box.size();
    const V3f slack(surface_error(far, std::max({size.x, size.y, size.z})));
    box.min -= slack;
    box.max += slack;
    return box;
}

std::optional<Box3f> ShapeSet::any_medium_interface() const {
    const auto is_medium_interface = [this](const SurfaceTraits& of) {
        return of.media.is_interface && layer(of) != 0;
    };
    for (const Mesh& mesh : shapes_.meshes) {
        if (mesh.triangles.empty() || !is_medium_interface(mesh.traits)) continue;
        Box3f box;
        for (int c = 0; c < 3; ++c) box.extendBy(vertex_of(mesh, mesh.triangles[0][c]));
        return box;
    }
    for (const std::uint32_t geometry : {quadrics_id(), patches_id()}) {
        const std::uint32_t count = geometry == quadrics_id() ? quadrics() : patches();
        for (std::uint32_t i = 0; i < count; ++i) {
            if (is_medium_interface(traits(geometry, i))) return primitive_bounds(geometry, i);
        }
    }
    return std::nullopt;
}

PrimitiveHit ShapeSet::exact(const PrimitiveHit& m, const LocalRay& ray) const {
    if (m.geometry >= curves_begin()) return m;
    const auto point = triangle_point(shapes_.meshes[m.geometry], m.primitive, ray);
    if (!point) return m;
    PrimitiveHit out = m;
    out.t = ahead(point->t);
    out.u = point->b1;
    out.v = point->b2;
    return out;
}

V2f ShapeSet::uv(const PrimitiveHit& m, const LocalRay& ray) const {
    const auto u = static_cast<float>(m.u), v = static_cast<float>(m.v);
    if (m.geometry < curves_begin()) return triangle_uv(shapes_.meshes[m.geometry], m.primitive, u, v);
    if (m.geometry < quadrics_id()) {
        return curve_uv(shapes_.curves[m.geometry - curves_begin()], m.primitive, u, v);
    }
    if (m.geometry == quadrics_id()) return quadrics_[m.primitive].at(ray.o, ray.d, m.t).uv;
    const PatchAddress& at = patches_[m.primitive];
    return patch_uv(shapes_.patches[at.mesh], at.patch, m.u, m.v);
}

std::optional<NormalField> ShapeSet::normal_field(const PrimitiveHit& m, const LocalRay& ray) const {
    if (m.geometry < curves_begin()) return triangle_normal_field(shapes_.meshes[m.geometry], m.primitive, m);
    if (m.geometry == quadrics_id()) return quadrics_[m.primitive].normal_field(ray.at(m.t));
    return std::nullopt;
}

void ShapeSet::prefetch_vertices(const PrimitiveHit& m) const {
    if (m.geometry >= curves_begin()) return;
    const Mesh& mesh = shapes_.meshes[m.geometry];
    const V3i& triangle = mesh.triangles[m.primitive];
    for (int c = 0; c < 3; ++c) {
        const auto vertex = static_cast<std::size_t>(triangle[c]);
        __builtin_prefetch(&mesh.p[vertex]);
        if (!mesh.n.empty()) __builtin_prefetch(&mesh.n[vertex]);
        if (!mesh.uv.empty()) __builtin_prefetch(&mesh.uv[vertex]);
    }
}

Hit ShapeSet::surface(const PrimitiveHit& m, const LocalRay& ray) const {
    const auto u = static_cast<float>(m.u), v = static_cast<float>(m.v);
    if (m.geometry < curves_begin()) return triangle_hit(shapes_.meshes[m.geometry], m.primitive, u, v);
    if (m.geometry < quadrics_id()) {
        const Curves& curves = shapes_.curves[m.geometry - curves_begin()];
        return curve_hit(curves, {m.primitive, u, v, m.n}, ray, m.t);
    }
    if (m.geometry == quadrics_id()) return quadric_hit(quadrics_[m.primitive], ray, m.t);
    const PatchAddress& at = patches_[m.primitive];
    return patch_hit(shapes_.patches[at.mesh], at.patch, m.u, m.v);
}

Hit ShapeSet::hit(const PrimitiveHit& m, const LocalRay& ray) const {
    Hit hit = surface(m, ray);
    hit.t = static_cast<float>(m.t);
    return hit;
}

void ShapeSet::exact_hit(const PrimitiveHit& m, const LocalRay& ray, Hit& out) const {
    if (m.geometry < curves_begin()) {
        triangle_hit(shapes_.meshes[m.geometry], m, ray, out);
    } else {
        out = hit(exact(m, ray), ray);
    }
}

namespace {

// Removes everything but the geometry from shapes.
template <typename Shape>
void strip(std::vector<Shape>& shapes) {
    for (Shape& shape : shapes) {
        shape.traits.material = 0;
        shape.traits.light = kNoLight;
        shape.traits.media = {};
    }
}

Scene bare_scene(Shapes shapes, const V3d& origin) {
    SceneParts parts;
    parts.origin = origin;
    static_cast<Shapes&>(parts) = std::move(shapes);
    strip(parts.meshes);
    strip(parts.quadrics);
    strip(parts.patches);
    strip(parts.curves);
    parts.materials.push_back({"", DiffuseMaterial{RgbTexture::constant(Rgb(0.0F))}});
    return Scene(std::move(parts), Workers{1});
}

class TracedShape final : public LampShape {
  public:
    TracedShape(Shapes shapes, const V3d& origin)
        : scene_(bare_scene(std::move(shapes), origin)),
          sphere_(scene_.sphere()),
          extent_(diagonal(scene_)) {}

    // Along the reversed line, the last crossing is the first.
    std::optional<SurfacePoint> last_crossing(const V3d& p, const V3d& d) const override {
        const V3d to_centre = V3d(sphere_.centre) - p;
        const double middle = to_centre.dot(d);
        const double reach = 1.01 * static_cast<double>(sphere_.radius);
        if (!((to_centre - middle * d).length2() <= reach * reach)) return std::nullopt;
        const auto hit =
            scene_.intersect(Ray{V3f(p + (middle + reach) * d), V3f(-d), static_cast<float>(2 * reach)});
        if (!hit) return std::nullopt;
        return hit->at;
    }

    float extent() const override { return extent_; }

  private:
    Scene scene_;
    SceneSphere sphere_;
    float extent_;
};

}  // namespace

std::unique_ptr<const LampShape> make_traced_shape(Shapes shapes, const V3d& origin) {
    return std::make_unique<TracedShape>(std::move(shapes), origin);
}

}  // namespace lucerna
