// Invariants of both readers of photometric files, for any bytes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lights/photometric.h"
#include "lights/photometric_files.h"
#include "tests/fuzz/input.h"

namespace lucerna::testing {

inline void require_sound(const PhotometricWeb& web) {
    require(std::isfinite(web.flux()) && web.flux() >= 0, "the flux is no flux");
    const double value = web.intensity(V3d(0.6, 0.0, 0.8));
    require(std::isfinite(value) && value >= 0 && value <= web.peak() * (1 + 1e-9),
            "an intensity beyond the table");
    if (const auto drawn = web.draw({0.3F, 0.7F})) {
        require(std::fabs(drawn->w.length() - 1) < 1e-4F, "a direction is not unit");
        require(drawn->pdf_w > 0, "a density is not positive");
    }
    require(ies_text(web, "fuzz").size() > 100, "nothing was written");
}

template <typename Parse>
int fuzz_photometric(const std::uint8_t* data, std::size_t size, Parse&& parse) {
    Monitor silent;
    try {
        require_sound(parse(std::string_view(reinterpret_cast<const char*>(data), size), "lamp", silent));
    } catch (const InputError& error) {
        require_one_line(error);
    }
    return 0;
}

}  // namespace lucerna::testing
