// libFuzzer's entry to the PLY reader: bytes give a mesh whose indices are all valid, or an InputError.
#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/scene/mesh.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

void require_sound(const lucerna::PlyMesh& mesh) {
    require(mesh.n.empty() || mesh.n.size() == mesh.p.size(), "normals do not go with vertices");
    require(mesh.uv.empty() || mesh.uv.size() == mesh.p.size(), "uv do not go with vertices");
    for (const lucerna::V3i& triangle : mesh.triangles) {
        for (int c = 0; c < 3; ++c) {
            const bool inside = triangle[c] >= 0 && static_cast<std::size_t>(triangle[c]) < mesh.p.size();
            require(inside, "an index is of no vertex");
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".ply");
    try {
        require_sound(lucerna::read_ply(file));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
