// Rays that leave a lamp, as a goniophotometer or a simulation has recorded them.
//
// A ray file is a Monte Carlo sample of a lamp's light field: each ray carries a share of the flux. It can be
// emitted as it is, or projected onto a light field (ray_projection.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "lights/flux_unit.h"

namespace lucerna {

struct LampRay {
    V3f o;       // where the ray starts, metres in the lamp's frame
    V3f d;       // unit
    float flux;  // >= 0, in the set's unit
};

struct RaySet {
    std::vector<LampRay> rays;
    FluxUnit unit = FluxUnit::watt;
    double flux = 0;                // of the whole lamp: all rays, and the skipped ones
    double skipped_flux = 0;        // of rays that were skipped although their flux is known
    std::uint64_t skipped_nan = 0;  // position, direction or flux not finite, or flux negative
    std::uint64_t skipped_zero_direction = 0;
    double header_lumens = 0, header_watts = 0;  // as the file states them; 0 or NaN: not stated
    Rgb colour{1.0F};                            // luminance 1, all components >= 0
    std::string provenance;                      // one line: what the file says about itself
};

// IES TM-25-13 (.tm25ray), Zemax binary (.dat), LightTools binary (.ray). A header's flux, if finite and
// positive, wins over the sum of the rays (a warning when they differ by more than 0.1 %). Throw InputError
// naming file and cause.
RaySet read_tm25(const std::filesystem::path& file, Monitor& monitor);
RaySet read_zemax(const std::filesystem::path& file, Monitor& monitor);
RaySet read_lighttools(const std::filesystem::path& file, Monitor& monitor);
// Any of them, told by the first bytes, else by the name.
RaySet read_rays(const std::filesystem::path& file, Monitor& monitor);

}  // namespace lucerna
