// libFuzzer's entry to the reader of light fields (OpenEXR): bytes in, a field of finite numbers or an
// InputError out.
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "engine/base/error.h"
#include "lights/light_field.h"

namespace {

std::filesystem::path file_of_this_process() {
    return std::filesystem::temp_directory_path() / ("lucerna-fuzz-" + std::to_string(getpid()) + ".exr");
}

void require(bool good, const char* what) {
    if (good) return;
    std::fprintf(stderr, "%s\n", what);
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_this_process();
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        const lucerna::LightField field = lucerna::read_light_field(file);
        require(field.rig().fault().empty(), "the geometry is none");
        require(field.coefficients().size() == field.rig().coefficients(), "coefficients are missing");
        for (const float e : field.coefficients()) require(std::isfinite(e), "a coefficient is no number");
        require(std::isfinite(field.flux()), "the flux is no number");
    } catch (const lucerna::InputError& error) {
        const std::string message = error.what();
        require(!message.empty() && message.find('\n') == message.npos, "an error is not one line");
    }
    return 0;
}
