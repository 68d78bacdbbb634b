// Random numbers of emission, which stratify light paths over lights, places and directions at once.
//
// Path i of a pass takes point i of an Owen-scrambled Sobol sequence in five dimensions: four for the
// particle (U, V, S, T of the cell for a measured lamp) and one for the choice of the light. Any 2^k
// consecutive paths that start at a multiple of 2^k are stratified in every projection. Each single path is
// uniform, so estimates stay unbiased. Passes are scrambled independently of each other.
//
// Few paths, as in a set of VPLs, need good pairs of dimensions more than a good joint distribution, but only
// two of the five dimensions form a (0,2)-sequence. `pairs` therefore uses one (0,2)-sequence each for place
// and direction and a (0,1)-sequence for the light, shuffled against each other [Wald 2002; Pharr 2004].
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
        // The first dimensions are the best distributed, so the particle gets them.
        return joint(path, sobol::words_of(path));
    }
    // Computes the points of the paths first, first + 1 …
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
                 owen_scramble_reversed(path, salt_)}};  // the salt, one for each path
    }
    Point pairs_at(std::uint32_t path) const;
    // Returns a point of a (0,2)-sequence whose index is shuffled such that blocks of 2^k stay blocks.
    static V2f pair(std::uint32_t path, const std::array<std::uint32_t, 3>& h) {
        const std::uint32_t i = owen_scramble(path, h[0]);
        return {to_unit(reverse_bits(owen_scramble_reversed(i, h[1]))),
                to_unit(reverse_bits(owen_scramble_reversed(sobol_1_reversed(i), h[2])))};
    }

    Kind kind_;
    sobol::Words seeds_{};  // one per Sobol dimension
    std::uint32_t salt_;
    std::array<std::array<std::uint32_t, 3>, 3> pairs_{};  // shuffle and scrambles of place, direction, light
};

inline EmissionNet::EmissionNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass, Kind kind)
    : kind_(kind) {
    // A path's number has 32 bits, so no path uses this sampler.
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
