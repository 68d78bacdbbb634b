// libFuzzer's entry to the reader of light fields (OpenEXR): bytes give a field of finite numbers or an
// InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "lights/light_field.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".exr");
    try {
        const lucerna::LightField field = lucerna::read_light_field(file);
        require(field.rig().fault().empty(), "the geometry is none");
        require(field.coefficients().size() == field.rig().coefficients(), "coefficients are missing");
        for (const float e : field.coefficients()) require(std::isfinite(e), "a coefficient is no number");
        require(std::isfinite(field.flux()), "the flux is no number");
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
