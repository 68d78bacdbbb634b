#include "engine/pbrt/draft.h"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "engine/base/vec.h"
#include "engine/pbrt/transforms.h"
#include "engine/scene/quadric.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

// Peak memory of an instance as measured: the records of reader and scene, and the acceleration structure.
constexpr std::uint64_t kBytesOfInstance = 900;
// A mesh with more triangles gets a geometry of its own; a joined one with more than kFull takes no further
// meshes.
constexpr std::size_t kSmall = 2000;
constexpr std::size_t kFull = 1U << 24;

// Shapes with equal keys may share a geometry.
using Key = std::tuple<std::uint32_t, bool, bool, std::int32_t, std::int32_t, const void*, const void*, bool,
                       bool, int>;
Key key_of(const SurfaceTraits& t, bool with_n, bool with_uv, int kind = 0) {
    return {t.material,
            t.reverse_orientation,
            t.media.is_interface,
            t.media.inside,
            t.media.outside,
            t.alpha.get(),
            t.shadow_alpha.get(),
            with_n,
            with_uv,
            kind};
}

template <typename Value>
void append(std::vector<Value>& to, const std::vector<Value>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

void append_points(std::vector<V3f>& to, const std::vector<V3d>& from, const V3d& origin) {
    // Reserves one more point, because the scene adds a spare vertex.
    if (to.empty()) to.reserve(from.size() + 1);
    for (const V3d& p : from) to.push_back(V3f(p - origin));
}

void append_mesh(Mesh& to, DraftMesh from, const V3d& origin) {
    const auto first = static_cast<int>(to.p.size());
    append_points(to.p, from.p, origin);
    if (first == 0) {
        to.triangles = std::move(from.triangles);
        to.n = std::move(from.n);
        to.uv = std::move(from.uv);
        to.traits = from.traits;
        return;
    }
    for (const V3i& t : from.triangles) to.triangles.push_back(t + V3i(first));
    append(to.n, from.n);
    append(to.uv, from.uv);
}

void append_patches(BilinearMesh& to, const DraftPatches& from, const V3d& origin) {
    const auto first = static_cast<std::int32_t>(to.p.size());
    append_points(to.p, from.p, origin);
    for (auto corners : from.patches) {
        for (std::int32_t& corner : corners) corner += first;
        to.patches.push_back(corners);
    }
    append(to.n, from.n);
    append(to.uv, from.uv);
    to.traits = from.traits;
}

void append_curves(Curves& to, const DraftCurves& from, const V3d& origin) {
    to.kind = from.kind;
    to.traits = from.traits;
    for (std::size_t i = 0; i < from.p.size(); ++i) {
        const V3f p(from.p[i] - origin);
        to.control.emplace_back(p.x, p.y, p.z, from.radius[i]);
    }
    append(to.n, from.n);
    append(to.segments, from.segments);
}

// Finds or makes the geometry for a key that accepts more shapes. Only non-emitting shapes are joined.
template <typename Shape>
class Joiner {
  public:
    explicit Joiner(std::vector<Shape>& out) : out_(out) {}

    std::size_t place(const Key& key, bool joins, std::size_t (*size)(const Shape&)) {
        const auto found = joins ? open_.find(key) : open_.end();
        if (found != open_.end() && size(out_[found->second]) < kFull) return found->second;
        out_.emplace_back();
        if (joins) open_[key] = out_.size() - 1;
        return out_.size() - 1;
    }

  private:
    std::vector<Shape>& out_;
    std::map<Key, std::size_t> open_;
};

// Walks through nested instances. It skips objects without shapes, so its work is at most the number of shown
// instances times the depth.
class Placer {
  public:
    explicit Placer(const Draft& draft) : draft_(draft), slot_(draft.objects.size()) {
        boxes_.reserve(draft.objects.size());
        for (const auto& object : draft.objects) boxes_.push_back(bounds_of(object->shapes));
    }

    void place(const DraftInstance& instance, const M44d& world_from_outer) {
        if (draft_.objects[instance.object]->shown == 0) return;
        const M44d m = then(instance.world_from_world, world_from_outer);
        const Box3d& box = boxes_[instance.object];
        if (!box.isEmpty()) {
            std::optional<std::uint32_t>& slot = slot_[instance.object];
            if (!slot) {
                slot = static_cast<std::uint32_t>(result.objects.size());
                result.objects.push_back({instance.object, box.center()});
            }
            result.instances.push_back({*slot, m});
            result.bounds.extendBy(carried_box(box, m));
        }
        for (const DraftInstance& inner : draft_.objects[instance.object]->instances) place(inner, m);
    }

    Placements result;

  private:
    const Draft& draft_;
    std::vector<Box3d> boxes_;
    std::vector<std::optional<std::uint32_t>> slot_;  // index of each object once it is shown
};

}  // namespace

