#include "engine/render/image_in_progress.h"

#include <atomic>
#include <bit>
#include <cassert>
#include <numeric>

#include "engine/render/finishing.h"

namespace lucerna {
namespace {

bool is_adaptive(const Job& job, const Integrator& integrator) {
    return job.film.two_halves && job.film.adaptive && integrator.samples_per_pass() == 0;
}

Film::Kind kind_of(const Job& job, const Integrator& integrator) {
    return {FilterSampler(job.film.filter).weight(), integrator.samples_per_pass() > 1, job.film.two_halves,
            is_adaptive(job, integrator), job.film.two_halves};
}

// Returns a step width that visits all items, since it has no divisor in common with their number, and soon
// visits all regions, since it is near the golden section of that number.
std::int64_t spreading_stride(std::int64_t items) {
    auto stride = static_cast<std::int64_t>(0.618 * static_cast<double>(items)) + 1;
    while (std::gcd(stride, items) > 1) ++stride;
    return stride;
}

// Deals tiles so that every rank has some in each row and in each column, because neighbours cost alike.
OwnedItems deal_tiles(const Workers& workers, const TileRenderer& tiles) {
    std::vector<std::int64_t> cards;
    const std::int64_t shift = workers.ranks ? spreading_stride(workers.ranks->all_threads()) : 1;
    for (int tile = 0; tile < tiles.tiles(); ++tile) {
        const V2i at = tiles.place(tile);
        cards.push_back(at.x + at.y * shift);
    }
    return OwnedItems(workers, cards);
}

}  // namespace

ImageInProgress::ImageInProgress(const Job& job, std::uint64_t seed, const Workers& workers,
                                 const Integrator& integrator)
    : job_(job),
      seed_(seed),
      workers_(workers),
      samples_per_pass_(integrator.samples_per_pass()),
      film_(job.film.rendered_size().x, job.film.rendered_size().y, kind_of(job, integrator)),
      layer_films_(make_layer_films(integrator)),
      tiles_(job, seed, film_, samples_per_pass_, layer_films_ ? &*layer_films_ : nullptr,
             lucerna::is_adaptive(job, integrator) ? &allocation_.emplace(film_) : nullptr),
      states_(static_cast<std::size_t>(tiles_.tiles())),
      owned_(deal_tiles(workers, tiles_)) {}

std::optional<LayerFilms> ImageInProgress::make_layer_films(const Integrator& integrator) const {
    const LayerFilms::Wanted wanted{job_.film.parts, job_.film.chance};
    if (!wanted.any()) return std::nullopt;
    const std::string why = integrator.why_no_light_groups();
    if (wanted.parts && !job_.scene.light_groups().empty() && !why.empty())
        throw InputError("the scene has light groups, and " + why);
    Film::Kind kind = kind_of(job_, integrator);
    kind.tells_blur = false;
    return LayerFilms(film_.width(), film_.height(), kind, job_.scene.light_groups(), wanted);
}

// --- Persistence

void ImageInProgress::restore(const Checkpoint& checkpoint) {
    const std::size_t of_image = film_.bytes_of_sums();
    const std::size_t of_layers = layer_films_ ? layer_films_->bytes_of_sums() : 0;
    if (checkpoint.tiles.size() != states_.size() || checkpoint.film.size() != of_image + of_layers ||
        (samples_per_pass_ > 0 &&
         std::int64_t{checkpoint.passes_done} * samples_per_pass_ != checkpoint.samples_done) ||
        (allocation_ ? !allocation_->restore(checkpoint.allocation) : !checkpoint.allocation.empty())) {
        throw InputError("the checkpoint is of an image of another kind or size");
    }
    const int most = *std::max_element(checkpoint.tiles.begin(), checkpoint.tiles.end());
    if (most > job_.spp) {
        throw InputError(fmt::format(
            "the checkpoint holds up to {} samples per pixel; --spp {} is too small, use {} or more", most,
            job_.spp, most));
    }
    film_.restore(std::span(checkpoint.film).first(of_image));
    if (layer_films_) layer_films_->restore(std::span(checkpoint.film).subspan(of_image));
    for (std::size_t t = 0; t < states_.size(); ++t) states_[t].samples = checkpoint.tiles[t];
    resumed_ = {{}, checkpoint.rays, checkpoint.invalid_rays};
    tiles_.resume_bad({checkpoint.bad_samples, checkpoint.first_bad, {}});
}

void ImageInProgress::save(Checkpoint& checkpoint) const {
    for (const TileState& state : states_) checkpoint.tiles.push_back(state.samples);
    checkpoint.film = film_.sums();
    if (allocation_) checkpoint.allocation = allocation_->state();
    if (layer_films_) {
        const std::vector<std::byte> layers = layer_films_->sums();
        checkpoint.film.insert(checkpoint.film.end(), layers.begin(), layers.end());
    }
    checkpoint.bad_samples = bad_samples().count;
    checkpoint.first_bad = bad_samples().first;
    checkpoint.rays = rays();
    checkpoint.invalid_rays = invalid_rays();
}

bool ImageInProgress::wants_features() const {
    return job_.film.two_halves || (job_.film.parts && job_.receivers.empty());
}

void ImageInProgress::take_features(int most_samples, Monitor& monitor) {
    if (feature_samples_ >= most_samples) return;
    Features taken = render_features(job_, seed_, most_samples, workers_, monitor);
    if (monitor.stopped() && feature_samples_ > 0) return;  // these are incomplete
    features_ = std::move(taken);
    feature_samples_ = most_samples;
}

void ImageInProgress::refine_features(double samples, Monitor& monitor) {
    if (feature_samples_ == 1) lucerna::refine_features(job_, seed_, samples, features_, workers_, monitor);
}

void ImageInProgress::take_features_of(ImageInProgress& other) {
    features_ = std::move(other.features_);
    feature_samples_ = other.feature_samples_;
    other.forget_features();
}

void ImageInProgress::forget_features() {
    features_ = {};
    feature_samples_ = 0;
}

DenoiserInput ImageInProgress::denoiser_input() const {
    const auto half = [this](int h) {
        return film_.develop_half(h, job_.film.scale, job_.film.colours, workers_);
    };
    const Image& from = features_.image;
    DenoiserInput input{{half(0), half(1)}, {from.width, from.height, from.channels}};
    parallel_chunks(workers_.alone(), from.height, [&](std::int64_t row) {
        const std::size_t begin = from.index(0, static_cast<int>(row)), size = from.index(0, 1);  // of a row
        std::copy_n(&from.data[begin], size, &input.features.data[begin]);
    });
    return input;
}

// --- Sweeps

bool ImageInProgress::is_even(int samples) const {
    return std::all_of(states_.begin(), states_.end(),
                       [samples](const TileState& state) { return state.samples == samples; });
}

std::uint64_t ImageInProgress::samples() const {
    std::uint64_t all = 0;
    for (const TileState& state : states_) all += static_cast<std::uint64_t>(state.samples);
    return all;
}

std::vector<std::int64_t> ImageInProgress::tiles_left(const Sweep& sweep, bool spreads) const {
    const std::int64_t tiles = tiles_.tiles(), stride = spreads ? spreading_stride(tiles) : 1;
    std::vector<std::int64_t> left;
    for (std::int64_t i = 0; i < tiles; ++i) {
        const std::int64_t tile = i * stride % tiles;
        const TileState& there = states_[static_cast<std::size_t>(tile)];
        if (sweep.first_step ? there.samples == 0 && there.first_steps <= *sweep.first_step
                             : there.samples < sweep.end)
            left.push_back(tile);
    }
    return left;
}

// Returns how many samples a pixel of the tile has gained.
int ImageInProgress::render_tile(const Estimator& estimator, const Sweep& sweep, std::int64_t tile) {
    const auto number = static_cast<int>(tile);
    if (sweep.first_step) {
        tiles_.render_first(estimator, number, sweep.end, *sweep.first_step);
    } else {
        tiles_.render(estimator, number, states_[static_cast<std::size_t>(tile)].samples, sweep.end);
    }
    return note(sweep, tile);
}

// Books a sweep of the tile, by whichever rank. Samples of the first steps count with the last step.
int ImageInProgress::note(const Sweep& sweep, std::int64_t tile) {
    TileState& there = states_[static_cast<std::size_t>(tile)];
    if (sweep.first_step && ++there.first_steps < TileRenderer::kFirstSteps) return 0;
    return sweep.end - std::exchange(there.samples, sweep.end);
}

bool ImageInProgress::sweep(const Estimator& estimator, const Sweep& sweep, const SweepEnds& ends,
                            Progress& progress) {
    const std::vector<std::int64_t> left = tiles_left(sweep, ends.spreads);
    if (left.empty()) return true;
    const bool counts = !sweep.first_step || *sweep.first_step == TileRenderer::kFirstSteps - 1;
    const int each = counts ? sweep.end - states_[static_cast<std::size_t>(left.front())].samples : 0;
    std::atomic<int> reported{0}, done{0};
    std::atomic<bool> has_begun{false};
    Ranks::Loop loop;
    if (sweep.may_end) {
        loop.seconds = ends.seconds;
        loop.ends = [&] { return ends.ends() || (has_begun && ends.pauses()); };
    }
    loop.advance = [&](std::int64_t tiles) {
        const int samples = static_cast<int>(tiles) * each;
        reported += samples;
        progress.tile(samples);
    };
    const std::set<std::int64_t> not_done =
        owned_.work(workers_, left, std::move(loop), [&](std::int64_t tile) {
            done += render_tile(estimator, sweep, tile);
            ++rendered_;
            has_begun = true;
        });
    for (const std::int64_t tile : left) {
        if (!owned_.is_own(tile) && !not_done.contains(tile)) done += note(sweep, tile);
    }
    progress.tile(done - reported);
    is_gathered_ = false;
    return not_done.empty();
}

// --- All ranks' sums and counts

template <typename Visit>
void ImageInProgress::for_each_block(std::int64_t tile, Visit&& visit) const {
    constexpr int kSide = SampleAllocation::kBlock;
    const PixelBox box = tiles_.box(static_cast<int>(tile));
    for (int y = box.begin.y; y < box.end.y; y += kSide) {
        for (int x = box.begin.x; x < box.end.x; x += kSide) visit(allocation_->block_of({x, y}));
    }
}

template <typename Archive>
void ImageInProgress::fields_of(std::int64_t tile, Archive& archive) {
    const PixelBox box = tiles_.box(static_cast<int>(tile));
    film_.fields_of(box.begin, box.end, archive);
    if (layer_films_) layer_films_->fields_of(box.begin, box.end, archive);
    if (allocation_) for_each_block(tile, [&](int block) { allocation_->fields_of(block, archive); });
}

void ImageInProgress::gather() {
    sum_counts();
    if (std::exchange(is_gathered_, true) || !workers_.ranks) return;
    exchange(*workers_.ranks, "image", ResultsGo::to_rank_0, owned_.own(),
             [this](std::int64_t tile, auto& archive) { fields_of(tile, archive); });
}

void ImageInProgress::sum_counts() {
    const Counts own{tiles_.bad_samples(), job_.scene.rays() + resumed_.rays,
                     job_.scene.invalid_rays() + resumed_.invalid_rays};
    counts_ = own;
    if (!workers_.ranks) return;
    Packer packer;
    packer(own);
    counts_ = {};
    for (const std::span<const std::byte> bytes : workers_.ranks->gather("counts", packer.take())) {
        Counts of_rank;
        Unpacker unpacker(bytes);
        unpacker(of_rank);
        counts_.bad.add(of_rank.bad);
        counts_.rays += of_rank.rays;
        counts_.invalid_rays += of_rank.invalid_rays;
    }
}

void ImageInProgress::prepare_next(int done, int count) {
    Ranks* const ranks = workers_.ranks;
    if (decides_at(done)) {
        assert(feature_samples_ == kMostFeatureSamples);
        if (!ranks || ranks->leads()) allocation_->look_at(features_.image);
        if (ranks) {
            decide_on_ranks(*ranks, done);
        } else {
            allocation_->decide(done);
        }
    }
    if (!ranks) return;
    if (std::has_single_bit(static_cast<unsigned>(count)))
        owned_.balance(*ranks, [this](std::int64_t tile, auto& archive) { fields_of(tile, archive); });
}

// Rank 0 decides on what the owners of all tiles saw, and all ranks get its allocation.
void ImageInProgress::decide_on_ranks(Ranks& ranks, int done) {
    exchange(ranks, "allocation", ResultsGo::to_rank_0, owned_.own(), [&](std::int64_t tile, auto& archive) {
        for_each_block(tile, [&](int block) { allocation_->fields_for_decision(block, done, archive); });
    });
    Packer decided;
    if (ranks.leads()) allocation_->decide(done), allocation_->fields(decided);
    const std::vector<std::byte> bytes = ranks.broadcast("allocation", decided.take());
    Unpacker unpacker(bytes);
    if (!ranks.leads()) allocation_->fields(unpacker);
}

}  // namespace lucerna
