// Shapes that become triangles: trianglemesh, plymesh, loopsubdiv, heightfield.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/elementary.h"
#include "engine/pbrt/shapes.h"
#include "engine/scene/mesh.h"
#include "engine/system/hash.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

using Type = Param::Type;

std::vector<V3i> triangles_of(const std::vector<int>& indices) {
    std::vector<V3i> triangles(indices.size() / 3);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        triangles[i] = {indices[3 * i], indices[3 * i + 1], indices[3 * i + 2]};
    }
    return triangles;
}

std::vector<V3d> read_vertices(Params& params) {
    const Param* p = params.find("P", {Type::point3});
    if (!p || p->numbers.empty()) fail(params.place(), "{} lacks \"point3 P\", its vertices", params.owner());
    if (p->numbers.size() / 3 > std::numeric_limits<int>::max()) {
        fail(p->place, "\"P\" has {} vertices; the limit is 2147483647", p->numbers.size() / 3);
    }
    return triples(*p);
}

}  // namespace

ObjectMesh read_triangle_mesh(Params& params) {
    ObjectMesh mesh;
    mesh.p = read_vertices(params);
    mesh.triangles = triangles_of(read_indices(params, mesh.p.size(), 3));
    if (const Param* n = params.find("N", {Type::normal3})) {
        mesh.n = triples(*n);
        if (mesh.n.size() != mesh.p.size()) {
            params.warn_or_refuse(n->place,
                                  fmt::format("\"N\" has {} entries for {} vertices; expected one for each",
                                              mesh.n.size(), mesh.p.size()),
                                  "it is left out", "smooth shading");
            mesh.n.clear();
        }
    }
    if (const Param* s = params.find("S", {Type::vector3})) {
        params.warn_or_refuse(s->place, "\"S\", tangents at the vertices, is not supported",
                              "tangents along u are used", "the direction of anisotropic gloss");
    }
    params.accept({"discarddegenerateUVs", "faceIndices"});  // degenerate ones are repaired
    mesh.uv = read_uv(params, mesh.p.size());
    return mesh;
}

std::optional<ObjectMesh> read_ply_mesh(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::string name = params.string("filename", "");
    std::error_code status;
    if (reading.skip_missing && !std::filesystem::exists(reading.resolve(name), status)) {
        reading.warn(params.place_of("filename"),
                     fmt::format("{} is left out: no such file \"{}\"", params.owner(), shown(name)));
        return std::nullopt;
    }
    PlyMesh ply;
    try {
        ply = read_ply(reading.resolve(name));
    } catch (const InputError& error) {
        const bool missing = !std::filesystem::exists(reading.resolve(name), status);
        fail_always(params.place_of("filename"), "{}{}", printable(error.what()),
                    missing ? "; use --skip-missing to render without it" : "");
    }
    for (std::size_t i = 0; i < ply.p.size(); ++i) {
        if (is_finite(ply.p[i])) continue;
        fail_always(params.place_of("filename"),
                    "\"{}\": vertex {} is ({:g} {:g} {:g}); expected finite coordinates", shown(name), i,
                    ply.p[i].x, ply.p[i].y, ply.p[i].z);
    }
    ObjectMesh mesh;
    mesh.p.assign(ply.p.begin(), ply.p.end());
    mesh.n.assign(ply.n.begin(), ply.n.end());
    mesh.uv = std::move(ply.uv);
    mesh.triangles = std::move(ply.triangles);
    return mesh;
}

