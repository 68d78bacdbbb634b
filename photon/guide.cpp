#include "photon/guide.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <unordered_map>

#include "engine/base/error.h"
#include "photon/emission.h"
#include "photon/kernel.h"
#include "photon/near_photons.h"
#include "photon/tangent_metric.h"

namespace lucerna {
namespace {

constexpr CellId kMute = kNoCell - 1;  // no part is named so: a table has fewer cells

// What is voted for, as one number to sort by.
struct Ballot {
    std::uint64_t key;
    std::uint32_t order;  // nearest first: sums do not depend on how equal keys are sorted
    float weight;
    float plain;

    bool operator<(const Ballot& other) const {
        return key < other.key || (key == other.key && order < other.order);
    }
};

std::uint64_t key_of(std::uint32_t light, CellId part) {
    return std::uint64_t{light} << 32 | part;
}

// How many photons are for one choice, and how probable it is without them.
struct Count {
    float photons;
    float plain;
};

// The f in [0, 1] for which Π f q + (1 - f) p is greatest: over the photons, q the plain probability of each
// one's choice, p the share of the *other* photons that made it. The logarithm is concave in f, so its slope
// changes sign once.
float likeliest_share(std::span<const Count> counts, float all) {
    if (all < 2) return 1;
    const auto slope = [&](float f) {
        float sum = 0;
        for (const Count& c : counts) {
            const float p = (c.photons - 1) / (all - 1);
            // A denominator of 0 needs q = 0 or f = 0, for a choice that a lone photon made.
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

Guide::Guide(std::span<const Vote> votes) {
    assert(votes.size() <= GuideSettings::kMostPhotons);
    std::array<Ballot, GuideSettings::kMostPhotons> ballots;
    float total = 0;
    for (std::size_t i = 0; i < votes.size(); ++i) {
        ballots[i] = {key_of(votes[i].light, votes[i].part), static_cast<std::uint32_t>(i), votes[i].weight,
                      votes[i].plain};
        total += votes[i].weight;
    }
    if (!(total > 0) || !std::isfinite(total)) return;
    std::sort(ballots.begin(), ballots.begin() + static_cast<std::ptrdiff_t>(votes.size()));

    // Count by key.
    float sum = 0;
    std::array<Count, GuideSettings::kMostPhotons> counts;
    for (std::size_t i = 0; i < votes.size();) {
        const std::size_t first = i;
        const std::uint64_t key = ballots[first].key;
        for (; i < votes.size() && ballots[i].key == key; ++i) sum += ballots[i].weight;
        counts[size_] = {static_cast<float>(i - first), ballots[first].plain};
        choices_[size_] = {static_cast<std::uint32_t>(key >> 32), static_cast<CellId>(key), 0};
        upto_[size_++] = sum;
    }
    plain_share_ = likeliest_share({counts.data(), size_}, static_cast<float>(votes.size()));

    // A choice is as probable as the steps between the sums make it: what draw() does, to the last bit.
    float before = 0;
    for (std::size_t i = 0; i < size_; ++i) {
        upto_[i] = i + 1 < size_ ? std::min(upto_[i] / sum, 1.0F) : 1.0F;
        choices_[i].probability = upto_[i] - before;
        before = upto_[i];
    }
}

const Guide::Choice& Guide::draw(float u) const {
    assert(!empty());
    std::size_t i = 0;
    while (i + 1 < size_ && !(u < upto_[i])) ++i;
    return choices_[i];
}

float Guide::probability(std::uint32_t light, CellId part) const {
    const std::uint64_t key = key_of(light, part);
    const auto end = choices_.begin() + static_cast<std::ptrdiff_t>(size_);
    const auto found =
        std::lower_bound(choices_.begin(), end, key, [](const Choice& choice, std::uint64_t wanted) {
            return key_of(choice.light, choice.part) < wanted;
        });
    return found != end && found->light == light && found->part == part ? found->probability : 0.0F;
}

GuideMap::GuideMap(PhotonMap map, std::span<const std::unique_ptr<Light>> lights,
                   const GuideSettings& settings, const Workers& workers)
    : map_(std::move(map)), parts_(map_.size()), plain_(map_.size()), settings_(settings) {
    assert(settings.k >= 1 && settings.k <= GuideSettings::kMostPhotons);
    const auto size = static_cast<std::int64_t>(map_.size());
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_ranges(workers, size, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const Photon& photon = map_.photons()[i];
            const Light& light = *lights[photon.light];
            parts_[i] = light.only_particles() ? kMute : light.part_of(photon.cell);
        }
    });
    // All photons together are emitted by flux, as the plain choice is made.
    std::unordered_map<std::uint64_t, float> counts;
    const auto key = [&](std::size_t i) { return key_of(map_.photons()[i].light, parts_[i]); };
    for (std::size_t i = 0; i < parts_.size(); ++i) ++counts[key(i)];
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        plain_[i] = counts[key(i)] / static_cast<float>(parts_.size());
    }
}

Guide GuideMap::at(const V3f& x, const V3f& n) const {
    if (map_.size() == 0) return {};
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    const NearPhotons near(map_, x, metric, static_cast<std::size_t>(settings_.k), sqr(settings_.radius));
    std::array<Guide::Vote, GuideSettings::kMostPhotons> votes;
    std::size_t size = 0;
    for (const Neighbour& neighbour : near.found()) {
        const CellId part = parts_[neighbour.index];
        if (part == kMute) continue;
        const Photon& photon = map_.photons()[neighbour.index];
        // All at one point: they count alike.
        const float x2 = near.radius2() > 0 ? neighbour.key / near.radius2() : 0.0F;
        votes[size++] = {photon.light, part, luminance(photon.power) * kernel(KernelShape::epanechnikov, x2),
                         plain_[neighbour.index]};
    }
    return Guide({votes.data(), size});
}

bool GuideMap::any_near(const V3f& x, const V3f& n) const {
    if (map_.size() == 0) return false;
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    return !NearPhotons(map_, x, metric, 1, sqr(settings_.radius)).found().empty();
}

namespace {

// The first impacts of some paths, whatever they landed on: each is one ray.
Photons first_impacts(const Scene& scene, const GuidePlan& plan, std::int64_t begin, std::int64_t end) {
    Photons landed;
    Emission emission(scene, plan.seed, Purpose::emission, plan.pass);
    const float share = 1.0F / static_cast<float>(plan.paths);
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t /*path*/, const std::optional<LightPathStart>& start) {
                          if (!start) return;
                          const auto hit = scene.hit(Ray{start->from.towards(start->d), start->d});
                          if (!hit) return;
                          const V3f& n = hit->at.n;
                          landed.add(
                              hit->at.p, PackedDirection(n.dot(start->d) > 0 ? -n : n),
                              {PackedDirection(start->d), start->power * share, start->light, start->cell});
                      });
    return landed;
}

}  // namespace

GuideMap build_guides(const Scene& scene, const GuidePlan& plan, const Workers& workers, Monitor& monitor) {
    if (plan.paths < 1 || plan.paths > (std::int64_t{1} << 32)) {
        throw InputError(
            fmt::format("guide: {} paths asked for; 1 to 4294967296 can be emitted", plan.paths));
    }
    constexpr std::int64_t kGrain = 4096;  // fixed, so that results do not depend on threads
    std::vector<Photons> chunks(static_cast<std::size_t>((plan.paths + kGrain - 1) / kGrain));
    Phase phase(monitor, "guide", static_cast<std::uint64_t>(plan.paths));
    parallel_ranges(workers, plan.paths, kGrain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                        if (monitor.stopped()) return;
                        chunks[static_cast<std::size_t>(chunk)] = first_impacts(scene, plan, begin, end);
                        phase.advance(static_cast<std::uint64_t>(end - begin));
                    });
    Photons all;
    for (const Photons& chunk : chunks) {
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            all.add(chunk.positions[i], chunk.normals[i], chunk.photons[i]);
        }
    }
    return {PhotonMap(all), scene.lights(), plan.settings, workers};
}

}  // namespace lucerna
