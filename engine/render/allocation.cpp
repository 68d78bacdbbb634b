#include "engine/render/allocation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "engine/base/elementary.h"
#include "engine/base/stats.h"
#include "engine/denoise/denoise.h"

namespace lucerna {
namespace {

// The exponents of a denoised error were fitted by least squares on its logarithm
// (docs/explanation/denoising.md).
constexpr double kPowerOfNoise = 0.35, kPowerOfStructure = 0.1, kLeastStructure = 1e-4;

int level_of(int count, int first) {
    return std::bit_width(static_cast<unsigned>(count / first)) - 1;
}

}  // namespace

SampleAllocation::SampleAllocation(const Film& film)
    : film_(film),
      across_((film.width() + kBlock - 1) / kBlock),
      down_((film.height() + kBlock - 1) / kBlock),
      shares_(2 * static_cast<std::size_t>(blocks())) {
    make_levels(kFirstSeen);
}

void SampleAllocation::make_levels(int most) {
    const int levels = level_of(most, kFirstSeen) + 1;
    while (levels_.size() < static_cast<std::size_t>(levels)) levels_.emplace_back(shares_.size());
}

int SampleAllocation::upto(int block, int half, int end) const {
    if (decided_ == 0) return (end + 1 - half) / 2;
    const Share& share = shares_[slot(block, half)];
    return share.there + static_cast<int>(std::int64_t{share.more} * (end - decided_) / decided_);
}

int SampleAllocation::next_seen(int count) {
    return std::max(kFirstSeen, static_cast<int>(std::bit_floor(static_cast<unsigned>(count)) * 2));
}

int SampleAllocation::next_decision(int done) {
    return std::max(kFirst, static_cast<int>(std::bit_floor(static_cast<unsigned>(done)) * 2));
}

template <typename Visit>
void SampleAllocation::for_each_pixel(int block, Visit&& visit) const {
    const V2i begin(block % across_ * kBlock, block / across_ * kBlock);
    const V2i end(std::min(begin.x + kBlock, film_.width()), std::min(begin.y + kBlock, film_.height()));
    for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) visit(x, y);
    }
}

// Visits the block and its neighbours.
template <typename Visit>
void SampleAllocation::for_each_around(int block, Visit&& visit) const {
    const int x = block % across_, y = block / across_;
    for (int v = std::max(0, y - 1); v < std::min(down_, y + 2); ++v) {
        for (int u = std::max(0, x - 1); u < std::min(across_, x + 2); ++u) visit(v * across_ + u);
    }
}

int SampleAllocation::pixels(int block) const {
    const int x = block % across_ * kBlock, y = block / across_ * kBlock;
    return std::min(kBlock, film_.width() - x) * std::min(kBlock, film_.height() - y);
}

void SampleAllocation::look_at(const Image& features) {
    constexpr double kOfNormals = 0.3;  // less weight, as a curved surface is not all edges
    structure_.resize(static_cast<std::size_t>(blocks()));
    for (int b = 0; b < blocks(); ++b) {
        RunningStats albedo, depth;
        std::array<RunningStats, 3> normal;
        for_each_pixel(b, [&](int x, int y) {
            const float* const f = &features.data[features.index(x, y)];
            albedo.add(double{luminance(Rgb(f[kAlbedo], f[kAlbedo + 1], f[kAlbedo + 2]))} + 0.01);
            for (std::size_t i = 0; i < 3; ++i) normal[i].add(double{f[kNormal + i]});
            depth.add(double{f[kDepth]});
        });
        const auto relative = [](const RunningStats& of) {
            const double square = sqr(of.mean());
            return square > 0 ? std::min(1.0, of.variance() / square) : 0;  // the mean albedo is > 0
        };
        const double normals = normal[0].variance() + normal[1].variance() + normal[2].variance();
        structure_[static_cast<std::size_t>(b)] =
            static_cast<float>(relative(albedo) + kOfNormals * normals + relative(depth));
    }
}

void SampleAllocation::see(int block, int half, int count) {
    const int n = pixels(block);
    double sum = 0, squares = 0, variance = 0, most = 0;
    for_each_pixel(block, [&](int x, int y) {
        const Film::OfHalf seen = film_.of_half(x, y, half);
        sum += seen.luminance;
        squares += sqr(seen.luminance);
        variance += seen.variance;
        most = std::max(most, seen.variance);
    });
    const double across = n > 1 ? (squares - sqr(sum) / n) / (n - 1) : 0;
    const double structure = across - variance / n / count;
    // The pixel with the largest variance is left out, because a firefly tells nothing about the others.
    if (n > 1) variance = (variance - most) / (n - 1);
    levels_[static_cast<std::size_t>(level_of(count, kFirstSeen))][slot(block, half)] = {
        static_cast<float>(sum / n), static_cast<float>(std::max(0.0, variance)),
        static_cast<float>(structure)};
}