ObjectMesh read_array_mesh(const Reading& reading, Params& params) {
    const std::string name = params.string("name", "");
    const auto known = reading.meshes ? reading.meshes->find(name) : NamedMeshes::const_iterator();
    if (!reading.meshes || known == reading.meshes->end()) {
        fail(params.place(),
             "{}: there is no mesh \"{}\" in memory; expected the \"string name\" of a mesh passed by the "
             "program",
             params.owner(), shown(name));
    }
    const ObjectMesh& mesh = *known->second;
    WordHash& hash = reading.part->directives;
    hash.add_bytes(std::as_bytes(std::span(mesh.p)));
    hash.add_bytes(std::as_bytes(std::span(mesh.n)));
    hash.add_bytes(std::as_bytes(std::span(mesh.uv)));
    hash.add_bytes(std::as_bytes(std::span(mesh.triangles)));
    const auto vertices = static_cast<int>(mesh.p.size());
    for (const auto& [what, count] : {std::pair("normals", mesh.n.size()), std::pair("uv", mesh.uv.size())}) {
        if (count != 0 && count != mesh.p.size())
            fail(params.place(), "mesh \"{}\" has {} {} for {} vertices; expected one for each", name, count,
                 what, vertices);
    }
    if (mesh.triangles.empty()) fail(params.place(), "mesh \"{}\" has no triangles", name);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const int index : {mesh.triangles[i].x, mesh.triangles[i].y, mesh.triangles[i].z}) {
            if (index >= 0 && index < vertices) continue;
            fail(params.place(),
                 "mesh \"{}\", triangle {}: {} is not accepted; the mesh has vertices 0 to {}", name, i,
                 index, vertices - 1);
        }
    }
    return mesh;
}

ObjectMesh read_loop_mesh(Params& params) {
    ObjectMesh mesh;
    const std::vector<V3d> p = read_vertices(params);
    const std::vector<int> indices = read_indices(params, p.size(), 3);
    const char* name = params.has("levels") ? "levels" : "nlevels";  // of versions 4 and 3
    int levels = params.integer(name, 3);
    constexpr int kMostLevels = 10;
    if (levels < 0 || levels > kMostLevels) {
        const int held = std::clamp(levels, 0, kMostLevels);
        params.warn_or_refuse(
            params.place_of(name),
            fmt::format("{} {} is not accepted; expected 0 to {}", name, levels, kMostLevels),
            fmt::format("{} is used", held));
        levels = held;
    }
    constexpr double kMostTriangles = 2e8;
    if (static_cast<double>(indices.size()) / 3 * pow(4.0, levels) > kMostTriangles) {
        fail(params.place_of(name), "{} {} makes more than {:g} triangles of {}; use fewer", name, levels,
             kMostTriangles, indices.size() / 3);
    }
    params.accept({"scheme"});
    // Memory per triangle of the last level, for the levels that subdivision keeps and for the mesh.
    constexpr std::uint64_t kBytesOfTriangle = 250;
    require_memory(bytes_of(indices.size() / 3, kBytesOfTriangle << 2 * levels),
                   fmt::format("{}: {} {} of {} triangles", to_string(params.place().location()), name,
                               levels, indices.size() / 3),
                   "use fewer levels");
    try {
        LoopMesh limit = subdivide_loop(p, triangles_of(indices), levels);
        mesh.p = std::move(limit.p);
        mesh.n = std::move(limit.n);
        mesh.triangles = std::move(limit.triangles);
    } catch (const InputError& error) {
        fail(params.place(), "{}: {}", params.owner(), printable(error.what()));
    }
    return mesh;
}

// Reads the grid of heights over the unit square of versions 1 to 3.
ObjectMesh read_height_field(Params& params) {
    const int nu = params.integer("nu", 0), nv = params.integer("nv", 0);
    if (nu < 2 || nv < 2)
        fail(params.place(), "{}: nu {} and nv {}; expected at least 2 each", params.owner(), nu, nv);
    const Param* z = params.find("Pz", {Type::real});
    if (!z) fail(params.place(), "{} lacks \"float Pz\", its heights", params.owner());
    const auto columns = static_cast<std::size_t>(nu), rows = static_cast<std::size_t>(nv);
    require_count(*z, z->numbers.size(), columns * rows);
    ObjectMesh mesh;
    for (std::size_t y = 0; y < rows; ++y) {
        for (std::size_t x = 0; x < columns; ++x) {
            const double u = static_cast<double>(x) / (nu - 1), v = static_cast<double>(y) / (nv - 1);
            mesh.p.emplace_back(u, v, z->numbers[x + y * columns]);
            mesh.uv.emplace_back(static_cast<float>(u), static_cast<float>(v));
        }
    }
    for (int y = 0; y + 1 < nv; ++y) {
        for (int x = 0; x + 1 < nu; ++x) {
            const int corner = x + y * nu;
            mesh.triangles.emplace_back(corner, corner + 1, corner + nu + 1);
            mesh.triangles.emplace_back(corner, corner + nu + 1, corner + nu);
        }
    }
    return mesh;
}

}  // namespace lucerna
