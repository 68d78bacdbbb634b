// Adaptive sampling: which pixels get the next samples.
//
// A pixel of n samples has a squared error e²/n. For a given total number of samples the sum over the image
// is least if n is proportional to e. For the measured image e is the standard deviation of one sample. For
// the denoised image it is the error that the filter leaves: it grows more slowly than the noise, which is
// shared among the neighbours, and is larger where pixels have few similar neighbours, at edges and in
// textures. An allocation therefore uses
//
//     e = (s²)^0.35 (g + 0.0001)^0.1
//
// with the relative variance s² of a sample, and the relative variance g of features and of light from pixel
// to pixel, of blocks of these; the powers are those of denoised errors (docs/explanation/denoising.md). It
// is taken anew whenever the number of samples has doubled.
//
// It keeps the image unbiased: the samples of one half are allocated by what those of the other saw. (Were a
// pixel's own samples to decide, one that has met no caustic yet would be left as it is, and the mean of such
// pixels too dark.) For the same reason each decision is taken from samples of a number that is fixed
// beforehand, whatever had been allocated; and the image is the plain mean of its halves, whichever of them
// has more samples. All of it depends on sums alone, at numbers of samples that do not depend on time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/render/film.h"

namespace lucerna {

class SampleAllocation {
  public:
    static constexpr int kBlock = 4;  // pixels a side

    // The film has two halves. Until decide() all pixels get the same number of samples.
    explicit SampleAllocation(const Film& film);

    int blocks() const { return across_ * down_; }
    int block_of(const V2i& at) const { return at.y / kBlock * across_ + at.x / kBlock; }

    // The samples of that half that a block's pixels have when the image has `end` per pixel: in the mean of
    // all of them, and of both halves. From the last decision's number of samples to twice that.
    int upto(int block, int half, int end) const;

    // Where upto() next stops to see: the first power of two after `count`, at least kFirstSeen.
    static int next_seen(int count);
    // Takes the features that the camera sees (render_features). Called before the first decision.
    void look_at(const Image& features);

    // The block's pixels have so many samples of that half, a next_seen(). Blocks may be told at once.
    void see(int block, int half, int count);

    // The image has `done` samples per pixel, all blocks have theirs. Decides on the next `done` where that
    // is a power of two and at least kFirst; else nothing changes. Called at every such number, in order.
    void decide(int done);
    // The number of samples after which there is a decision again: the least that is more than `done`.
    static int next_decision(int done);

    // All that upto() and later decisions go by, as bytes; and an allocation of the same film that had them.
    std::vector<std::byte> state() const;
    // False, and unchanged, if these are none of such a film.
    bool restore(std::span<const std::byte> state);

    // For the same allocation on other ranks: what all of them go by; what a block was seen with, by all that
    // later decisions may ask of it, or by the next one alone, at `done` samples per pixel.
    template <typename Archive>
    void fields(Archive& archive) {
        std::size_t levels = levels_.size();
        archive(decided_, shares_, levels);
        while (levels_.size() < levels) levels_.emplace_back(shares_.size());
    }
    template <typename Archive>
    void fields_of(int block, Archive& archive) {
        for (auto& level : levels_) archive(level[slot(block, 0)], level[slot(block, 1)]);
    }
    template <typename Archive>
    void fields_for_decision(int block, int done, Archive& archive) {
        auto& level = levels_[level_for_decision(done)];
        archive(level[slot(block, 0)], level[slot(block, 1)]);
    }
    static bool is_decision(int done) { return done >= kFirst && (done & (done - 1)) == 0; }

  private:
    static constexpr int kFirstSeen = 4;           // samples of a half
    static constexpr int kFirst = 2 * kFirstSeen;  // samples of a pixel
    // No block gets less than this share of the mean, so that it is looked at again; nor more than so many
    // times the mean, however it stands out.
    static constexpr int kLeastShare = 4, kMost = 16;

    // Estimates from a block's first samples of a half: the mean luminance, the mean variance of one sample,
    // and the variance from pixel to pixel without the noise, which may be below 0 by chance.
    struct Seen {
        float luminance = 0, variance = 0, structure = 0;
    };
    // Samples per pixel of a block and half: at the last decision, and how many more until the next.
    struct Share {
        std::int32_t there = 0, more = 0;
    };
    static_assert(sizeof(Seen) == 12 && sizeof(Share) == 8);  // numbers without gaps

    std::size_t slot(int block, int half) const {
        return 2 * static_cast<std::size_t>(block) + static_cast<std::size_t>(half);
    }
    static std::size_t level_for_decision(int done);
    int pixels(int block) const;
    template <typename Visit>
    void for_each_pixel(int block, Visit&& visit) const;
    template <typename Visit>
    void for_each_around(int block, Visit&& visit) const;
    std::vector<double> errors(int half, const std::vector<Seen>& level) const;
    void allocate(int half, int done, const std::vector<double>& errors);
    void make_levels(int most);

    const Film& film_;
    int across_, down_;
    int decided_ = 0;                        // samples per pixel at the last decision; 0: none yet
    std::vector<Share> shares_;              // by slot
    std::vector<float> structure_;           // of the features, by block
    std::vector<std::vector<Seen>> levels_;  // after kFirstSeen, twice, four times as many …: by slot
};

}  // namespace lucerna
