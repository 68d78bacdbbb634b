// Random numbers are a pure function of a key and the draw number (no state but the counter).
//
// A sampler belongs to one path: (seed, purpose, pass, path). Two draws never share bits, whatever the order
// and the thread in which they are made, so that an image does not depend on the number of threads.
//
// `Sampler` draws independent numbers (Philox [Salmon 2011]). `Sampler::stratified` draws, for the paths 0,
// 1, 2 … of one key, numbers that are well distributed together: every 2D draw is a point of an
// Owen-scrambled (0,2)-sequence whose index is shuffled anew for each draw ("padding"), so that any 2^k
// consecutive paths from a multiple of 2^k on are a net. `ImageSamplers` does this for the samples of an
// image's pixels, which are a net together with those of neighbouring pixels (pixel_net.h).
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/net.h"
#include "engine/base/pixel_net.h"
#include "engine/base/vec.h"

namespace lucerna {

// Names the use of random numbers, which keeps numbers of the same pass and path apart.
enum class Purpose : std::uint32_t {
    camera,
    emission,
    vpl,
    gather,
    acquisition,
    bench,
    test,
    tile,
    importance,
    splitting,
    camera_of_second_half,
    receiver,
    bootstrap
};

class Sampler {
  public:
    Sampler(std::uint64_t seed, Purpose purpose, std::uint32_t pass, std::uint64_t path);

    // Returns the sampler of path `index` among the paths (e.g. a pixel's samples) that share `family`.
    static Sampler stratified(std::uint64_t seed, Purpose purpose, std::uint64_t family, std::uint32_t index);

    float next() {  // [0, 1)
        if (draw_ >= known_) return next_unknown();
        return number(scrambles_[draw_++]);
    }
    V2f next2() {  // [0, 1)²
        if (draw_ >= known_) return next2_unknown();
        return point(scrambles_[draw_++]);
    }
    // Draws next(), next2() and next() of a bounce, computed together.
    struct Bounce {
        float first;
        V2f second;
        float third;
    };
    Bounce next_of_bounce() {
        if (draw_ + 3 > known_ || in_image_) {
            const float first = next();
            const V2f second = next2();
            return {first, second, next()};
        }
        const Scrambles& a = scrambles_[draw_];
        const Scrambles& b = scrambles_[draw_ + 1];
        const Scrambles& c = scrambles_[draw_ + 2];
        draw_ += 3;
        const std::uint32_t r = reversed_index_;
        Words4 i =
            reverse_bits_each(owen_scramble_reversed(Words4{r, r, r, r}, Words4{a[0], b[0], b[0], c[0]}));
        i[2] = sobol_1_reversed(i[2]);
        const Floats4 u =
            to_unit_each(reverse_bits_each(owen_scramble_reversed(i, Words4{a[1], b[1], b[2], c[1]})));
        return {u[0], {u[1], u[2]}, u[3]};
    }
    std::uint32_t bits();  // 32 independent bits (never stratified)

    // Returns an independent sampler for a branch of this path (a gather ray, a light loop), by its number.
    Sampler split(std::uint32_t branch) const;
    // Does this too, but if this sampler is stratified, so is the branch: among the paths of the family that
    // branch off after as many draws.
    Sampler split_alike(std::uint32_t branch) const;
    // Returns the sampler for one of `count` > 0 samples of that branch. All of them are stratified among
    // each other: those of one path, those of all paths of the family, and in an image those of neighbouring
    // pixels.
    Sampler split_alike(std::uint32_t branch, std::uint32_t index, std::uint32_t count) const;
    // Returns an independent sampler for sample `index` of `branch`, stratified among the samples of the
    // branch.
    Sampler split_stratified(std::uint32_t branch, std::uint32_t index) const;

  private:
    friend class SamplerFamily;
    friend class ImageSamplers;
    // Holds the seeds of a family's draw, which shuffle the index, scramble both dimensions, and shuffle the
    // pixel.
    using Scrambles = std::array<std::uint32_t, 4>;

