// libFuzzer's entry to the readers of ray files (the bytes choose the format): bytes give rays
// of finite numbers or an InputError. A TM-25 header has 36,000 bytes of text, of which the input contains
// 16.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "lights/ray_set.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

void require_sound(const lucerna::RaySet& set) {
    require(!set.rays.empty(), "a set without rays");
    require(std::isfinite(set.flux) && set.flux >= 0, "the flux is no number");
    require(lucerna::is_finite(set.colour()) && lucerna::luminance(set.colour()) > 0, "the colour is none");
    require(std::isfinite(set.xyz.x) && set.xyz.y == 1 && std::isfinite(set.xyz.z), "the XYZ are none");
    require(set.tristimulus.empty() || set.tristimulus.size() == set.rays.size(), "rays without a colour");
    for (const lucerna::V3f& xyz : set.tristimulus) {
        require(lucerna::is_finite(xyz) && std::min({xyz.x, xyz.y, xyz.z}) >= 0, "a ray's colour is none");
    }
    for (const lucerna::LampRay& ray : set.rays) {
        require(lucerna::is_finite(ray.o), "a position is no number");
        require(std::fabs(ray.d.length() - 1) < 1e-4F, "a direction is no unit vector");
        require(std::isfinite(ray.flux) && ray.flux >= 0, "a ray's flux is no number");
    }
    require(set.provenance.find('\n') == std::string::npos, "the provenance is not one line");
}

}  // namespace

namespace {

constexpr std::size_t kBeforeText = 288, kTextHere = 16, kText = 36000;

std::string unfolded(const std::uint8_t* data, std::size_t size) {
    std::string bytes(reinterpret_cast<const char*>(data), size);
    if (bytes.starts_with("TM25") && size > kBeforeText + kTextHere)
        bytes.insert(kBeforeText + kTextHere, kText - kTextHere, '\0');
    return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes = unfolded(data, size);
    const std::filesystem::path file =
        file_of_input(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), ".rays");
    lucerna::Monitor silent;
    try {
        require_sound(lucerna::read_rays(file, silent));
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
