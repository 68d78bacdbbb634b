#include "engine/guiding/directional_guide.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "engine/base/defensive.h"
#include "engine/base/error.h"
#include "engine/base/warp.h"
#include "engine/system/memory.h"
#include "photon/tangent_metric.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Histograms overlap: each counts k photons, but every (k / kRecordOverlap)-th photon is a cache record.
constexpr int kRecordOverlap = 8;
// The normals of a point and of the cache record that it uses have at least this cosine.
constexpr float kFacingAlike = 0.9F;
// A uniform density of this many photons is added to the photons found.
constexpr float kEvenPhotons = 16;
// A histogram is used only if the second moment of its density is at least this. The moment is the gain in
// variance if light comes as the photons tell.
constexpr float kLeastGain = 1.3F;
// Beside other lobes the guide draws at most this share: transmission must stay possible whatever is guessed.
constexpr float kMostGuided = 0.9F;

// A shading normal and the cache record's normal have at least this cosine. A histogram turned far tells
// little, and turned by a right angle nothing.
constexpr float kLeastFacing = 0.7F;
// Guiding is done only if it pays at this share of the cache records, or more.
constexpr double kLeastPaying = 0.2;
constexpr std::uint32_t kNone = ~std::uint32_t{0};

// Returns the cell of a coordinate in [0,1].
std::size_t cell_of(float x) {
    return std::min(static_cast<std::size_t>(x * SquareHistogram::kSide), SquareHistogram::kSide - 1);
}

// Returns how many of the bounds, except the last, are at most x.
std::size_t bin_of(const std::array<std::uint16_t, SquareHistogram::kSide>& bounds, std::uint32_t x) {
    std::uint32_t bin = 0;
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) bin += bounds[i] <= x ? 1U : 0U;
    return bin;
}

struct Step {
    float begin, size;  // times 2^16
};
Step step_of(const std::array<std::uint16_t, SquareHistogram::kSide>& bounds, std::size_t bin) {
    const std::uint32_t begin = bin == 0 ? 0 : bounds[bin - 1];
    const std::uint32_t end = bin + 1 == bounds.size() ? 65536 : bounds[bin];
    return {static_cast<float>(begin), static_cast<float>(end - begin)};
}

}  // namespace

SquareHistogram::SquareHistogram() {
    for (std::size_t i = 0; i < kSide; ++i) rows_[i] = static_cast<std::uint16_t>((i + 1) * 65536 / kSide);
    cells_.fill(rows_);
}

SquareHistogram::Bounds SquareHistogram::bounds_of(std::span<const float, kSide> weights) {
    const float sum = std::accumulate(weights.begin(), weights.end(), 0.0F);
    Bounds bounds{};
    float upto = 0;
    std::uint32_t before = 0;
    for (std::size_t i = 0; i + 1 < kSide; ++i) {
        upto += weights[i];
        const auto bound = static_cast<std::uint32_t>(upto / sum * kWhole + 0.5F);
        // Each step is at least one, and leaves room for the following ones.
        before = std::clamp(bound, before + 1, static_cast<std::uint32_t>(65536 - (kSide - 1 - i)));
        bounds[i] = static_cast<std::uint16_t>(before);
    }
    return bounds;
}

SquareHistogram::SquareHistogram(std::span<const float, kCells> weights) {
    std::array<float, kSide> rows{};
    for (std::size_t row = 0; row < kSide; ++row) {
        const auto cells = std::span<const float, kSide>(weights.data() + row * kSide, kSide);
        rows[row] = std::accumulate(cells.begin(), cells.end(), 0.0F);
        cells_[row] = bounds_of(cells);
    }
    rows_ = bounds_of(rows);
}

V2f SquareHistogram::warp(const V2f& u) const {
    const auto along = [](const Bounds& bounds, float x, std::size_t& bin) {
        const float scaled = x * kWhole;
        bin = bin_of(bounds, static_cast<std::uint32_t>(scaled));
        const Step step = step_of(bounds, bin);
        const float inside = (scaled - step.begin) / step.size;
        return std::min((static_cast<float>(bin) + inside) / static_cast<float>(kSide), kBelowOne);
    };
    std::size_t row = 0, cell = 0;
    const float y = along(rows_, u.y, row);
    const float x = along(cells_[row], u.x, cell);
    return {x, y};
}

