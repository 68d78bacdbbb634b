// Shapes: triangle meshes, PLY files, spheres and disks.
//
// Which side is out. pbrt takes a surface's normal from its object space and flips it if ReverseOrientation
// XOR the transformation swaps handedness. For triangles it does so with the cross product of the
// *world-space* edges, which is our mesh's own convention; for quadrics with the object-space normal
// (outward, or +z) carried to the world, which is our quadric's own convention. So in both cases `flip` below
// is exactly what SurfaceTraits asks for. Vertex normals overrule this: pbrt turns the geometric normal of
// each triangle to their side, and ReverseOrientation turns them round.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/pbrt/state.h"
#include "engine/world/ply.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// An untransformed mesh, in object space.
struct ObjectMesh {
    std::vector<V3d> p, n;
    std::vector<V2f> uv;
    std::vector<V3i> triangles;
};

std::uint32_t use_material(Reading& reading) {
    MaterialEntry& entry = *reading.state.material;
    if (!entry.index) {
        entry.index = static_cast<std::uint32_t>(reading.draft.materials.size());
        reading.draft.materials.push_back(entry.material);
    }
    return *entry.index;
}

SurfaceTraits traits_here(Reading& reading) {
    SurfaceTraits traits;
    traits.material = use_material(reading);
    traits.reverse_orientation = reading.state.reverse_orientation != swaps_handedness(reading.state.ctm);
    traits.media = reading.state.media;
    if (traits.media.border) reading.draft.uses_media = true;
    return traits;
}

// The area light that holds here becomes a light of this surface.
std::int32_t attach_light(Reading& reading, const Params& params, AreaSpec::Surface surface,
                          std::size_t index) {
    const auto& area = reading.state.area_light;
    if (!area) return kNoLight;
    if (is_interface(reading.state.material->material)) {
        reading.warn(params.place(),
                     params.owner() + " has no surface (its material is an interface): it emits nothing");
        return kNoLight;
    }
    reading.draft.lights.push_back(
        {area->place, AreaSpec{surface, index, area->radiance, area->two_sided}, area->power});
    return static_cast<std::int32_t>(reading.draft.lights.size() - 1);
}

std::vector<V3d> triples(const Param& param) {
    std::vector<V3d> result(param.numbers.size() / 3);  // the reader saw to a multiple of 3
    for (std::size_t i = 0; i < result.size(); ++i) {
        result[i] = {param.numbers[3 * i], param.numbers[3 * i + 1], param.numbers[3 * i + 2]};
    }
    return result;
}

void require_count(const Param& param, std::size_t have, std::size_t want) {
    if (have == want) return;
    fail(param.place, "\"{}\" has {} entries for {} vertices; one for each is accepted", param.name, have,
         want);
}

const Param* find_uv(Params& params) {
    for (const std::string_view name : {"uv", "st"}) {
        if (const Param* param = params.find(name, {Type::point2, Type::real, Type::vector2})) return param;
    }
    return nullptr;
}

std::vector<V3i> read_indices(const Param* param, std::size_t vertices, const Params& params) {
    if (!param) {
        if (vertices == 3) return {V3i(0, 1, 2)};
        fail(params.place(), "{} lacks \"integer indices\"; only a mesh of 3 vertices may ({} here)",
             params.owner(), vertices);
    }
    const std::size_t count = param->numbers.size();
    if (count == 0 || count % 3 != 0) {
        fail(param->place, "\"indices\" has {} entries; a multiple of 3 is accepted, at least 3", count);
    }
    std::vector<V3i> triangles(count / 3);
    for (std::size_t i = 0; i < count; ++i) {
        const double index = param->numbers[i];
        if (!(index >= 0 && index < static_cast<double>(vertices) && index == std::floor(index))) {
            fail(param->place_of(i), "\"indices\": {:g} is not accepted; the mesh has vertices 0 to {}",
                 index, vertices - 1);
        }
        triangles[i / 3][static_cast<int>(i % 3)] = static_cast<int>(index);
    }
    return triangles;
}

