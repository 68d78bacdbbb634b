// Emission of photons [Jensen 2001, 5.1]: a light is chosen by its power, then a particle of it is sampled.
// Learned emission (learned_emission.h) may guide both choices; the start's power is then weighted so that
// every mean stays what it is.
//
// Light paths start in batches: their numbers come from one scrambled Sobol sequence, and each light is asked
// once for all its particles of a batch, so that the reads of a measured lamp's tables overlap. A path's
// start is the same in whatever batch it is asked for.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/scene.h"
#include "lights/emission_net.h"
#include "photon/learned_emission.h"

namespace lucerna {

struct LightPathStart {
    std::uint32_t light;
    CellId cell;
    SurfacePoint from;
    V3f d;                            // unit
    Rgb power;                        // W, not yet divided by the number of paths; its mean over paths
                                      // is the flux of all lights (in expectation, if learned emission
                                      // weights it)
    std::int32_t medium = kNoMedium;  // by the scene's medium interfaces, in which it begins
};

// Starts the paths of one pass. For one thread: it keeps its working memory.
class Emission {
  public:
    // A batch that stays within the L2 cache.
    static constexpr std::size_t kBatch = 512;

    // Plain if `learned` is null; it must outlive this.
    Emission(const Scene& scene, std::uint64_t seed, Purpose purpose, std::uint32_t pass,
             const LearnedEmission* learned = nullptr)
        : scene_(scene), net_(seed, purpose, pass, net_kind(purpose)), learned_(learned) {}

    // Paths first, first + 1 …, as many as `out` has places. No sample: no light has power, or the light had
    // nothing to emit for these numbers.
    void start(std::uint32_t first, std::span<std::optional<LightPathStart>> out);

    // Sets of VPLs start from few paths each, maps from many at once.
    static EmissionNet::Kind net_kind(Purpose purpose) {
        return purpose == Purpose::vpl ? EmissionNet::Kind::pairs : EmissionNet::Kind::joint;
    }

    // Calls visit(path, start) for the paths [begin, end) in order.
    template <typename Visit>
    void for_each(std::uint64_t begin, std::uint64_t end, Visit&& visit) {
        starts_.resize(kBatch);
        for (std::uint64_t first = begin; first < end; first += kBatch) {
            const std::span batch(starts_.data(), std::min<std::uint64_t>(kBatch, end - first));
            start(static_cast<std::uint32_t>(first), batch);
            for (std::size_t i = 0; i < batch.size(); ++i) {
                visit(static_cast<std::uint32_t>(first + i), batch[i]);
            }
        }
    }

  private:
    struct Choice {
        std::uint32_t light;
        std::uint32_t place;  // in the batch
        float probability;
        float scale;  // of its power: plain density over its own
        LeSampleU u;
    };
    std::optional<Choice> choose(const EmissionNet::Point& point) const;
    void sort_by_light();
    void emit_group(std::span<const Choice> group, std::span<std::optional<LightPathStart>> out);

    const Scene& scene_;
    EmissionNet net_;
    const LearnedEmission* learned_;  // null: plain
    std::vector<EmissionNet::Point> points_;
    std::vector<Choice> choices_, sorted_;
    std::vector<std::uint32_t> begins_;  // by light: where its choices go
    std::vector<LeSampleU> numbers_;
    std::vector<std::optional<LeSample>> emitted_;
    std::vector<std::optional<LightPathStart>> starts_;
};

}  // namespace lucerna
