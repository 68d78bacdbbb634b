#include "lights/emit_net.h"

namespace lucerna {

EmitNet::EmitNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass, Kind kind) : kind_(kind) {
    // A path's number has 32 bits: no path has this sampler.
    Sampler numbers(seed, purpose, pass, ~std::uint64_t{0});
    for (std::uint32_t& word : seeds_) word = numbers.bits();
    salt_ = numbers.bits();
    for (auto& pair : pairs_) {
        for (std::uint32_t& word : pair) word = numbers.bits();
    }
}

EmitNet::Point EmitNet::pairs_at(std::uint32_t path) const {
    return {pair(path, pairs_[2]).x,
            {pair(path, pairs_[0]), pair(path, pairs_[1]), owen_scramble_reversed(path, salt_)}};
}

}  // namespace lucerna