ObjectMesh read_triangle_mesh(Params& params) {
    ObjectMesh mesh;
    const Param* p = params.find("P", {Type::point3});
    if (!p || p->numbers.empty()) fail(params.place(), "{} lacks \"point3 P\", its vertices", params.owner());
    if (p->numbers.size() / 3 > std::numeric_limits<int>::max()) {
        fail(p->place, "\"P\" has {} vertices; at most 2147483647 are accepted", p->numbers.size() / 3);
    }
    mesh.p = triples(*p);
    mesh.triangles = read_indices(params.find("indices", {Type::integer}), mesh.p.size(), params);
    if (const Param* n = params.find("N", {Type::normal3})) {
        mesh.n = triples(*n);
        require_count(*n, mesh.n.size(), mesh.p.size());
    }
    if (const Param* uv = find_uv(params)) {
        if (uv->numbers.size() % 2 != 0) {
            fail(uv->place, "\"{}\" has {} numbers; two for each vertex are accepted", uv->name,
                 uv->numbers.size());
        }
        require_count(*uv, uv->numbers.size() / 2, mesh.p.size());
        for (std::size_t i = 0; i < mesh.p.size(); ++i) {
            mesh.uv.emplace_back(static_cast<float>(uv->numbers[2 * i]),
                                 static_cast<float>(uv->numbers[2 * i + 1]));
        }
    }
    return mesh;
}

ObjectMesh read_ply_mesh(const Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::string name = params.string("filename", "");
    if (name.ends_with(".gz")) {
        fail(params.place_of("filename"), "\"{}\": compressed files are not supported yet", shown(name));
    }
    PlyMesh ply;
    try {
        ply = read_ply(reading.resolve(name));
    } catch (const InputError& error) {
        fail(params.place_of("filename"), "{}", printable(error.what()));
    }
    ObjectMesh mesh;
    for (std::size_t i = 0; i < ply.p.size(); ++i) {
        if (!is_finite(ply.p[i])) {
            fail(params.place_of("filename"),
                 "\"{}\": vertex {} is ({:g} {:g} {:g}); finite ones are accepted", shown(name), i,
                 ply.p[i].x, ply.p[i].y, ply.p[i].z);
        }
    }
    mesh.p.assign(ply.p.begin(), ply.p.end());
    mesh.n.assign(ply.n.begin(), ply.n.end());
    mesh.uv = std::move(ply.uv);
    mesh.triangles = std::move(ply.triangles);
    return mesh;
}

// World-space vertex normals. Where the input has none (zero, or not finite), the triangles' own normal
// stands in.
void transform_normals(const Reading& reading, const Params& params, const ObjectMesh& object,
                       const M44d& back, DraftMesh& mesh) {
    const double turn = reading.state.reverse_orientation ? -1.0 : 1.0;
    mesh.n.resize(object.n.size());
    std::size_t missing = 0;
    for (std::size_t i = 0; i < object.n.size(); ++i) {
        V3d n = object.n[i];
        const double largest = std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)});
        // Brought to length one before it is transformed and after: neither 1e-200 nor 1e200 is lost.
        n = std::isfinite(largest) && largest > 0 ? transform_normal(back, n / largest).normalized() : V3d(0);
        if (!(n.length2() > 0)) ++missing;
        mesh.n[i] = V3f(turn * (n.length2() > 0 ? n : V3d(0)));
    }
    if (missing == 0) return;
    reading.warn(params.place(),
                 fmt::format("{}: {} of {} vertex normals have no direction; the triangles' own take "
                             "their place",
                             params.owner(), missing, object.n.size()));
    const double side = mesh.traits.reverse_orientation ? -1.0 : 1.0;
    for (const V3i& t : mesh.triangles) {
        const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]);
        for (const int vertex : {t.x, t.y, t.z}) {
            if (mesh.n[vertex] == V3f(0)) mesh.n[vertex] = V3f(side * cross.normalized());
        }
    }
    for (V3f& n : mesh.n) {
        if (n == V3f(0)) n = V3f(0, 0, 1);  // of no triangle with an area: never seen
    }
}

// pbrt turns each triangle to the side of its vertex normals; here by the order of its vertices.
void turn_to_normals(DraftMesh& mesh) {
    for (V3i& t : mesh.triangles) {
        const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]);
        const V3d mean = V3d(mesh.n[t.x]) + V3d(mesh.n[t.y]) + V3d(mesh.n[t.z]);
        if (cross.dot(mean) < 0) std::swap(t.y, t.z);
    }
    mesh.traits.reverse_orientation = false;
}

void add_mesh(Reading& reading, const Params& params, ObjectMesh object) {
    const M44d& ctm = reading.state.ctm;
    DraftMesh mesh;
    mesh.traits = traits_here(reading);
    mesh.triangles = std::move(object.triangles);
    mesh.uv = std::move(object.uv);
    mesh.p = std::move(object.p);
    for (std::size_t i = 0; i < mesh.p.size(); ++i) {
        mesh.p[i] = transform_point(ctm, mesh.p[i]);
        if (!(std::isfinite(mesh.p[i].x) && std::isfinite(mesh.p[i].y) && std::isfinite(mesh.p[i].z))) {
            fail(params.place(),
                 "{}: vertex {} is transformed to ({:g} {:g} {:g}); finite points are accepted",
                 params.owner(), i, mesh.p[i].x, mesh.p[i].y, mesh.p[i].z);
        }
    }
    if (!object.n.empty()) {
        transform_normals(reading, params, object, inverse(ctm).value(), mesh);
        turn_to_normals(mesh);
    }
    mesh.traits.light = attach_light(reading, params, AreaSpec::Surface::mesh, reading.draft.meshes.size());
    reading.draft.meshes.push_back(std::move(mesh));
}

