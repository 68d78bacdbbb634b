#include "engine/guiding/guide.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <unordered_map>

#include "engine/base/error.h"
#include "engine/system/memory.h"
#include "photon/emission.h"
#include "photon/photon_map.h"
#include "photon/tangent_metric.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Distributions overlap: each counts k photons, and there is one for every k / kOverlap photons.
constexpr int kOverlap = 3;
// The normals of a point and of the cached distribution that it uses have at least this cosine.
constexpr float kAboutTheSame = 0.7F;

constexpr CellId kNoSample = kNoCell - 1;  // no part has this number: a table has fewer cells

// Holds a sample with its light and part as one number to sort by.
struct HistogramEntry {
    std::uint64_t key;
    std::uint32_t order;  // nearest first, so that sums do not depend on how equal keys are sorted
    float weight;
    float plain;

    bool operator<(const HistogramEntry& other) const {
        return key < other.key || (key == other.key && order < other.order);
    }
};

// Counts the photons of one choice. `plain` is its probability without them.
struct Count {
    float photons;
    float plain;
};

// Returns the f in [0, 1] that maximises Π (f q + (1 - f) p) over the photons, where q is the plain
// probability of a photon's choice, and p is the share of the *other* photons that made it (leave-one-out).
// The logarithm is concave in f, so its slope changes sign once.
float likeliest_share(std::span<const Count> counts, float all) {
    if (all < 2) return 1;
    const auto slope = [&](float f) {
        float sum = 0;
        for (const Count& c : counts) {
            const float p = (c.photons - 1) / (all - 1);
            // The denominator is 0 only if q = 0 or f = 0, for a choice that a lone photon made.
            sum += c.photons * (c.plain - p) / std::max(f * c.plain + (1 - f) * p, 1e-12F);
        }
        return sum;
    };
    if (slope(1) >= 0) return 1;
    float low = 0, high = 1;
    for (int i = 0; i < 6; ++i) {
        const float middle = 0.5F * (low + high);
        (slope(middle) > 0 ? low : high) = middle;
    }
    return 0.5F * (low + high);
}

}  // namespace

float make_histogram(std::span<const PartSample> samples, std::vector<Guide::Choice>& choices) {
    assert(samples.size() <= GuideSettings::kMostPhotons);
    std::array<HistogramEntry, GuideSettings::kMostPhotons> entries;
    float total = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        entries[i] = {Guide::key(samples[i].light, samples[i].part), static_cast<std::uint32_t>(i),
                      samples[i].weight, samples[i].plain};
        total += samples[i].weight;
    }
    if (!(total > 0) || !std::isfinite(total)) return 1;
    std::sort(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(samples.size()));

    // Count by key.
    const std::size_t begin = choices.size();
    float sum = 0;
    std::array<Count, GuideSettings::kMostPhotons> counts;
    for (std::size_t i = 0; i < samples.size();) {
        const std::size_t first = i;
        const std::uint64_t key = entries[first].key;
        for (; i < samples.size() && entries[i].key == key; ++i) sum += entries[i].weight;
        counts[choices.size() - begin] = {static_cast<float>(i - first), entries[first].plain};
        choices.push_back({static_cast<std::uint32_t>(key >> 32), static_cast<CellId>(key), 0, sum});
    }

    // A choice's probability is the step between the rounded sums, which is exactly what draw() does.
    float before = 0;
    for (std::size_t i = begin; i < choices.size(); ++i) {
        Guide::Choice& choice = choices[i];
        choice.upto = i + 1 < choices.size() ? std::min(choice.upto / sum, 1.0F) : 1.0F;
        choice.probability = choice.upto - before;
        before = choice.upto;
    }
    return likeliest_share({counts.data(), choices.size() - begin}, static_cast<float>(samples.size()));
}

namespace {

// Stores the part of its light that each photon left, and how probable the plain strategy makes it. Photons
// are emitted by flux, so their shares are those of a choice by power.
struct PhotonParts {
    std::vector<CellId> parts;  // of each photon's light, or kNoSample
    std::vector<float> plain;   // with a tree: relative to all parts of its light
    const LightTree* tree;      // null: the plain strategy is by power

