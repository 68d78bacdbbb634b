#include "lights/measurement/ray_bootstrap.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

constexpr std::int64_t kDrawsPerChunk = 16 * 1024;  // fixed, so that draws do not depend on threads

// Returns one of `count` indices, each with equal probability to within count / 2^53.
std::size_t draw_index(Sampler& sampler, std::size_t count) {
    const std::uint64_t high = sampler.bits() >> 5U, low = sampler.bits() >> 6U;  // 27 and 26 bits
    const double u = std::ldexp(static_cast<double>(high << 26U | low), -53);
    return std::min(count - 1, static_cast<std::size_t>(u * static_cast<double>(count)));
}

double whole_light(const RaySet& set) {
    double light = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) light += set.light_of(i);
    return light;
}

bool states_flux(const RaySet& set) {
    const double flux = set.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts;
    return std::isfinite(flux) && flux > 0;
}

// Colours of single rays are relative to the mean of all (RaySet::tristimulus).
void settle_colours(RaySet& set) {
    V3d sum(0, 0, 0);
    double flux = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        sum += double{set.rays[i].flux} * V3d(set.tristimulus[i]);
        flux += double{set.rays[i].flux};
    }
    if (!(sum.y > 0)) return;
    set.xyz = sum / sum.y;
    const auto factor = static_cast<float>(flux / sum.y);
    for (V3f& ray : set.tristimulus) ray *= factor;
}

}  // namespace

RaySet resampled(const RaySet& set, const BootstrapKey& key, const Workers& workers) {
    assert(!set.rays.empty());
    const std::size_t count = set.rays.size();
    require_memory(
        bytes_of(count, sizeof(LampRay) + 2 * sizeof(std::size_t) + (set.coloured() ? sizeof(V3f) : 0)),
        fmt::format("a replicate of {} rays", count), "use fewer rays");
    RaySet drawn;
    drawn.unit = set.unit;
    drawn.flux = set.flux;
    drawn.skipped_flux = set.skipped_flux;
    drawn.skipped_nan = set.skipped_nan;
    drawn.skipped_zero_direction = set.skipped_zero_direction;
    drawn.header_lumens = set.header_lumens;
    drawn.header_watts = set.header_watts;
    drawn.xyz = set.xyz;
    drawn.spectra = set.spectra;
    drawn.lumens_per_watt = set.lumens_per_watt;
    drawn.provenance = fmt::format("bootstrap replicate {} of {}", key.replicate, set.provenance);
    std::vector<std::size_t> draws(count);
    parallel_ranges(workers, static_cast<std::int64_t>(count), kDrawsPerChunk,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                        Sampler sampler(key.seed, Purpose::bootstrap,
                                        static_cast<std::uint32_t>(key.replicate),
                                        std::uint64_t{key.part} << 32U | static_cast<std::uint64_t>(chunk));
                        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
                            draws[i] = draw_index(sampler, count);
                    });
    std::vector<std::uint32_t> times(count);
    for (const std::size_t i : draws) ++times[i];
    for (std::size_t i = 0; i < count; ++i) {
        if (times[i] == 0) continue;
        drawn.take(set, i);
        drawn.rays.back().flux *= static_cast<float>(times[i]);
    }
    if (set.coloured()) settle_colours(drawn);
    const double before = whole_light(set), now = whole_light(drawn);
    if (!states_flux(set)) {
        drawn.flux += now - before;
    } else if (now > 0) {
        for (LampRay& ray : drawn.rays) ray.flux = static_cast<float>(double{ray.flux} * (before / now));
    }
    return drawn;
}

std::filesystem::path replicate_file(const std::filesystem::path& lamp, int replicate) {
    return lamp.parent_path() /
           fmt::format("{}-replicate-{:02}{}", lamp.stem().string(), replicate, lamp.extension().string());
}

int count_replicates(const std::filesystem::path& lamp) {
    const auto is_there = [&](int replicate) {
        std::error_code unknown;
        return std::filesystem::exists(replicate_file(lamp, replicate), unknown);
    };
    if (!is_there(1)) return 0;
    const std::uint64_t hash = content_hash(read_lumigraph(lamp));
    int count = 0;
    while (count < kMostReplicates && is_there(count + 1)) {
        const std::filesystem::path file = replicate_file(lamp, ++count);
        const Lumigraph replicate = read_lumigraph(file);
        if (replicate.slabs()[0].field.info().replicate_of == hash) continue;
        input_error({file.string()},
                    "is not a replicate of {} as it is now; make both anew by one lucerna light import "
                    "--replicates, or remove it",
                    lamp.string());
    }
    return count;
}

}  // namespace lucerna
