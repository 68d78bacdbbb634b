// Adaptive sampling: decides which pixels get the next samples.
//
// A pixel of n samples has a squared error e²/n. For a given total number of samples the sum over the image
// is least if n is proportional to e. For the measured image e is the standard deviation of one sample. For
// the denoised image it is the error that the filter leaves: it grows more slowly than the noise, which is
// shared among the neighbours, and is larger where pixels have few similar neighbours, at edges and in
// textures. An allocation therefore uses
//
//     e = (s²)^0.35 (g + 0.0001)^0.1
//
// with the relative variance s² of a sample and the relative variance g of features and light between the
// pixels of a block; the powers are those of denoised errors (docs/explanation/denoising.md). A new decision
// is made whenever the number of samples has doubled.
//
// The image stays unbiased, because the samples of one half are allocated by those of the other. (If a
// pixel's own samples decided, a pixel that has met no caustic yet would get no more samples, and the mean of
// such pixels would be too dark.) For the same reason each decision uses a number of samples that is fixed
// beforehand, whatever had been allocated; and the image is the plain mean of its halves, whichever of them
// has more samples. Decisions depend on sums alone, at numbers of samples that do not depend on time.
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

    // Returns the number of samples of that half that a block's pixels have when the image has `end` per
    // pixel, on average over all pixels and both halves. `end` lies between the number of samples at the last
    // decision and twice that.
    int upto(int block, int half, int end) const;

    // Returns the next number of samples at which see() is due: the first power of two after `count`, at
    // least kFirstSeen.
    static int next_seen(int count);
    // Takes the features that the camera sees (render_features). Called before the first decision.
    void look_at(const Image& features);

    // Evaluates a block whose pixels have `count` samples of that half, where `count` is a next_seen().
    // Different blocks may be evaluated by different threads.
    void see(int block, int half, int count);

    // Decides on the next `done` samples per pixel, once all blocks have theirs, if `done` is a power of two
    // and at least kFirst; otherwise changes nothing. Must be called at every such number, in order.
    void decide(int done);
    // Returns the number of samples at the next decision, the least greater than `done`.
    static int next_decision(int done);

    // Returns the state on which upto() and later decisions depend, as bytes.
    std::vector<std::byte> state() const;
    // Restores the state of an allocation of the same film. Returns false and changes nothing if the bytes do
    // not fit.
    bool restore(std::span<const std::byte> state);

    // State for the same allocation on other ranks: that common to all blocks; that of a block for all later
    // decisions; and that of a block for the decision at `done` samples per pixel alone.
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
    // A block gets at least 1/kLeastShare of the mean, so that it is evaluated again, and at most kMost times
    // the mean, however large its error.
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
