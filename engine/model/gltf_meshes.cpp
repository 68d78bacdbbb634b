// Converts each primitive of a glTF mesh to a mesh [glTF 2.0, 3.7].
#include <algorithm>
#include <cmath>

#include "engine/model/gltf_reader.h"
#include "engine/system/memory.h"

namespace lucerna {

std::vector<V3i> triangles_of(int mode, const std::vector<std::uint32_t>& corners) {
    std::vector<V3i> triangles;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
        const V3i t(static_cast<int>(corners[a]), static_cast<int>(corners[b]), static_cast<int>(corners[c]));
        if (t.x != t.y && t.y != t.z && t.x != t.z) triangles.push_back(t);
    };
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        for (std::size_t i = 0; i + 2 < corners.size(); i += 3) add(i, i + 1, i + 2);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
        for (std::size_t i = 0; i + 2 < corners.size(); ++i) add(i, i + 1 + i % 2, i + 2 - i % 2);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
        for (std::size_t i = 1; i + 1 < corners.size(); ++i) add(i, i + 1, 0);
    }
    return triangles;
}

std::vector<std::uint32_t> GltfReader::corners(const tinygltf::Primitive& from, std::size_t vertices,
                                               const std::string& name) const {
    std::vector<std::uint32_t> corners;
    if (from.indices < 0) {
        for (std::size_t i = 0; i < vertices; ++i) corners.push_back(static_cast<std::uint32_t>(i));
        return corners;
    }
    const tinygltf::Accessor& accessor = pick(in_.accessors, from.indices, "accessor of indices");
    const bool whole = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                       accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                       accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    if (!whole || accessor.normalized) fail("{}: indices must be unsigned whole numbers", name);
    for (const double index : numbers(from.indices, 1, name + ": indices")) {
        if (!(index < static_cast<double>(vertices))) {
            fail("{}: index {} of {} vertices", name, index, vertices);
        }
        corners.push_back(static_cast<std::uint32_t>(index));
    }
    return corners;
}

ModelMesh GltfReader::primitive(const tinygltf::Primitive& from, const std::string& name) const {
    ModelMesh made;
    made.name = name;
    made.material = from.material;
    if (made.material >= 0) pick(in_.materials, made.material, "material");
    const auto attribute = [&](const char* semantic, int components) -> std::vector<double> {
        const auto found = from.attributes.find(semantic);
        if (found == from.attributes.end()) return {};
        return numbers(found->second, components, fmt::format("{}: {}", name, semantic));
    };
    const auto as_float = [](double v) { return static_cast<float>(v); };
    const std::vector<double> p = attribute("POSITION", 3);
    const std::vector<double> n = attribute("NORMAL", 3);
    const std::vector<double> uv = attribute("TEXCOORD_0", 2);
    const std::size_t vertices = p.size() / 3;
    if (!n.empty() && n.size() / 3 != vertices)
        fail("{}: {} normals for {} vertices", name, n.size() / 3, vertices);
    if (!uv.empty() && uv.size() / 2 != vertices) {
        fail("{}: {} texture coordinates for {} vertices", name, uv.size() / 2, vertices);
    }
    for (std::size_t i = 0; i < p.size(); i += 3)
        made.p.emplace_back(as_float(p[i]), as_float(p[i + 1]), as_float(p[i + 2]));
    for (std::size_t i = 0; i < n.size(); i += 3)
        made.n.emplace_back(as_float(n[i]), as_float(n[i + 1]), as_float(n[i + 2]));
    // glTF's v runs down from an image's top.
    for (std::size_t i = 0; i < uv.size(); i += 2)
        made.uv.emplace_back(as_float(uv[i]), as_float(1 - uv[i + 1]));
    made.triangles =
        triangles_of(from.mode < 0 ? TINYGLTF_MODE_TRIANGLES : from.mode, corners(from, vertices, name));
    if (!from.targets.empty()) warn("{}: morph targets are not applied", name);
    return made;
}

// Checks memory before anything is read, because an accessor of zeros needs no bytes in the file and many
// primitives may share an accessor. Invalid accessors and counts are rejected when they are read.
void GltfReader::require_room_for_meshes() const {
    double values = 0;  // a double, because a sum of integers could wrap around
    const auto count = [&](int accessor, int components) {
        if (accessor < 0 || static_cast<std::size_t>(accessor) >= in_.accessors.size()) return;
        values += components * static_cast<double>(in_.accessors[static_cast<std::size_t>(accessor)].count);
    };
    for (const tinygltf::Mesh& mesh : in_.meshes) {
        for (const tinygltf::Primitive& primitive : mesh.primitives) {
            const auto position = primitive.attributes.find("POSITION");
            if (position == primitive.attributes.end()) continue;
            for (const auto& [name, accessor] : primitive.attributes) {
                if (name == "POSITION" || name == "NORMAL") count(accessor, 3);
                if (name == "TEXCOORD_0") count(accessor, 2);
            }
            // A triangle has three corners; a strip has nearly as many triangles as corners.
            const bool strip = primitive.mode > TINYGLTF_MODE_TRIANGLES;
            count(primitive.indices >= 0 ? primitive.indices : position->second, strip ? 3 : 1);
        }
    }
    require_memory(static_cast<std::uint64_t>(std::min(values, 1e18)) * sizeof(float),
                   file_.string() + ": its meshes", "use fewer vertices");
}

void GltfReader::read_meshes() {
    require_room_for_meshes();
    primitives_.resize(in_.meshes.size());
    for (std::size_t m = 0; m < in_.meshes.size(); ++m) {
        const tinygltf::Mesh& mesh = in_.meshes[m];
        for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
            const std::string name = fmt::format("mesh {} (\"{}\"), primitive {}", m, mesh.name, i);
            const tinygltf::Primitive& from = mesh.primitives[i];
            if (from.mode >= 0 && from.mode < TINYGLTF_MODE_TRIANGLES) {
                warn("{}: points and lines are left out", name);
                continue;
            }
            ModelMesh made = primitive(from, name);
            if (made.triangles.empty()) {
                warn("{}: has no triangles; left out", name);
                continue;
            }
            primitives_[m].push_back(out_.meshes.size());
            out_.meshes.push_back(std::move(made));
        }
    }
}

}  // namespace lucerna
