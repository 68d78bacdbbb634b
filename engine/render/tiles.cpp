#include "engine/render/tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace lucerna {
namespace {

constexpr std::uint32_t kSmallLampsBranch = 0x51a;

}  // namespace

CameraSampler::Sample CameraSampler::sample(const V2i& at, std::optional<int> half, int index) const {
    if (!job_.receivers.empty()) return receiver_sample(at, index);
    // Random numbers depend on the place in the whole picture, so that a crop is the same picture, cut out.
    const V2i whole = at + job_.film.crop_begin;
    const ImageSamplers& samplers = halves_[static_cast<std::size_t>(half.value_or(0))];
    Sampler sampler = samplers.at(whole, static_cast<std::uint32_t>(index));
    const FilterSampler::Sample place = filter_.sample(sampler.next2());
    const V2f centre(static_cast<float>(whole.x) + 0.5F, static_cast<float>(whole.y) + 0.5F);
    const V2f lens = sampler.next2();
    const V2f film = centre + place.offset;
    return {job_.camera.ray(film, lens), film, half, place.weight, sampler, whole, {}, job_.camera_medium};
}

// Each pixel is stratified on its own: sensors of one point must not depend on each other, as pixels of a
// picture may.
CameraSampler::Sample CameraSampler::receiver_sample(const V2i& at, int index) const {
    const std::int64_t pixel = std::int64_t{at.y} * job_.film.width + at.x;
    Sampler sampler = Sampler::stratified(seed_, Purpose::receiver, static_cast<std::uint64_t>(pixel),
                                          static_cast<std::uint32_t>(index));
    const Receiver& receiver = job_.receivers.of(pixel);
    const Hit hit = receiver_hit(receiver, sampler.next2(), job_.scene);
    const Ray onto{hit.at.towards(hit.at.n), -hit.at.n};
    return {onto, {}, std::nullopt, 1, sampler, at, hit, receiver.medium};
}

Film::Sample CameraSampler::radiance(const Estimator& estimator, Sample sample,
                                     SampleAccount& account) const {
    EyePath path = EyePath::begin(job_.scene, sample.ray, quantity_of(job_.integrator),
                                  max_depth_of(job_.integrator), account);
    path.film = sample.film;
    path.half = sample.half;
    account.wants_blur = sample.half.has_value();
    if (sample.receiver) path.receiver = &*sample.receiver;
    if (sample.medium) path.medium = *sample.medium;
    if (const auto lamps = lamps_ ? lamps_->in_reach(sample.pixel) : SmallLamps::InReach()) {
        path.rule = EmissionRule::all_except(&lamps_->lamps());
        // It is independent of the sample's place in the pixel, and so of its weight, whose mean is 1.
        Sampler own = sample.sampler.split_alike(kSmallLampsBranch);
        lamps_->add(lamps, sample.pixel, own, path);
    }
    estimator.follow(path, sample.sampler);
    return {account.radiance(), sample.weight, luminance(account.blur)};
}

template <typename Visit>
void TileRenderer::for_each_pixel(int tile, Visit&& visit) const {
    const PixelBox pixels = box(tile);
    for (int y = pixels.begin.y; y < pixels.end.y; ++y) {
        for (int x = pixels.begin.x; x < pixels.end.x; ++x) visit(V2i(x, y));
    }
}

void TileRenderer::render(const Estimator& estimator, int tile, int first, int end) {
    if (allocation_ != nullptr) return render_allocated(estimator, tile, first, end);
    for_each_pixel(tile, [&](const V2i& at) { render_pixel(estimator, at, first, end); });
}

void TileRenderer::render_first(const Estimator& estimator, int tile, int end, int step) {
    for_each_pixel(tile, [&](const V2i& at) {
        if (Film::step_of(at) == step && !film_.has_sample(at.x, at.y)) render_pixel(estimator, at, 0, end);
    });
}

void TileRenderer::render_pixel(const Estimator& estimator, const V2i& at, int first, int end) {
    std::vector<Film::Sample> pass;
    std::vector<SampleAccount> pass_accounts;
    SampleAccount account(layers_ ? &groups_ : nullptr);
    for (int s = first; s < end; ++s) {
        account.clear();
        const Film::Sample taken =
            camera_sampler_.radiance(estimator, camera_sampler_.sample(at, s), account);
        if (!is_finite(taken.radiance)) {
            report_bad(at, s, taken.radiance);
        } else if (by_pass_) {
            pass.push_back(taken);
            if (layers_) pass_accounts.push_back(account);
        } else {
            const int half = camera_sampler_.half(s).value_or(0);
            film_.add(at.x, at.y, taken.radiance, taken.weight, half, taken.blur);
            if (layers_) layers_->add(at.x, at.y, account, taken.weight, half);
        }
    }
    if (!by_pass_) return;
    film_.add_pass(at.x, at.y, pass, camera_sampler_.half(first).value_or(0));
    if (!layers_) return;
    std::vector<float> weights;
    for (const Film::Sample& sample : pass) weights.push_back(sample.weight);
    layers_->add_pass(at.x, at.y, pass_accounts, weights, camera_sampler_.half(first).value_or(0));
}

// Renders block by block and half by half as many samples as each has been allocated.
void TileRenderer::render_allocated(const Estimator& estimator, int tile, int first, int end) {
    constexpr int kSide = SampleAllocation::kBlock;
    static_assert(kTile % kSide == 0);
    SampleAccount account(layers_ ? &groups_ : nullptr);
    for_each_pixel(tile, [&](const V2i& corner) {
        if (corner.x % kSide != 0 || corner.y % kSide != 0) return;
        const int block = allocation_->block_of(corner);
        for (const int half : {0, 1}) {
            const int last = allocation_->upto(block, half, end);
            for (int from = allocation_->upto(block, half, first); from < last;) {
                const int seen = SampleAllocation::next_seen(from), to = std::min(seen, last);
                for (int y = corner.y; y < std::min(corner.y + kSide, film_.height()); ++y) {
                    for (int x = corner.x; x < std::min(corner.x + kSide, film_.width()); ++x) {
                        for (int s = from; s < to; ++s) add_sample(estimator, {x, y}, half, s, account);
                    }
                }
                if (to == seen) allocation_->see(block, half, seen);
                from = to;
            }
        }
    });
}

// The caller reuses `account` from sample to sample.
void TileRenderer::add_sample(const Estimator& estimator, const V2i& at, int half, int index,
                              SampleAccount& account) {
    account.clear();
    const Film::Sample taken =
        camera_sampler_.radiance(estimator, camera_sampler_.sample(at, half, index), account);
    if (is_finite(taken.radiance)) {
        film_.add(at.x, at.y, taken.radiance, taken.weight, half, taken.blur);
        if (layers_) layers_->add(at.x, at.y, account, taken.weight, half);
    } else {
        report_bad(at, 2 * index + half, taken.radiance);  // its number if all pixels got the same samples
    }
}

// Leaves a sample that is not a number out of the image, and names it.
void TileRenderer::report_bad(const V2i& at, int sample, const Rgb& value) {
    const std::lock_guard lock(mutex_);
    const std::array<int, 3> here{sample, at.y, at.x};
    if (bad_.count++ == 0 || here < bad_.at) {
        bad_.at = here;
        bad_.first = fmt::format("pixel ({}, {}) sample {} seed {}: {} {} {}", at.x, at.y, sample, seed_,
                                 value.x, value.y, value.z);
    }
}

}  // namespace lucerna