float SquareHistogram::density(const V2f& at) const {
    constexpr float kScale = static_cast<float>(kCells) / (kWhole * kWhole);
    const std::size_t row = cell_of(at.y);
    return step_of(rows_, row).size * step_of(cells_[row], cell_of(at.x)).size * kScale;
}

DirectionGuide::DirectionGuide(const SquareHistogram& histogram, const Frame& record, const V3f& ns)
    : histogram_(&histogram), frame_(record) {
    // The cache record's tangent is projected into the plane across ns, so that frames turn smoothly with ns.
    frame_.n = ns;
    frame_.s = (record.s - ns.dot(record.s) * ns).normalized();
    frame_.t = ns.cross(frame_.s);
}

DirectionGuide::Sample DirectionGuide::sample(const V2f& u) const {
    const V2f at = histogram_->warp(u);
    const V3f local = square_to_cosine_hemisphere(at);
    return {frame_.to_world(local), histogram_->density(at) * cosine_hemisphere_pdf_w(local.z)};
}

float DirectionGuide::pdf_w(const V3f& wi) const {
    const V3f local = frame_.to_local(wi);
    if (!(local.z > 0)) return 0;
    return histogram_->density(disc_to_square({local.x, local.y})) * cosine_hemisphere_pdf_w(local.z);
}

namespace {

// Accumulates the photons around a cache record.
class HistogramSum {
  public:
    // Distributes a photon among the four cells whose centres are nearest.
    void add(const V2f& at, float weight) {
        constexpr auto kLast = static_cast<float>(SquareHistogram::kSide - 1);
        const float x = std::clamp(at.x * SquareHistogram::kSide - 0.5F, 0.0F, kLast);
        const float y = std::clamp(at.y * SquareHistogram::kSide - 0.5F, 0.0F, kLast);
        const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
        const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
        const std::size_t right = std::min(i + 1, SquareHistogram::kSide - 1);
        const std::size_t above = std::min(j + 1, SquareHistogram::kSide - 1);
        cell(i, j) += weight * (1 - fx) * (1 - fy);
        cell(right, j) += weight * fx * (1 - fy);
        cell(i, above) += weight * (1 - fx) * fy;
        cell(right, above) += weight * fx * fy;
        sum_ += weight;
        squares_ += weight * weight;
    }
    // Returns none if nothing was added, or if light arrives about evenly.
    std::optional<SquareHistogram> histogram() const {
        if (!(sum_ > 0) || !std::isfinite(squares_)) return std::nullopt;
        const float photons = sum_ * sum_ / squares_;  // effective number of photons of equal weight
        constexpr auto kCells = static_cast<float>(SquareHistogram::kCells);
        float second = 0;
        for (const float cell : cells_) second += sqr(cell / sum_) * kCells;
        // Chance alone adds as much to the second moment of photons, each of which fills about 9/4 cells.
        const float gain = second - kCells / (photons * 2.25F);
        if (gain < kLeastGain) return std::nullopt;
        const float guided = (1 - kDefensiveWeight) * photons / (photons + kEvenPhotons);
        std::array<float, SquareHistogram::kCells> weights;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            weights[i] = guided * cells_[i] / sum_ + (1 - guided) / kCells;
        }
        return SquareHistogram(weights);
    }

  private:
    float& cell(std::size_t x, std::size_t y) { return cells_[y * SquareHistogram::kSide + x]; }
    std::array<float, SquareHistogram::kCells> cells_{};
    float sum_ = 0, squares_ = 0;
};

// Returns none where guiding does not pay.
std::optional<SquareHistogram> histogram_at(const PhotonMap& map, const DirectionGuiding& settings,
                                            const V3f& x, const V3f& n) {
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    const NearPhotons near(map, x, metric, static_cast<std::size_t>(settings.k), sqr(settings.radius));
    const Frame frame(n);
    HistogramSum sum;
    for (const Neighbour& neighbour : near.found()) {
        if (map.normals()[neighbour.index].unpack().dot(n) < kFacingAlike) continue;
        const Photon& photon = map.photons()[neighbour.index];
        const V3f from = frame.to_local(-photon.direction.unpack());
        if (from.z > 0) sum.add(disc_to_square({from.x, from.y}), luminance(photon.power));
    }
    return sum.histogram();
}

}  // namespace

