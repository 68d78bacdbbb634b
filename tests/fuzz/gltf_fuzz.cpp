// libFuzzer's entry to glTF models, as text or binary: bytes give a model whose indices are all valid, or an
// InputError.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "engine/model/model.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

void require_sound(const lucerna::Model& model) {
    for (const lucerna::ModelMesh& mesh : model.meshes) {
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
    const bool binary = std::string_view(reinterpret_cast<const char*>(data), size).starts_with("glTF");
    const std::filesystem::path file = file_of_input(data, size, binary ? ".glb" : ".gltf");
    lucerna::Monitor silent;
    try {
        require_sound(lucerna::read_gltf(file, silent));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
