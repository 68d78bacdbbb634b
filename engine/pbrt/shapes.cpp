// Functions that all shapes share, and the choice of reader.
//
// Orientation: A transformation carries a shape's outside with it, even if it mirrors, and ReverseOrientation
// flips it. Normals of quadrics and curves (outward, or +z) are transformed from object space to the world,
// so only ReverseOrientation flips them. Triangles and bilinear patches use the cross product of their
// *world-space* edges, which a mirroring transformation flips; its change of handedness is therefore a second
// flip. pbrt-v4 does the same for triangles and patches and when it samples quadrics as lights, but flips the
// normals of quadrics that a ray meets under a mirroring transformation. Vertex normals take precedence: each
// triangle turns to their side, and ReverseOrientation flips them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/pbrt/shapes.h"

namespace lucerna {
namespace {

using Type = Param::Type;

std::uint32_t use_material(Reading& reading) {
    MaterialEntry& entry = *reading.state.material;
    if (!entry.index) {
        entry.index = static_cast<std::uint32_t>(reading.draft.materials.size());
        reading.draft.materials.push_back(entry.material);
    }
    return *entry.index;
}

// Reads an alpha texture; an alpha of 1 everywhere counts as none.
std::shared_ptr<const FloatTexture> read_cut_out(Reading& reading, Params& params, std::string_view name) {
    if (!params.has(name)) return nullptr;
    const FloatTexture texture = read_float(reading, params, name, 1);
    if (texture.constant_value() && *texture.constant_value() >= 1) return nullptr;
    return std::make_shared<const FloatTexture>(texture);
}

// Transforms vertex normals to world space. Missing normals (zero or not finite) are replaced by those of the
// triangles.
void transform_normals(Reading& reading, const Params& params, const ObjectMesh& object, const M44d& back,
                       DraftMesh& mesh) {
    const double turn = reading.state.reverse_orientation ? -1.0 : 1.0;
    mesh.n.resize(object.n.size());
    std::size_t missing = 0;
    for (std::size_t i = 0; i < object.n.size(); ++i) {
        V3d n = object.n[i];
        const double largest = std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)});
        // Normalises before and after the transformation, so neither 1e-200 nor 1e200 is lost.
        n = std::isfinite(largest) && largest > 0 ? transform_normal(back, n / largest).normalized() : V3d(0);
        if (!(n.length2() > 0)) ++missing;
        mesh.n[i] = V3f(turn * (n.length2() > 0 ? n : V3d(0)));
    }
    if (missing == 0) return;
    reading.warn(params.place(),
                 fmt::format("{}: {} of {} vertex normals are zero; the triangles' normals are used instead",
                             params.owner(), missing, object.n.size()));
    const double side = mesh.traits.reverse_orientation ? -1.0 : 1.0;
    for (const V3i& t : mesh.triangles) {
        const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]);
        for (const int vertex : {t.x, t.y, t.z}) {
            if (mesh.n[vertex] == V3f(0)) mesh.n[vertex] = V3f(side * cross.normalized());
        }
    }
    for (V3f& n : mesh.n) {
        if (n == V3f(0)) n = V3f(0, 0, 1);  // belongs only to triangles without area and is never seen
    }
}

// Orders each triangle's vertices so that it faces the side of its vertex normals, as in pbrt.
void turn_to_normals(DraftMesh& mesh) {
    for (V3i& t : mesh.triangles) {
        const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]);
        const V3d mean = V3d(mesh.n[t.x]) + V3d(mesh.n[t.y]) + V3d(mesh.n[t.z]);
        if (cross.dot(mean) < 0) std::swap(t.y, t.z);
    }
    mesh.traits.reverse_orientation = false;
}

// Tells whether the surface is cut out everywhere.
bool lets_all_pass(const SurfaceTraits& traits) {
    return traits.alpha && traits.alpha->constant_value() && *traits.alpha->constant_value() <= 0;
}

}  // namespace