DirectionGuideMap::DirectionGuideMap(const PhotonMap& map, const DirectionGuiding& settings,
                                     const Workers& workers)
    : radius_(settings.radius), photons_(map.size()) {
    assert(settings.k >= 1 && settings.k <= DirectionGuiding::kMostPhotons);
    const std::size_t stride =
        std::max<std::size_t>(static_cast<std::size_t>(settings.k) / kRecordOverlap, 1);
    for (std::size_t i = 0; i < map.size(); i += stride) {
        places_.push_back(map.positions()[i]);
        normals_.push_back(map.normals()[i]);
    }
    std::vector<std::optional<SquareHistogram>> made(places_.size());
    constexpr std::size_t kGrain = 64;
    const auto part = [&](std::int64_t chunk) {
        const std::size_t begin = static_cast<std::size_t>(chunk) * kGrain;
        return std::pair(begin, std::min(begin + kGrain, made.size()));
    };
    shared_chunks(
        workers, "direction guides", static_cast<std::int64_t>((made.size() + kGrain - 1) / kGrain),
        ResultsGo::to_all_ranks,
        [&](std::int64_t chunk) {
            const auto [begin, end] = part(chunk);
            for (std::size_t i = begin; i < end; ++i)
                made[i] = histogram_at(map, settings, places_[i], normals_[i].unpack());
        },
        [&](std::int64_t chunk, auto& archive) {
            const auto [begin, end] = part(chunk);
            for (std::size_t i = begin; i < end; ++i) {
                bool there = made[i].has_value();
                archive(there);
                if (there && !made[i]) made[i].emplace();
                if (there) archive(*made[i]);
            }
        });
    for (const auto& histogram : made) {
        numbers_.push_back(histogram ? static_cast<std::uint32_t>(histograms_.size()) : kNone);
        if (histogram) histograms_.push_back(*histogram);
    }
    // Where guiding pays hardly anywhere, a look-up at each point costs more than it gains.
    const double paying = static_cast<double>(histograms_.size());
    if (paying < kLeastPaying * static_cast<double>(places_.size())) histograms_.clear();
    if (!histograms_.empty()) index_ = make_photon_index(settings.index, places_, normals_, workers);
}

DirectionGuide DirectionGuideMap::at(const V3f& x, const Bsdf& bsdf, const V3f& wo) const {
    if (!index_ || !bsdf.has_diffuse()) return {};
    const float side = bsdf.geometric_normal().dot(wo) < 0 ? -1.0F : 1.0F;
    const V3f n = side * bsdf.geometric_normal(), ns = side * bsdf.shading_normal();
    const auto nearest = index_->nearest_facing(x, n, kFacingAlike, sqr(radius_));
    if (!nearest || numbers_[nearest->index] == kNone) return {};
    const V3f normal = normals_[nearest->index].unpack();
    if (normal.dot(ns) < kLeastFacing) return {};
    return {histograms_[numbers_[nearest->index]], Frame(normal), ns};
}

namespace {

// Stores those photons of one chunk of paths whose light is not found by light samples.
struct UnsampledHits : LightPathVisitor {
    const Scene* scene = nullptr;
    const LightChooser* lights = nullptr;
    float share = 0;  // of one path among all
    Photons photons;

    float kept = 0;  // accumulated shares of photons that count in part, not yet stored

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons);
    }
    void hit(const LightPathHit& at) {
        if (!at.bsdf.has_diffuse()) return;
        if (at.path.bounces() == 0) {
            // Photons that count in part are stored at full power, but less often: all weigh about alike.
            kept += left_by_light_samples(at);
            if (kept < 1) return;
            kept -= 1;
        }
        photons.add_hit(at.hit.at, at.d, at.power * share, at.start.light, at.start.cell);
    }

    // Returns the share of light straight from a light that light samples leave to other strategies. For a
    // sky it is the MIS weight of rays drawn by the cosine, because light samples of a sky most often end at
    // a wall. It is 0 for lamps at a finite distance, which light samples find.
    float left_by_light_samples(const LightPathHit& at) const {
        const Light& light = *scene->lights()[at.start.light];
        const SurfacePoint& x = at.hit.at;
        const auto seen = light.Le({x.towards(-at.d), -at.d});
        if (!seen || !std::isinf(seen->distance)) return 0;
        const float cosine = std::fabs(at.d.dot(x.n));
        const LightChoice choice = lights->at(x, at.bsdf, -at.d);
        const float of_light = choice.pdf_w(*scene, at.start.light, *seen);
        if (!(cosine > 0) || !(of_light > 0)) return 0;
        return power_heuristic(cosine_hemisphere_pdf_w(cosine), of_light);
    }
};

