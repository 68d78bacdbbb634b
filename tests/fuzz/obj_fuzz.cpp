// libFuzzer's entry to OBJ models: text, read as a model and as its materials at once, gives a model whose
// indices are all valid, or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/model/model.h"
#include "tests/fuzz/input.h"

using lucerna::testing::bytes_of_input;
using lucerna::testing::file_of_bytes;
using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

void require_whole(const lucerna::Model& model) {
    for (const lucerna::ModelMesh& mesh : model.meshes) {
        require(mesh.material >= 0 && static_cast<std::size_t>(mesh.material) < model.materials.size(),
                "a mesh has no material");
        require(mesh.n.empty() || mesh.n.size() == mesh.p.size(), "normals do not go with vertices");
        require(mesh.uv.empty() || mesh.uv.size() == mesh.p.size(), "uv do not go with vertices");
        for (const lucerna::V3f& p : mesh.p) require(std::isfinite(p.length2()), "a vertex is not finite");
        for (const lucerna::V3i& triangle : mesh.triangles) {
            for (int c = 0; c < 3; ++c) {
                const bool inside = triangle[c] >= 0 && static_cast<std::size_t>(triangle[c]) < mesh.p.size();
                require(inside, "an index is of no vertex");
            }
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path materials = file_of_input(data, size, ".mtl");
    std::vector<std::byte> text;
    for (const char c : "mtllib " + materials.filename().string() + "\n")
        text.push_back(static_cast<std::byte>(c));
    for (const std::byte byte : bytes_of_input(data, size)) text.push_back(byte);
    const std::filesystem::path file = file_of_bytes(text, ".obj");
    lucerna::Monitor silent;
    try {
        require_whole(lucerna::read_obj(file, {0.001, true}, silent));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
