// What media do to a ray between two surfaces, for methods that know the radiance at any place: they add what
// they scatter into it, and take their share of what comes from behind.
//
// The end is always looked at, and one place on the way beside it, whatever the chances: a thin fog makes no
// noise on what is seen through it, and a thick one none on itself. (A path tracer, for which both are a path
// to be followed, chooses one.) Emission by media is not looked for here; scenes that have it are for `path`.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/integrators/direct_light.h"

namespace lucerna {

// Below this share what lies behind media is looked at only sometimes.
inline constexpr float kFaintPassage = 0.1F;

struct MediaSegment {
    Rgb passed{1.0F};                 // the share of what comes from the end
    Rgb added{0.0F};                  // radiance, W/(m² sr)
    std::int32_t medium = kNoMedium;  // of the borders, at the end

    // Roulette for a faint end. False: it need not be looked at.
    bool survives(Sampler& sampler) {
        const float left = max_component(passed);
        if (!(left < kFaintPassage)) return true;
        if (!(sampler.next() < left / kFaintPassage)) return false;
        passed *= kFaintPassage / left;  // left > 0, or it were lost
        return true;
    }
};

// Of a ray that meets `hit`, or nothing; it begins in `medium`, with `throughput` (not black).
// `source(MediumVertex, sigma_s)` is what is scattered into it there: radiance per unit of length.
template <typename Source>
MediaSegment cross_with(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                        std::int32_t medium, const Rgb& throughput, Sampler& sampler, Source&& source) {
    constexpr std::uint32_t kPassBranch = 0x9a;
    MediaSegment segment;
    segment.medium = medium;
    if (scene.media().empty()) return segment;
    const Ray way{ray.o, ray.d, hit ? hit->t : ray.t_max};
    segment.medium = for_each_piece(scene, way, medium, [&](const MediumPiece& piece) {
        const Rgb arriving = throughput * segment.passed;
        if (is_black(arriving)) return false;
        if (const auto place = scatter_within(piece.along, arriving, sampler)) {
            const MediumVertex vertex{scattering_point(piece, place->t, hit), HenyeyGreenstein(place->g),
                                      -ray.d, piece.medium};
            segment.added += segment.passed * place->flow * source(vertex, place->sigma_s);
        }
        Sampler more = sampler.split(kPassBranch);
        segment.passed *= transmittance(piece.along, more);
        return true;
    });
    return segment;
}

}  // namespace lucerna
