// Rays as files that optics programs read: IES TM-25, Zemax binary, LightTools binary.
//
// A file is written block by block, so that it may be larger than the memory, and replaced as a whole. The
// same rays make the same bytes: no date is written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/vec.h"
#include "lights/flux_unit.h"
#include "lights/ray_set.h"

namespace lucerna {

struct RayFileInfo {
    std::uint64_t rays = 0;
    FluxUnit unit = FluxUnit::lumen;
    double flux = 0;   // of all rays, in `unit`
    Rgb colour{1.0F};  // luminance 1. TM-25 keeps it beside luminous flux; the other formats have no place
                       // for a colour that is no wavelength
    std::string text;  // what the file is of, one line
};

// Fills the block with the next rays: positions in metres, unit directions, flux in info.unit.
using NextRays = std::function<void(std::vector<LampRay>& block)>;

// The format goes by the suffix: .tm25ray, .dat, .ray. `next` is called until info.rays rays have come; a
// block that is empty or holds more than are wanted is our own fault. Throws InputError for another suffix,
// for rays that the format cannot count, or if the file cannot be written.
void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextRays& next);
// The usable rays of a set.
void write_rays(const std::filesystem::path& file, const RaySet& set);

// The suffixes, as an error should name them.
inline constexpr const char* kRaySuffixes = ".tm25ray, .dat (Zemax) and .ray (LightTools)";
bool has_ray_suffix(const std::filesystem::path& file);
// Whether a file of that name would tell the colour of these rays.
bool keeps_colour(const std::filesystem::path& file, const RayFileInfo& info);

}  // namespace lucerna