Box3d bounds_of(const DraftShapes& shapes) {
    Box3d bounds;
    for (const DraftMesh& mesh : shapes.meshes) {
        for (const V3i& t : mesh.triangles) {
            for (const int vertex : {t.x, t.y, t.z}) bounds.extendBy(mesh.p[vertex]);
        }
    }
    for (const Quadric& quadric : shapes.quadrics) bounds.extendBy(QuadricShape(quadric).box());
    for (const DraftPatches& mesh : shapes.patches) {
        for (const auto& corners : mesh.patches) {
            for (const std::int32_t vertex : corners) bounds.extendBy(mesh.p[vertex]);
        }
    }
    for (const DraftCurves& curves : shapes.curves) {
        for (std::size_t i = 0; i < curves.p.size(); ++i) {
            const V3d reach(static_cast<double>(curves.radius[i]));
            bounds.extendBy(curves.p[i] - reach);
            bounds.extendBy(curves.p[i] + reach);
        }
    }
    return bounds;
}

Shapes build_shapes(DraftShapes draft, const V3d& origin, std::vector<std::size_t>& mesh_of) {
    Shapes shapes;
    Joiner<Mesh> meshes(shapes.meshes);
    for (DraftMesh& mesh : draft.meshes) {
        const bool joins = mesh.traits.light == kNoLight && mesh.triangles.size() <= kSmall;
        const Key key = key_of(mesh.traits, !mesh.n.empty(), !mesh.uv.empty());
        mesh_of.push_back(meshes.place(key, joins, [](const Mesh& m) { return m.p.size(); }));
        append_mesh(shapes.meshes[mesh_of.back()], std::move(mesh), origin);
    }
    shapes.quadrics = std::move(draft.quadrics);
    for (Quadric& quadric : shapes.quadrics) {
        quadric.world_from_object = relative_to(quadric.world_from_object, origin);
    }
    Joiner<BilinearMesh> patches(shapes.patches);
    for (const DraftPatches& mesh : draft.patches) {
        const std::size_t at = patches.place(key_of(mesh.traits, !mesh.n.empty(), !mesh.uv.empty()), true,
                                             [](const BilinearMesh& m) { return m.p.size(); });
        append_patches(shapes.patches[at], mesh, origin);
    }
    Joiner<Curves> curves(shapes.curves);
    for (const DraftCurves& curve : draft.curves) {
        const Key key = key_of(curve.traits, false, false, static_cast<int>(curve.kind));
        const std::size_t at = curves.place(key, true, [](const Curves& c) { return c.control.size(); });
        append_curves(shapes.curves[at], curve, origin);
    }
    return shapes;
}

Placements place_objects(const Draft& draft) {
    std::uint64_t shown = 0;  // fits, as the reader ensures
    for (const DraftInstance& instance : draft.instances) shown += draft.objects[instance.object]->shown;
    require_memory(bytes_of(shown, kBytesOfInstance),
                   fmt::format("{}: {} instances", draft.sources.front()->name(), shown),
                   "use fewer instances");
    Placer placer(draft);
    placer.result.instances.reserve(shown);
    for (const DraftInstance& instance : draft.instances) placer.place(instance, M44d());
    return std::move(placer.result);
}

void build_prototypes(Draft& draft, const Placements& placements, SceneParts& parts) {
    std::vector<std::size_t> unused;  // objects have no emitters
    for (const Placements::Object& object : placements.objects) {
        parts.prototypes.push_back(
            build_shapes(std::move(draft.objects[object.index]->shapes), object.centre, unused));
    }
    parts.instances.reserve(placements.instances.size());
    for (const Instance& instance : placements.instances) {
        const M44d from_centre = translation(placements.objects[instance.prototype].centre);
        parts.instances.push_back(
            {instance.prototype,
             relative_to(then(from_centre, instance.world_from_prototype), parts.origin)});
    }
}

}  // namespace lucerna
