// Only this file uses OpenSubdiv.
#include "engine/scene/mesh.h"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "engine/base/error.h"

namespace lucerna {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

// OpenSubdiv's callbacks interpolate this vertex type: double positions, float weights.
struct Vertex {
    V3d p{0, 0, 0};

    void Clear() { p = V3d(0); }
    void AddWithWeight(const Vertex& other, float weight) { p += static_cast<double>(weight) * other.p; }
};

using Refiner = std::unique_ptr<Far::TopologyRefiner>;

void refuse_no_surface(const std::vector<V3i>& triangles) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const V3i& t = triangles[i];
        if (t.x == t.y || t.y == t.z || t.z == t.x) {
            throw InputError(
                fmt::format("triangle {} is {} {} {}; expected three different vertices", i, t.x, t.y, t.z));
        }
    }
}

Refiner make_refiner(std::size_t vertices, const std::vector<V3i>& triangles) {
    std::vector<int> corners(triangles.size(), 3), indices;
    indices.reserve(3 * triangles.size());
    for (const V3i& t : triangles) indices.insert(indices.end(), {t.x, t.y, t.z});
    Far::TopologyDescriptor description;
    description.numVertices = static_cast<int>(vertices);
    description.numFaces = static_cast<int>(triangles.size());
    description.numVertsPerFace = corners.data();
    description.vertIndicesPerFace = indices.data();
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    Refiner refiner(Factory::Create(description, Factory::Options(Sdc::SCHEME_LOOP, options)));
    if (!refiner) throw InputError("these triangles do not form a surface that can be subdivided");
    const Far::TopologyLevel& base = refiner->GetLevel(0);
    for (int edge = 0; edge < base.GetNumEdges(); ++edge) {
        if (!base.IsEdgeNonManifold(edge)) continue;
        const auto ends = base.GetEdgeVertices(edge);
        throw InputError(
            fmt::format("the edge from vertex {} to {} has {} triangles, or two of opposite orientation; "
                        "expected one, or two of the same orientation",
                        ends[0], ends[1], base.GetEdgeFaces(edge).size()));
    }
    return refiner;
}

}  // namespace

LoopMesh subdivide_loop(const std::vector<V3d>& p, const std::vector<V3i>& triangles, int levels) {
    refuse_no_surface(triangles);
    const Refiner refiner = make_refiner(p.size(), triangles);
    Far::TopologyRefiner::UniformOptions refinement(levels);
    refinement.fullTopologyInLastLevel = true;  // limit positions are evaluated there
    refiner->RefineUniform(refinement);
    const Far::PrimvarRefiner primvars(*refiner);
    // Weights are float32. Positions relative to the mesh's centre lose no precision far from the origin.
    V3d middle(0);
    for (const V3d& q : p) middle += q / static_cast<double>(p.size());
    std::vector<Vertex> from(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) from[i].p = p[i] - middle;
    for (int level = 1; level <= levels; ++level) {
        std::vector<Vertex> finer(static_cast<std::size_t>(refiner->GetLevel(level).GetNumVertices()));
        primvars.Interpolate(level, from, finer);
        from = std::move(finer);
    }
    const Far::TopologyLevel& finest = refiner->GetLevel(levels);
    std::vector<Vertex> limit(from.size()), along(from.size()), across(from.size());
    primvars.Limit(from, limit, along, across);

    LoopMesh mesh;
    mesh.p.reserve(limit.size());
    mesh.n.reserve(limit.size());
    for (std::size_t i = 0; i < limit.size(); ++i) {
        mesh.p.push_back(limit[i].p + middle);
        mesh.n.push_back(along[i].p.cross(across[i].p).normalized());
    }
    mesh.triangles.reserve(static_cast<std::size_t>(finest.GetNumFaces()));
    for (int face = 0; face < finest.GetNumFaces(); ++face) {
        const auto v = finest.GetFaceVertices(face);
        mesh.triangles.emplace_back(v[0], v[1], v[2]);
    }
    return mesh;
}

}  // namespace lucerna
