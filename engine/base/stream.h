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

#include <array>
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

    float next() {  // [0, 1)
        if (draw_ >= known_) return next_unknown();
        const Scrambles& h = scrambles_[draw_++];
        return to_unit(reverse_bits(owen_scramble_reversed(shuffled(h[0]), h[1])));
    }
    V2f next2() {  // [0, 1)²
        if (draw_ >= known_) return next2_unknown();
        return point(scrambles_[draw_++]);
    }
    std::uint32_t bits();  // 32 independent bits (never stratified)

    // An independent stream for a branch of this path (a gather ray, a light loop), by its number.
    Stream split(std::uint32_t branch) const;
    // The same, for sample `index` of `branch`: the samples of one branch are stratified among each other.
    Stream split_stratified(std::uint32_t branch, std::uint32_t index) const;

  private:
    friend class StreamFamily;
    // What a family's draw is shuffled and scrambled by.
    using Scrambles = std::array<std::uint32_t, 4>;

    Stream() = default;
    std::uint32_t word(std::uint32_t draw, std::uint32_t lane) const;
    static Scrambles scrambles(std::uint64_t key, std::uint32_t draw);
    float next_unknown();
    V2f next2_unknown();
    std::uint32_t shuffled(std::uint32_t seed) const { return owen_scramble(index_, seed); }
    V2f point(const Scrambles& h) const {
        const std::uint32_t i = shuffled(h[0]);
        return {to_unit(reverse_bits(owen_scramble_reversed(i, h[1]))),
                to_unit(reverse_bits(owen_scramble_reversed(sobol_1_reversed(i), h[2])))};
    }

    std::uint64_t key_ = 0;
    std::uint64_t path_ = 0;
    std::uint32_t index_ = 0;
    std::uint32_t draw_ = 0;
    bool stratified_ = false;
    std::uint32_t known_ = 0;  // so many draws' scrambles stand in the family's table
    const Scrambles* scrambles_ = nullptr;
};

// The paths of one key of Stream::stratified, of which many follow each other: what their first draws have in
// common is worked out once. Numbers are the same as without.
class StreamFamily {
  public:
    StreamFamily(std::uint64_t seed, Purpose purpose, std::uint64_t family);

    // The family must outlive its streams and stay where it is.
    Stream path(std::uint32_t index) const {
        Stream stream = begin_;
        stream.index_ = index;
        stream.scrambles_ = scrambles_.data();
        stream.known_ = kDraws;
        return stream;
    }

  private:
    // More than nearly all paths make.
    static constexpr std::uint32_t kDraws = 64;
    Stream begin_;
    std::array<Stream::Scrambles, kDraws> scrambles_;
};

}  // namespace lucerna