// Throws InputError if there is too little memory for the photons, whose number the first paths tell.
void require_memory_for_photons(const std::vector<UnsampledHits>& chunks, std::int64_t paths,
                                std::int64_t all) {
    constexpr double kBytesOfHit = sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon), kTree = 32;
    const double photons =
        expected_of(chunks, paths, all, [](const UnsampledHits& chunk) { return chunk.photons.size(); });
    require_memory(static_cast<std::uint64_t>(photons * (3 * kBytesOfHit + kTree)),
                   fmt::format("about {:.2g} photons for guiding from {} light paths", photons, all),
                   "use fewer light paths (guidepaths)");
}

}  // namespace

DirectionGuideMap build_direction_guides(const Scene& scene, const DirectionGuideParameters& parameters,
                                         const Workers& workers, Monitor& monitor) {
    require_path_numbers("guide", parameters.paths);
    LightPathRequest paths;
    paths.count = parameters.paths;
    paths.seed = parameters.seed;
    paths.phase = "guide";
    const LightChooser lights(scene);
    std::vector<UnsampledHits> chunks;
    trace_light_paths(
        {scene, workers, monitor}, paths, chunks,
        [&](std::int64_t /*count*/) {
            UnsampledHits chunk;
            chunk.scene = &scene;
            chunk.lights = &lights;
            chunk.share = 1.0F / static_cast<float>(parameters.paths);
            return chunk;
        },
        require_memory_for_photons);
    Photons all;
    for (const UnsampledHits& chunk : chunks) all.append(chunk.photons);
    return {PhotonMap(all, parameters.settings.index, workers), parameters.settings, workers};
}

namespace {

// Returns the probability that the guide draws in place of the BSDF.
float guided_share(const Bsdf& bsdf, const V3f& wo) {
    if (bsdf.is_diffuse()) return 1;
    if (!bsdf.has_diffuse()) return 0;
    const float all = bsdf.guessed_albedo(wo);
    return all > 0 ? std::min(kMostGuided * bsdf.diffuse_part().guessed_albedo(wo) / all, kMostGuided) : 0.0F;
}

}  // namespace

GuidedBsdf::GuidedBsdf(const Bsdf& bsdf, const V3f& wo, const DirectionGuide& guide)
    : bsdf_(bsdf), wo_(wo), guide_(guide), share_(guide.empty() ? 0.0F : guided_share(bsdf, wo)) {}

float GuidedBsdf::pdf_w(const V3f& wi) const {
    if (share_ == 0) return bsdf_.pdf_w(wo_, wi);
    return share_ * guide_.pdf_w(wi) + (share_ < 1 ? (1 - share_) * bsdf_.pdf_w(wo_, wi) : 0.0F);
}

std::optional<GuidedBsdf::Sample> GuidedBsdf::sample(const BsdfU& u) const {
    BsdfSample drawn{};
    float of_guide = 0;
    if (u.lobe < share_) {
        const DirectionGuide::Sample own = guide_.sample(u.direction);
        drawn.wi = own.wi;
        of_guide = own.pdf_w;
    } else {
        const BsdfU own{std::min((u.lobe - share_) / (1 - share_), kBelowOne), u.direction};
        const auto sample = bsdf_.sample(wo_, own, Transport::radiance);
        if (!sample) return std::nullopt;
        if (share_ == 0) return Sample{*sample};
        drawn = *sample;
        if (drawn.delta) {
            drawn.weight /= 1 - share_;
            return Sample{drawn, 1 - share_};
        }
        of_guide = guide_.pdf_w(drawn.wi);
    }
    const float of_bsdf = bsdf_.pdf_w(wo_, drawn.wi);
    drawn.pdf_w = share_ * of_guide + (1 - share_) * of_bsdf;
    if (!(drawn.pdf_w > 0)) return std::nullopt;
    const float cosine = std::fabs(drawn.wi.dot(bsdf_.shading_normal()));
    drawn.weight = bsdf_.f(wo_, drawn.wi, Transport::radiance) * (cosine / drawn.pdf_w);
    if (is_black(drawn.weight)) return std::nullopt;
    return Sample{drawn, of_bsdf > 0 ? drawn.pdf_w / of_bsdf : 1.0F};
}

}  // namespace lucerna