void add_mesh(Reading& reading, const Params& params, const SurfaceTraits& traits, ObjectMesh object) {
    DraftMesh mesh;
    mesh.traits = of_world_edges(reading, traits);
    mesh.triangles = std::move(object.triangles);
    mesh.uv = std::move(object.uv);
    mesh.p = std::move(object.p);
    for (std::size_t i = 0; i < mesh.p.size(); ++i) {
        mesh.p[i] = transformed_point(reading, params, mesh.p[i], i);
    }
    const std::optional<M44d> back = inverse(reading.state.ctm);
    if (!object.n.empty() && back) {  // flattened shapes keep their triangles' own normals
        transform_normals(reading, params, object, *back, mesh);
        turn_to_normals(mesh);
    }
    std::vector<DraftMesh>& meshes = reading.shapes().meshes;
    if (emits(reading, params)) {
        mesh.traits.light = attach_light(reading, mesh.traits, AreaSpec::Surface::mesh, meshes.size());
    }
    meshes.push_back(std::move(mesh));
}

SurfaceTraits of_world_edges(const Reading& reading, SurfaceTraits traits) {
    traits.reverse_orientation = traits.reverse_orientation != swaps_handedness(reading.state.ctm);
    return traits;
}

V3d transformed_point(const Reading& reading, const Params& params, const V3d& p, std::size_t index) {
    const V3d q = transform_point(reading.state.ctm, p);
    if (!(std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z))) {
        fail(params.place(), "{}: vertex {} is transformed to ({:g} {:g} {:g}); expected finite points",
             params.owner(), index, q.x, q.y, q.z);
    }
    return q;
}

std::optional<SurfaceTraits> traits_here(Reading& reading, Params& params) {
    SurfaceTraits traits;
    traits.material = use_material(reading);
    traits.reverse_orientation = reading.state.reverse_orientation;
    traits.media = reading.state.media;
    if (traits.media.is_interface) reading.draft.uses_media = true;
    traits.alpha = read_cut_out(reading, params, "alpha");
    traits.shadow_alpha = read_cut_out(reading, params, "shadowalpha");
    if (!lets_all_pass(traits)) return traits;
    const bool lamp =
        reading.state.area_light && !reading.object && !is_interface(reading.state.material->material);
    if (!lamp) return std::nullopt;
    if (!reading.state.area_light->lamp) return traits;  // version 4's invisible area light
    params.warn_or_refuse(params.place(), params.owner() + " is cut out (alpha 0) and shows a measured lamp",
                          "it is shown with its light", "its transparency to rays");
    traits.alpha = nullptr;
    return traits;
}

bool emits(Reading& reading, const Params& params) {
    if (!reading.state.area_light) return false;
    const char* reason = nullptr;
    if (is_interface(reading.state.material->material)) {
        reason = "has no surface (its material is an interface)";
    } else if (reading.object) {
        reason = "is part of an object that is shown by instances";
    }
    if (reason) reading.warn(params.place(), fmt::format("{} {}: it emits nothing", params.owner(), reason));
    return reason == nullptr;
}

std::int32_t attach_light(Reading& reading, const SurfaceTraits& traits, AreaSpec::Surface surface,
                          std::size_t index) {
    const AreaLight& area = *reading.state.area_light;
    for (const DraftLight& light : reading.draft.lights) {
        const auto* other = std::get_if<AreaSpec>(&light.spec);
        if (area.lamp && other && other->lamp == area.lamp) {
            fail_always(area.place,
                        "a measured lamp is shown by one shape only, and this one has two; end its "
                        "AttributeBegin after the first");
        }
    }
    reading.draft.lights.push_back(
        {area.place,
         AreaSpec{surface, index, area.radiance, area.two_sided, lets_all_pass(traits), area.lamp},
         area.power,
         area.group,
         {},
         area.spectrum});
    return static_cast<std::int32_t>(reading.draft.lights.size() - 1);
}

std::vector<V3d> triples(const Param& param) {
    std::vector<V3d> result(param.numbers.size() / 3);  // the reader ensures a multiple of 3
    for (std::size_t i = 0; i < result.size(); ++i) {
        result[i] = {param.numbers[3 * i], param.numbers[3 * i + 1], param.numbers[3 * i + 2]};
    }
    return result;
}

