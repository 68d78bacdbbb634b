// Random numbers as a pure function of a key and the draw number (no state but the counter).
//
// A stream belongs to one path: (seed, purpose, pass, path). Two draws never share bits, whoever asks first
// and on whatever thread, and so an image does not depend on the number of threads.
//
// `Stream` draws independent numbers (Philox, Salmon et al. 2011). `Stream::stratified` draws, for the paths
// 0, 1, 2 … of one key, numbers that are well distributed together: every 2D draw is a point of an
// Owen-scrambled (0,2)-sequence whose index is shuffled anew for each draw ("padding"), so any 2^k
// consecutive paths are a net.
#pragma once

#include <cstdint>

#include "engine/base/net.h"
#include "engine/base/vec.h"

namespace lucerna {

// What random numbers are for. A purpose of its own keeps two uses of the same pass and path apart.
enum class Purpose : std::uint32_t {
    camera,
    emission,
    virtual_light,
    gather,
    acquisition,
    bench,
    test,
    tile,
    importance
};

class Stream {
  public:
    Stream(std::uint64_t seed, Purpose purpose, std::uint32_t pass, std::uint64_t path);

    // Path `index` of a family of paths (a pixel's samples, a map's photons) that share `family`.
    static Stream stratified(std::uint64_t seed, Purpose purpose, std::uint64_t family, std::uint32_t index);

    float next();          // [0, 1)
    V2f next2();           // [0, 1)²
    std::uint32_t bits();  // 32 independent bits (never stratified)

    // An independent stream for a branch of this path (a gather ray, a light loop), by its number.
    Stream split(std::uint32_t branch) const;
    // The same, for sample `index` of `branch`: the samples of one branch are stratified among each other.
    Stream split_stratified(std::uint32_t branch, std::uint32_t index) const;

  private:
    Stream() = default;
    std::uint32_t word(std::uint32_t draw, std::uint32_t lane) const;

    std::uint64_t key_ = 0;
    std::uint64_t path_ = 0;
    std::uint32_t index_ = 0;
    std::uint32_t draw_ = 0;
    bool stratified_ = false;
};

}  // namespace lucerna
