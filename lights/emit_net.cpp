#include "lights/emit_net.h"

namespace lucerna {

EmitNet::EmitNet(std::uint64_t seed, Purpose purpose, std::uint32_t pass) {
    // A path's number has 32 bits: no path has this stream.
    Stream numbers(seed, purpose, pass, ~std::uint64_t{0});
    for (std::uint32_t& word : seeds_) word = numbers.bits();
    salt_ = numbers.bits();
}

}  // namespace lucerna
