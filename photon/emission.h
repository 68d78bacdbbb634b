// Emits photons [Jensen 2001, 5.1]: chooses a light in proportion to its power, then samples a particle of
// it. Learned emission (learned_emission.h) may guide both choices; the power of the start is then weighted
// so that all means are preserved.
//
// Light paths start in batches: their random numbers come from one scrambled Sobol sequence, and each light
// is called once for all its particles of a batch, so that reads of a measured lamp's tables overlap. The
// start of a path does not depend on the batch in which it is requested.
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
    Rgb power;                        // W, not yet divided by the number of paths; its expected value is
                                      // the flux of all lights
    std::int32_t medium = kNoMedium;  // in which the path begins, by the scene's medium interfaces
};

// Starts the paths of one pass. Used by one thread, as it keeps its working memory.
class Emission {
  public:
    // Size of a batch that stays within the L2 cache.
    static constexpr std::size_t kBatch = 512;

    // Emits by power if `learned` is null; otherwise `learned` must outlive this.
    Emission(const Scene& scene, std::uint64_t seed, Purpose purpose, std::uint32_t pass,
             const LearnedEmission* learned = nullptr)
        : scene_(scene), net_(seed, purpose, pass, net_kind(purpose)), learned_(learned) {}

    // Starts paths first, first + 1 …, one for each element of `out`. An element stays empty if no light has
    // power or the light has no sample for its numbers.
    void start(std::uint32_t first, std::span<std::optional<LightPathStart>> out);

    // Chooses a net by the number of paths: a set of VPLs starts from few paths, a map from many.
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
        float scale;  // of its power: plain density over learned density
        LeSampleU u;
    };
    std::optional<Choice> choose(const EmissionNet::Point& point) const;
    void sort_by_light();
    void emit_group(std::span<const Choice> group, std::span<std::optional<LightPathStart>> out);

    const Scene& scene_;
    EmissionNet net_;
    const LearnedEmission* learned_;  // null: emission by power
    std::vector<EmissionNet::Point> points_;
    std::vector<Choice> choices_, sorted_;
    std::vector<std::uint32_t> begins_;  // by light: next index of its choices in sorted_
    std::vector<LeSampleU> numbers_;
    std::vector<std::optional<LeSample>> emitted_;
    std::vector<std::optional<LightPathStart>> starts_;
};

}  // namespace lucerna