void require_count(const Param& param, std::size_t have, std::size_t want) {
    if (have == want) return;
    fail(param.place, "\"{}\" has {} entries for {} vertices; expected one for each", param.name, have, want);
}

std::vector<V2f> read_uv(Params& params, std::size_t vertices) {
    for (const std::string_view name : {"uv", "st"}) {
        const Param* uv = params.find(name, {Type::point2, Type::real, Type::vector2});
        if (!uv) continue;
        if (uv->numbers.size() != 2 * vertices) {
            params.warn_or_refuse(uv->place,
                                  fmt::format("\"{}\" has {} numbers for {} vertices; expected two for each",
                                              uv->name, uv->numbers.size(), vertices),
                                  "it is left out", "the texture coordinates");
            return {};
        }
        std::vector<V2f> result(vertices);
        for (std::size_t i = 0; i < vertices; ++i) {
            result[i] = {static_cast<float>(uv->numbers[2 * i]), static_cast<float>(uv->numbers[2 * i + 1])};
        }
        return result;
    }
    return {};
}

std::vector<int> read_indices(Params& params, std::size_t vertices, std::size_t corners) {
    const Param* param = params.find("indices", {Type::integer});
    if (!param) {
        if (vertices != corners) {
            fail(params.place(),
                 "{} lacks \"integer indices\", which only a mesh of {} vertices may ({} here)",
                 params.owner(), corners, vertices);
        }
        std::vector<int> all(corners);
        for (std::size_t i = 0; i < corners; ++i) all[i] = static_cast<int>(i);
        return all;
    }
    std::size_t count = param->numbers.size();
    const auto what = [&] {
        return fmt::format("\"indices\" has {} entries; expected a multiple of {}, at least {}", count,
                           corners, corners);
    };
    if (count < corners) fail(param->place, "{}", what());
    if (const std::size_t over = count % corners; over != 0) {
        params.warn_or_refuse(param->place, what(), fmt::format("the last {} are left out", over));
        count -= over;
    }
    std::vector<int> indices(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double index = param->numbers[i];
        if (!(index >= 0 && index < static_cast<double>(vertices) && index == std::floor(index))) {
            fail(param->place_of(i), "\"indices\": {:g} is not accepted; the mesh has vertices 0 to {}",
                 index, vertices - 1);
        }
        indices[i] = static_cast<int>(index);
    }
    return indices;
}

void read_shape(Reading& reading, const std::string& kind, Params& params) {
    for (const std::string_view name : {"displacement", "displacement.uvscale", "edgelength"}) {
        if (!params.find_any(name)) continue;
        params.warn_or_refuse(params.place_of(name), fmt::format("\"{}\" of a shape is not supported", name),
                              "the shape stays smooth", "its relief");
    }
    for (const std::string_view quadric :
         {"sphere", "disk", "cylinder", "cone", "paraboloid", "hyperboloid"}) {
        if (kind == quadric) return add_quadric(reading, kind, params);
    }
    if (kind == "bilinearmesh") return add_patches(reading, params);
    if (kind == "curve") return add_curve(reading, params);

    std::optional<ObjectMesh> mesh;
    if (kind == "trianglemesh") {
        mesh = read_triangle_mesh(params);
    } else if (kind == "plymesh") {
        mesh = read_ply_mesh(reading, params);
    } else if (kind == "arraymesh") {
        mesh = read_array_mesh(reading, params);
    } else if (kind == "loopsubdiv") {
        mesh = read_loop_mesh(params);
    } else if (kind == "heightfield") {
        mesh = read_height_field(params);
    } else if (kind == "nurbs") {
        mesh = read_nurbs(params);
    } else {
        refuse_kind(params.place(), "Shape", kind,
                    {"bilinearmesh", "cone", "curve", "cylinder", "disk", "heightfield", "hyperboloid",
                     "loopsubdiv", "nurbs", "paraboloid", "plymesh", "sphere", "trianglemesh"},
                    {});
    }
    const std::optional<SurfaceTraits> traits = traits_here(reading, params);
    if (mesh && traits) add_mesh(reading, params, *traits, std::move(*mesh));
}

}  // namespace lucerna