    PhotonParts(const PhotonMap& map, std::span<const std::unique_ptr<Light>> lights,
                const LightTree* plainly, const Workers& workers)
        : parts(map.size()), plain(map.size()), tree(plainly) {
        const auto suns = tree ? tree->suns() : std::span<const std::uint32_t>();
        constexpr std::int64_t kGrain = 1 << 14;
        parallel_each(workers, map.size(), kGrain, [&](std::size_t i) {
            const Photon& photon = map.photons()[i];
            const Light& light = *lights[photon.light];
            const bool sampled =
                !light.only_particles() && std::find(suns.begin(), suns.end(), photon.light) == suns.end();
            parts[i] = sampled ? light.part_of(photon.cell) : kNoSample;
        });
        std::unordered_map<std::uint64_t, float> counts;
        const auto key = [&](std::size_t i) { return Guide::key(map.photons()[i].light, parts[i]); };
        std::vector<float> of_light(lights.size());
        for (std::size_t i = 0; i < parts.size(); ++i) {
            ++counts[key(i)];
            ++of_light[map.photons()[i].light];
        }
        for (std::size_t i = 0; i < parts.size(); ++i) {
            const float all = tree ? of_light[map.photons()[i].light] : static_cast<float>(parts.size());
            plain[i] = counts[key(i)] / all;
        }
    }

    // Returns the probability that the plain strategy chooses this light and part at a place.
    float plain_probability(std::uint32_t light, std::uint32_t photon, const V3f& x, const V3f& n) const {
        if (!tree) return plain[photon];
        const float probability = tree->probability(x, n, light, parts[photon]);
        return tree->picks_parts_of(light) ? probability : probability * plain[photon];
    }
};

// Collects the samples around x, on the side of n, and returns their number.
std::size_t samples_near(const PhotonMap& map, const PhotonParts& photon_parts, const GuideSettings& settings,
                         const V3f& x, const V3f& n,
                         std::array<PartSample, GuideSettings::kMostPhotons>& samples) {
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    const NearPhotons near(map, x, metric, static_cast<std::size_t>(settings.k), sqr(settings.radius));
    std::size_t size = 0;
    for (const Neighbour& neighbour : near.found()) {
        const CellId part = photon_parts.parts[neighbour.index];
        if (part == kNoSample) continue;
        const Photon& photon = map.photons()[neighbour.index];
        // Photons that all lie at one point count alike.
        const float x2 = near.radius2() > 0 ? neighbour.key / near.radius2() : 0.0F;
        samples[size++] = {photon.light, part,
                           luminance(photon.power) * kernel(KernelShape::epanechnikov, x2),
                           photon_parts.plain_probability(photon.light, neighbour.index, x, n)};
    }
    return size;
}

}  // namespace

GuideMap::GuideMap(PhotonMap map, std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
                   const GuideSettings& settings, const Workers& workers)
    : map_(std::move(map)), settings_(settings) {
    assert(settings.k >= 0 && settings.k <= GuideSettings::kMostPhotons);
    if (settings.k > 0 && map_.size() > 0) cache_distributions(lights, tree, workers);
}

void GuideMap::cache_distributions(std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
                                   const Workers& workers) {
    const PhotonParts photon_parts(map_, lights, tree, workers);
    // Makes a distribution for every few of the photons that each one counts, so that they overlap. The
    // photons are in the order of the map.
    const std::size_t stride = std::max<std::size_t>(static_cast<std::size_t>(settings_.k) / kOverlap, 1);
    for (std::size_t i = 0; i < map_.size(); i += stride) {
        places_.push_back(map_.positions()[i]);
        normals_.push_back(map_.normals()[i]);
    }
    const auto count = static_cast<std::int64_t>(places_.size());
    constexpr std::int64_t kGrain = 512;  // fixed, so that results do not depend on threads
    struct Chunk {
        std::vector<CachedDistribution> distributions;
        std::vector<Guide::Choice> choices;
    };
    std::vector<Chunk> chunks(static_cast<std::size_t>((count + kGrain - 1) / kGrain));
    const auto make = [&](std::int64_t number) {
        Chunk& chunk = chunks[static_cast<std::size_t>(number)];
        std::array<PartSample, GuideSettings::kMostPhotons> samples;
        const auto begin = static_cast<std::size_t>(number * kGrain);
        for (std::size_t i = begin; i < std::min(begin + kGrain, places_.size()); ++i) {
            const std::size_t size =
                samples_near(map_, photon_parts, settings_, places_[i], normals_[i].unpack(), samples);
            const std::size_t first = chunk.choices.size();
            const float defensive_weight = make_histogram({samples.data(), size}, chunk.choices);
            chunk.distributions.push_back({first, chunk.choices.size() - first, defensive_weight});
        }
    };
    shared_chunks(workers, "guide's distributions", static_cast<std::int64_t>(chunks.size()),
                  ResultsGo::to_all_ranks, make, [&](std::int64_t number, auto& archive) {
                      Chunk& chunk = chunks[static_cast<std::size_t>(number)];
                      archive(chunk.distributions, chunk.choices);
                  });
    distributions_.reserve(places_.size());
    for (const Chunk& chunk : chunks) {
        for (CachedDistribution distribution : chunk.distributions) {
            distribution.first += choices_.size();
            distributions_.push_back(distribution);
        }
        choices_.insert(choices_.end(), chunk.choices.begin(), chunk.choices.end());
    }
    index_ = make_photon_index(settings_.index, places_, normals_, workers);
}