// Estimates the error of each block from what its neighbourhood saw in `half`, since few samples estimate a
// variance badly.
std::vector<double> SampleAllocation::errors(int half, const std::vector<Seen>& level) const {
    double mean = 0, all = 0;
    for (int b = 0; b < blocks(); ++b) {
        mean += double{level[slot(b, half)].luminance} * pixels(b);
        all += pixels(b);
    }
    mean /= all;
    std::vector<double> errors(static_cast<std::size_t>(blocks()));
    for (int b = 0; b < blocks(); ++b) {
        double luminance = 0, variance = 0, structure = 0, of_features = 0, count = 0;
        for_each_around(b, [&](int beside) {
            const Seen& seen = level[slot(beside, half)];
            luminance += double{seen.luminance};
            variance += double{seen.variance};
            structure += double{seen.structure};
            of_features += double{structure_[static_cast<std::size_t>(beside)]};
            ++count;
        });
        const double scale = count * error_scale2(luminance / count, mean);
        // In a black image the scale is 0, and nothing varies.
        if (!(scale > 0)) continue;
        const double across = std::max(0.0, structure) / scale + of_features / count;
        errors[static_cast<std::size_t>(b)] =
            pow(variance / scale, kPowerOfNoise) * pow(across + kLeastStructure, kPowerOfStructure);
    }
    return errors;
}

// Distributes this half's share of the next `done` samples per pixel in proportion to the errors, within the
// bounds and given the samples taken so far.
void SampleAllocation::allocate(int half, int done, const std::vector<double>& errors) {
    const double least = 2.0 * done / 2 / kLeastShare, most = 2.0 * done / 2 * kMost;
    constexpr double kNone = 1e-6;  // share of the largest error given to blocks without variance
    double budget = 0, there = 0, largest = 0;
    for (int b = 0; b < blocks(); ++b) {
        budget += pixels(b) * (done / 2.0);
        there += static_cast<double>(pixels(b)) * shares_[slot(b, half)].there;
        largest = std::max(largest, errors[static_cast<std::size_t>(b)]);
    }
    const auto wanted = [&](int b, double scale) {
        const double now = shares_[slot(b, half)].there;
        const double own = std::max(errors[static_cast<std::size_t>(b)], kNone * largest);
        return std::max(now, std::clamp(scale * own, least, most));
    };
    const auto sum = [&](double scale) {
        double total = 0;
        for (int b = 0; b < blocks(); ++b) total += pixels(b) * wanted(b, scale);
        return total;
    };
    if (!(largest > 0) || !std::isfinite(largest)) {
        for (int b = 0; b < blocks(); ++b) shares_[slot(b, half)].more = done / 2;
        return;
    }
    // Finds by bisection the scale at which the sum reaches there + budget. It exists, since for large scales
    // all blocks have the most.
    double below = 0, above = most / largest;
    while (sum(above) < there + budget) above *= 2;
    for (int step = 0; step < 60; ++step) {
        const double middle = (below + above) / 2;
        (sum(middle) < there + budget ? below : above) = middle;
    }
    // Rounds to whole numbers of samples, and passes the remainder to the next block.
    double left = 0;
    for (int b = 0; b < blocks(); ++b) {
        const double more = wanted(b, below) - shares_[slot(b, half)].there + left / pixels(b);
        const double whole = std::max(0.0, std::floor(more));
        left = (more - whole) * pixels(b);
        shares_[slot(b, half)].more = static_cast<std::int32_t>(whole);
    }
}

// Returns the level with which all blocks have been seen at that decision, which kLeastShare guarantees.
std::size_t SampleAllocation::level_for_decision(int done) {
    const int seen = std::max(kFirstSeen, done / 2 / kLeastShare);
    return static_cast<std::size_t>(level_of(seen, kFirstSeen));
}

void SampleAllocation::decide(int done) {
    if (!is_decision(done)) return;
    for (int b = 0; b < blocks(); ++b) {
        for (const int half : {0, 1}) shares_[slot(b, half)] = {upto(b, half, done), 0};
    }
    decided_ = done;
    const auto& level = levels_[level_for_decision(done)];
    int most = 0;
    for (const int half : {0, 1}) {
        allocate(half, done, errors(1 - half, level));
        for (int b = 0; b < blocks(); ++b) most = std::max(most, upto(b, half, 2 * done));
    }
    make_levels(std::max(most, kFirstSeen));
}

std::vector<std::byte> SampleAllocation::state() const {
    std::vector<std::byte> state;
    const auto put = [&state](std::span<const std::byte> bytes) {
        state.insert(state.end(), bytes.begin(), bytes.end());
    };
    put(std::as_bytes(std::span(&decided_, 1)));
    put(std::as_bytes(std::span(shares_)));
    for (const auto& level : levels_) put(std::as_bytes(std::span(level)));
    return state;
}

bool SampleAllocation::restore(std::span<const std::byte> state) {
    constexpr std::size_t kMostLevels = 32;
    const std::size_t per_level = shares_.size() * sizeof(Seen);
    const std::size_t head = sizeof decided_ + shares_.size() * sizeof(Share);
    if (state.size() < head || (state.size() - head) % per_level != 0) return false;
    const std::size_t levels = (state.size() - head) / per_level;
    if (levels == 0 || levels > kMostLevels) return false;
    std::memcpy(&decided_, state.data(), sizeof decided_);
    std::memcpy(shares_.data(), state.data() + sizeof decided_, shares_.size() * sizeof(Share));
    levels_.assign(levels, std::vector<Seen>(shares_.size()));
    for (std::size_t i = 0; i < levels; ++i)
        std::memcpy(levels_[i].data(), state.data() + head + i * per_level, per_level);
    return true;
}

}  // namespace lucerna
