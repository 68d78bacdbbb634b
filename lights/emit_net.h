// The numbers of emission: light paths that start well distributed over lights, places and directions at
// once.
//
// Path i of a pass takes point i of a Sobol sequence in five dimensions under Owen's scrambling: four for the
// particle (for a measured lamp U, V, S, T of its cell), one for the choice of the light. Any 2^k consecutive
// paths from a multiple of 2^k on are stratified in every projection; each path on its own is uniform, so
// whatever is estimated from them stays unbiased. Passes are scrambled independently of each other.
#pragma once

#include <array>
#include <cstdint>

#include "engine/base/net.h"
#include "engine/base/stream.h"
#include "lights/light.h"

namespace lucerna {

class EmitNet {
  public:
    EmitNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass);

    struct Point {
        float light;  // chooses the light
        EmitU u;
    };
    Point at(std::uint32_t path) const {
        // The first dimensions are the best distributed: they go to the particle.
        const auto x = scrambled_sobol(path, seeds_);
        return {x[4],
                {{x[0], x[1]},
                 {x[2], x[3]},
                 owen_scramble_reversed(path, salt_)}};  // the salt: one for every path
    }

  private:
    std::array<std::uint32_t, kSobolDimensions> seeds_;
    std::uint32_t salt_;
};

}  // namespace lucerna