Guide GuideMap::at(const V3f& x, const V3f& n) const {
    if (!index_) return {};
    const auto nearest = index_->nearest_facing(x, n, kAboutTheSame, sqr(settings_.radius));
    if (!nearest) return {};
    const CachedDistribution& distribution = distributions_[nearest->index];
    return {std::span(choices_).subspan(distribution.first, distribution.size),
            distribution.defensive_weight};
}

bool GuideMap::any_near(const V3f& x, const V3f& n) const {
    if (map_.size() == 0) return false;
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    return !NearPhotons(map_, x, metric, 1, sqr(settings_.radius)).found().empty();
}

namespace {

// Stores the first hits of one chunk of paths on any surface. Each path is one ray, which ignores media and
// continues straight through panes, because lights behind panes are sampled, too.
struct FirstHits : LightPathVisitor {
    const Scene* scene = nullptr;
    float share = 0;  // of one path among all
    Photons photons;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons);
    }
    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& start,
               const Sampler& /*sampler*/) {
        if (!start) return false;
        SurfacePoint from = start->from;
        Rgb power = start->power * share;
        for (int panes = 0; panes < kMaxSheets && !is_black(power); ++panes) {
            const auto at = scene->intersect(Ray{from.towards(start->d), start->d});
            if (!at) break;
            photons.add_hit(at->at, start->d, power, start->light, start->cell);
            if (!scene->has_panes()) break;
            power *= scene->bsdf(*at).straight_share(-start->d);
            from = at->at;
        }
        return false;
    }
};

// Throws InputError if there is too little memory for the photons, whose number the first paths tell. They
// are held as chunks leave them, in one array, and in the map, under its tree.
void require_memory_for_guides(const std::vector<FirstHits>& chunks, std::int64_t paths, std::int64_t all) {
    constexpr double kBytesOfHit = sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon), kTree = 32;
    const double photons =
        expected_of(chunks, paths, all, [](const FirstHits& chunk) { return chunk.photons.size(); });
    require_memory(static_cast<std::uint64_t>(photons * (3 * kBytesOfHit + kTree)),
                   fmt::format("guides of about {:.2g} photons from {} light paths", photons, all),
                   "use fewer light paths (guidelights, prepass or photons)");
}

}  // namespace

GuideMap build_guides(const Scene& scene, const GuideParameters& parameters, const Workers& workers,
                      Monitor& monitor) {
    require_path_numbers("guide", parameters.paths);
    LightPathRequest paths;
    paths.count = parameters.paths;
    paths.seed = parameters.seed;
    paths.pass = parameters.pass;
    paths.phase = "guide";
    std::vector<FirstHits> chunks;
    trace_light_paths(
        {scene, workers, monitor}, paths, chunks,
        [&](std::int64_t /*count*/) {
            FirstHits chunk;
            chunk.scene = &scene;
            chunk.share = 1.0F / static_cast<float>(parameters.paths);
            return chunk;
        },
        require_memory_for_guides);
    Photons all;
    for (const FirstHits& chunk : chunks) all.append(chunk.photons);
    return {PhotonMap(all, parameters.settings.index), scene.lights(), &scene.light_tree(),
            parameters.settings, workers};
}

}  // namespace lucerna
