// The numbers of emission: light paths that start well distributed over lights, places and directions at
// once.
//
// Path i of a pass takes point i of a Sobol sequence in five dimensions under Owen's scrambling: four for the
// particle (for a measured lamp U, V, S, T of its cell), one for the choice of the light. Any 2^k consecutive
// paths from a multiple of 2^k on are stratified in every projection; each path on its own is uniform, so
// whatever is estimated from them stays unbiased. Passes are scrambled independently of each other.
//
// That is for many paths. Of few, as in a set of VPLs, the pairs matter more than what lies between
// them: two of the five dimensions make a (0,2)-sequence, but no others do. `pairs` takes one each for place
// and direction, and a (0,1)-sequence for the light, shuffled against each other [Wald 2002; Pharr 2004].
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/base/net.h"
#include "engine/base/sampler.h"
#include "lights/light.h"

namespace lucerna {

class EmissionNet {
  public:
    enum class Kind : std::uint8_t { joint, pairs };

    EmissionNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass, Kind kind = Kind::joint);

    struct Point {
        float light;  // chooses the light
        LeSampleU u;
    };
    Point at(std::uint32_t path) const {
        if (kind_ == Kind::pairs) return pairs_at(path);
        // The first dimensions are the best distributed: they go to the particle.
        return joint(path, sobol::words_of(path));
    }
    // Those of the paths first, first + 1 …
    void points(std::uint32_t first, std::span<Point> out) const {
        if (kind_ == Kind::pairs) {
            for (std::size_t i = 0; i < out.size(); ++i)
                out[i] = pairs_at(first + static_cast<std::uint32_t>(i));
            return;
        }
        sobol::Words words = sobol::words_of(first);
        for (std::size_t i = 0; i < out.size(); ++i) {
            const std::uint32_t path = first + static_cast<std::uint32_t>(i);
            if (i > 0) sobol::step_to(path, words);
            out[i] = joint(path, words);
        }
    }

  private:
    Point joint(std::uint32_t path, const sobol::Words& words) const {
        const auto x = sobol::scrambled(words, seeds_);
        return {x[4],
                {{x[0], x[1]},
                 {x[2], x[3]},
                 owen_scramble_reversed(path, salt_)}};  // the salt: one for every path
    }
    Point pairs_at(std::uint32_t path) const;
    // Point of a (0,2)-sequence whose index is shuffled: blocks of 2^k stay blocks.
    static V2f pair(std::uint32_t path, const std::array<std::uint32_t, 3>& h) {
        const std::uint32_t i = owen_scramble(path, h[0]);
        return {to_unit(reverse_bits(owen_scramble_reversed(i, h[1]))),
                to_unit(reverse_bits(owen_scramble_reversed(sobol_1_reversed(i), h[2])))};
    }

    Kind kind_;
    sobol::Words seeds_{};  // of the dimensions that there are
    std::uint32_t salt_;
    std::array<std::array<std::uint32_t, 3>, 3> pairs_{};  // shuffle and scrambles: place, direction, light
};

inline EmissionNet::EmissionNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass, Kind kind)
    : kind_(kind) {
    // A path's number has 32 bits: no path has this sampler.
    Sampler numbers(seed, purpose, pass, ~std::uint64_t{0});
    for (std::size_t d = 0; d < kSobolDimensions; ++d) seeds_[d] = numbers.bits();
    salt_ = numbers.bits();
    for (auto& pair : pairs_) {
        for (std::uint32_t& word : pair) word = numbers.bits();
    }
}

inline EmissionNet::Point EmissionNet::pairs_at(std::uint32_t path) const {
    return {pair(path, pairs_[2]).x,
            {pair(path, pairs_[0]), pair(path, pairs_[1]), owen_scramble_reversed(path, salt_)}};
}

}  // namespace lucerna
