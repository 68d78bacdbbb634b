// Reads bilinearmesh, patches between four points.
#include <fmt/format.h>

#include <cmath>

#include "engine/pbrt/shapes.h"
#include "engine/scene/mesh.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// A mesh that emits becomes a grid of triangles over each patch, or two triangles for a parallelogram.
constexpr std::uint64_t kBytesOfTessellated =
    33 * 33 * (sizeof(V3d) + sizeof(V2f)) + 2 * 32 * 32 * sizeof(V3i);
ObjectMesh tessellated(const BilinearMesh& mesh) {
    ObjectMesh out;
    for (std::size_t i = 0; i < mesh.patches.size(); ++i) {
        const PatchShape shape(mesh, i);
        const int pieces = shape.is_flat_parallelogram() ? 1 : 32;
        const auto first = static_cast<int>(out.p.size());
        for (int y = 0; y <= pieces; ++y) {
            for (int x = 0; x <= pieces; ++x) {
                const double u = static_cast<double>(x) / pieces, v = static_cast<double>(y) / pieces;
                out.p.push_back(shape.point(u, v));
                out.uv.emplace_back(static_cast<float>(u), static_cast<float>(v));
            }
        }
        for (int y = 0; y < pieces; ++y) {
            for (int x = 0; x < pieces; ++x) {
                const int corner = first + y * (pieces + 1) + x, above = corner + pieces + 1;
                out.triangles.emplace_back(corner, corner + 1, above + 1);
                out.triangles.emplace_back(corner, above + 1, above);
            }
        }
    }
    return out;
}

}  // namespace

void add_patches(Reading& reading, Params& params) {
    const Param* p = params.find("P", {Type::point3});
    if (!p || p->numbers.empty()) fail(params.place(), "{} lacks \"point3 P\", its vertices", params.owner());
    const std::vector<V3d> points = triples(*p);
    const std::vector<int> indices = read_indices(params, points.size(), 4);
    DraftPatches mesh;
    for (std::size_t i = 0; i < indices.size(); i += 4) {
        mesh.patches.push_back({indices[i], indices[i + 1], indices[i + 2], indices[i + 3]});
    }
    mesh.uv = read_uv(params, points.size());
    const std::optional<M44d> back = inverse(reading.state.ctm);  // none: the patches are flattened
    if (const Param* n = params.find("N", {Type::normal3})) {
        require_count(*n, n->numbers.size() / 3, points.size());
        const M44d back_of_n = back.value_or(M44d());
        const double turn = reading.state.reverse_orientation ? -1 : 1;
        for (const V3d& normal : triples(*n)) {
            mesh.n.emplace_back(V3f(turn * transform_normal(back_of_n, normal.normalized()).normalized()));
        }
    }
    if (params.has("emissionfilename")) {
        params.accept({"emissionfilename"});
        params.warn_or_refuse(params.place_of("emissionfilename"), "\"emissionfilename\" is not supported",
                              "the patch emits uniformly", "the image on it");
    }
    const std::optional<SurfaceTraits> traits = traits_here(reading, params);
    if (!traits) return;
    if (!back || (reading.state.area_light && emits(reading, params))) {
        require_memory(bytes_of(mesh.patches.size(), kBytesOfTessellated),
                       fmt::format("{}: the triangles of {} patches", to_string(params.place().location()),
                                   mesh.patches.size()),
                       "use fewer patches");
        BilinearMesh object;
        object.p.assign(points.begin(), points.end());
        object.patches = mesh.patches;
        return add_mesh(reading, params, *traits, tessellated(object));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        mesh.p.push_back(transformed_point(reading, params, points[i], i));
    }
    mesh.traits = of_world_edges(reading, *traits);
    reading.shapes().patches.push_back(std::move(mesh));
}

}  // namespace lucerna
