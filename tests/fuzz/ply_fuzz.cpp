// libFuzzer's entry to the PLY reader: bytes in, a mesh whose indices are all of vertices or an InputError
// out.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "engine/base/error.h"
#include "engine/world/ply.h"

namespace {

std::filesystem::path file_of_this_process() {
    return std::filesystem::temp_directory_path() / ("lucerna-fuzz-" + std::to_string(getpid()) + ".ply");
}

void require(bool good, const char* what) {
    if (good) return;
    std::fprintf(stderr, "%s\n", what);
    std::abort();
}

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
    const std::filesystem::path file = file_of_this_process();
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        require_sound(lucerna::read_ply(file));
    } catch (const lucerna::InputError& error) {
        const std::string message = error.what();
        require(!message.empty() && message.find('\n') == message.npos, "an error is not one line");
    }
    return 0;
}