    Sampler() = default;
    void take_index(std::uint32_t index) {
        index_ = index;
        reversed_index_ = reverse_bits(index);
    }
    std::uint64_t path() const { return stratified_ ? std::uint64_t{pixel_} << 32 | index_ : path_; }
    // Returns the sampler of this path in one pixel of an image, given by its Morton number.
    Sampler in_pixel(std::uint32_t pixel) const {
        Sampler sampler = *this;
        sampler.pixel_ = pixel;
        sampler.net_pixel_ = NetPixel(pixel);
        sampler.in_image_ = true;
        return sampler;
    }
    std::uint32_t word(std::uint32_t draw, std::uint32_t lane) const;
    static Scrambles scrambles(std::uint64_t key, std::uint32_t draw);
    float next_unknown();
    V2f next2_unknown();
    NetPixel::Offsets offsets(const Scrambles& h) const {
        return in_image_ ? net_pixel_.offsets(h[3]) : NetPixel::Offsets{0, 0};
    }
    std::uint32_t shuffled(std::uint32_t seed) const {
        return reverse_bits(owen_scramble_reversed(reversed_index_, seed));
    }
    float number(const Scrambles& h) const {
        const std::uint32_t i = shuffled(h[0]) ^ offsets(h).x;
        return to_unit(reverse_bits(owen_scramble_reversed(i, h[1])));
    }
    V2f point(const Scrambles& h) const {
        const std::uint32_t i = shuffled(h[0]);
        const NetPixel::Offsets add = offsets(h);
        return {to_unit(reverse_bits(owen_scramble_reversed(i ^ add.x, h[1]))),
                to_unit(reverse_bits(owen_scramble_reversed(sobol_1_reversed(i) ^ add.y, h[2])))};
    }

    std::uint64_t key_ = 0;
    std::uint64_t path_ = 0;
    std::uint32_t index_ = 0, reversed_index_ = 0;  // of a stratified path
    std::uint32_t draw_ = 0;
    std::uint32_t pixel_ = 0;  // Morton number
    bool stratified_ = false;
    bool in_image_ = false;
    NetPixel net_pixel_;       // set in an image
    std::uint32_t known_ = 0;  // number of draws whose scrambles are in the family's table
    const Scrambles* scrambles_ = nullptr;
};

// Represents the paths of one key of Sampler::stratified. It computes the data that their first draws share
// once; the numbers are the same as without it.
class SamplerFamily {
  public:
    SamplerFamily(std::uint64_t seed, Purpose purpose, std::uint64_t family);

    // Returns path `index`. The family must outlive its samplers and keep its address.
    Sampler path(std::uint32_t index) const {
        Sampler sampler = begin_;
        sampler.take_index(index);
        sampler.scrambles_ = scrambles_.data();
        sampler.known_ = kDraws;
        return sampler;
    }
    // Returns path `index` of one pixel of an image.
    Sampler path(std::uint32_t index, std::uint32_t pixel) const { return path(index).in_pixel(pixel); }

  private:
    // Almost all paths make fewer draws than this.
    static constexpr std::uint32_t kDraws = 64;
    Sampler begin_;
    std::array<Sampler::Scrambles, kDraws> scrambles_;
};

// Represents the samples of an image's pixels, which form one family.
class ImageSamplers {
  public:
    ImageSamplers(std::uint64_t seed, Purpose purpose)
        : seed_(seed), purpose_(purpose), family_(seed, purpose, 0) {}

    // Returns the sampler of sample `index` of a pixel, x and y >= 0. This object must outlive it and stay in
    // place.
    Sampler at(const V2i& pixel, std::uint32_t index) const;

  private:
    std::uint64_t seed_;
    Purpose purpose_;
    SamplerFamily family_;
};

}  // namespace lucerna
