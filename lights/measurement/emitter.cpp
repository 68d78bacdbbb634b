#include "lights/measurement/emitter.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace lucerna {
namespace {}  // namespace

EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux, double exponent,
                            std::function<double(const V2d&)> pattern) {
    const bool disc = outline == EmitterModel::Outline::disc;
    const V2d half = disc ? V2d(half_size.x, half_size.x) : half_size;
    if (!(half.x > 0 && half.y > 0) || !std::isfinite(half.x) || !std::isfinite(half.y)) {
        throw InputError(
            fmt::format("emitter: a half size of {} by {} m; finite and positive", half.x, half.y));
    }
    if (!(flux > 0) || !std::isfinite(flux))
        throw InputError(fmt::format("emitter: a flux of {}; positive", flux));
    if (!(exponent >= 1) || !std::isfinite(exponent)) {
        throw InputError(fmt::format("emitter: a lobe exponent of {}; 1 (Lambertian) or more", exponent));
    }
    // The pattern's mean over the outline, by the midpoint rule.
    double mean = 1;
    if (pattern) {
        constexpr int kSide = 512;
        double sum = 0;
        int points = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
            const V2d p(2 * (i % kSide + 0.5) / kSide - 1,
                        2 * (static_cast<double>(i / kSide) + 0.5) / kSide - 1);
            if (disc && p.length2() > 1) continue;
            sum += pattern(p);
            ++points;
        }
        mean = sum / points;
        if (!(mean > 0) || !std::isfinite(mean))
            throw InputError(fmt::format("emitter: a pattern of mean {}", mean));
    }
    // flux = A L0 ∫ cos^exponent dω = A L0 2π / (exponent + 1).
    const double area = disc ? kPiD * half.x * half.x : 4 * half.x * half.y;
    const double l0 = flux * (exponent + 1) / (2 * kPiD * area * mean);
    EmitterModel emitter;
    emitter.outline = outline;
    emitter.half_size = half;
    emitter.flux = flux;
    emitter.radiance = [=](const V2d& position, const V3d& direction) {
        const double lobe = exponent == 1 ? 1.0 : std::pow(std::max(0.0, direction.z), exponent - 1);
        return l0 * lobe * (pattern ? pattern({position.x / half.x, position.y / half.y}) : 1.0);
    };
    emitter.info.provenance = fmt::format("computed: {} of {:g} x {:g} m, cosine power {:g}",
                                          disc ? "disc" : "rectangle", 2 * half.x, 2 * half.y, exponent);
    return emitter;
}

}  // namespace lucerna