float positive(Params& params, std::string_view name, double fallback) {
    return static_cast<float>(params.real_within(name, fallback, 1e-30, 1e30));
}

float phi_max(Params& params) {
    return static_cast<float>(params.real_within("phimax", 360, 1e-3, 360) * (M_PI / 180));
}

Quadric read_sphere(Params& params) {
    Quadric sphere;
    sphere.kind = Quadric::Kind::sphere;
    sphere.radius = positive(params, "radius", 1);
    const double r = static_cast<double>(sphere.radius);
    const double a = params.real("zmin", -r), b = params.real("zmax", r);
    const double low = std::min(a, b), high = std::max(a, b);  // pbrt takes them in either order
    if (!(low < r && high > -r && low < high)) {
        fail(params.place_of("zmin"), "zmin {:g} and zmax {:g} leave nothing of a sphere of radius {:g}", a,
             b, r);
    }
    if (low > -r) sphere.z_min = static_cast<float>(low);
    if (high < r) sphere.z_max = static_cast<float>(high);
    sphere.phi_max = phi_max(params);
    return sphere;
}

Quadric read_disk(Params& params) {
    Quadric disk;
    disk.kind = Quadric::Kind::disk;
    disk.radius = positive(params, "radius", 1);
    disk.height = static_cast<float>(params.real_within("height", 0, -1e30, 1e30));
    disk.inner_radius = static_cast<float>(params.real_within("innerradius", 0, 0, 1e30));
    if (!(disk.inner_radius < disk.radius)) {
        fail(params.place_of("innerradius"), "innerradius {:g} is not less than radius {:g}",
             disk.inner_radius, disk.radius);
    }
    disk.phi_max = phi_max(params);
    return disk;
}

// What makes a partial or stretched quadric unfit to emit.
void require_emitter(const Reading& reading, const Params& params, const Quadric& quadric) {
    if (!reading.state.area_light || is_interface(reading.state.material->material)) return;
    const bool partial =
        quadric.phi_max < 2 * kPi - 1e-4F || std::isfinite(quadric.z_min) || std::isfinite(quadric.z_max);
    if (partial) {
        fail(params.place(), "{} emits but is only a part (phimax, zmin, zmax); a complete one is accepted",
             params.owner());
    }
    if (!uniform_scale(quadric.world_from_object)) {
        fail(params.place(), "{} emits but is stretched or sheared; one scale for all directions is accepted",
             params.owner());
    }
}

void add_quadric(Reading& reading, const Params& params, Quadric quadric) {
    quadric.world_from_object = reading.state.ctm;
    quadric.traits = traits_here(reading);
    require_emitter(reading, params, quadric);
    quadric.traits.light =
        attach_light(reading, params, AreaSpec::Surface::quadric, reading.draft.quadrics.size());
    reading.draft.quadrics.push_back(quadric);
}

// Cut-outs are not made in silence.
void require_opaque(Params& params) {
    for (const std::string_view name : {"alpha", "shadowalpha"}) {
        const Param* alpha = params.find_any(name);
        if (!alpha) continue;
        const bool one =
            alpha->type == Type::real && alpha->numbers.size() == 1 && alpha->numbers.front() == 1;
        if (!one) fail(alpha->place, "\"{}\" is not supported yet; 1 is accepted", name);
    }
    if (params.has("displacement"))
        fail(params.place_of("displacement"), "\"displacement\" is not supported yet");
}

}  // namespace

void read_shape(Reading& reading, const std::string& kind, Params& params) {
    require_opaque(params);
    if (kind == "trianglemesh") return add_mesh(reading, params, read_triangle_mesh(params));
    if (kind == "plymesh") return add_mesh(reading, params, read_ply_mesh(reading, params));
    if (kind == "sphere") return add_quadric(reading, params, read_sphere(params));
    if (kind == "disk") return add_quadric(reading, params, read_disk(params));
    refuse_kind(params.place(), "Shape", kind, {"trianglemesh", "plymesh", "sphere", "disk"},
                {"bilinearmesh", "cone", "curve", "cylinder", "heightfield", "hyperboloid", "loopsubdiv",
                 "nurbs", "paraboloid"});
}

}  // namespace lucerna
