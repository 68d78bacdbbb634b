#include "photon/photon_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/float_traps.h"

namespace lucerna {

PhotonMap::PhotonMap(const Photons& deposited, IndexKind index, const Workers& workers) : kind_(index) {
    // Sorts photons so that neighbours in space are neighbours in memory, which a search then reads
    // sequentially.
    const std::vector<std::uint32_t> order = box_order(deposited.positions, workers);
    all_.resize(order.size());
    std::vector<PackedDirection> directions(order.size());
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_each(workers, order.size(), kGrain, [&](std::size_t i) {
        const std::uint32_t old = order[i];
        all_.positions[i] = deposited.positions[old];
        all_.normals[i] = deposited.normals[old];
        all_.photons[i] = deposited.photons[old];
        all_.bounces[i] = deposited.bounces[old];
        directions[i] = deposited.photons[old].direction;
    });
    if (!all_.bounces.empty()) deepest_ = *std::max_element(all_.bounces.begin(), all_.bounces.end());
    index_ = make_photon_index(index, all_.positions, directions, workers);
}

namespace {

// Measures the squared distance of points whose direction lies within an angle of n. Usable as the measure of
// a BoxTree whose payloads are packed directions.
class FacingMeasure {
  public:
    FacingMeasure(const V3f& x, const V3f& n, float cosine) : x_(x), n_(n), cosine2_(cosine * cosine) {}

    // `d` may have any length.
    float operator()(const V3f& d, float r2) const {
        const float along = n_.dot(d);
        const bool faces = along > 0 && along * along > cosine2_ * d.length2();
        return faces ? r2 : INFINITY;
    }
    BlockKeys keys(const PointBlock& block) const {
        BlockKeys keys;
        for (std::size_t i = 0; i < kBlock; ++i) {
            const V3f v = x_ - V3f(block.x[i], block.y[i], block.z[i]);
            keys[i] = (*this)(PackedDirection::along(block.payload[i]), v.length2());
        }
        return keys;
    }
    Node8Keys bounds(const BoxNode8& node) const { return box_distances2(node, x_); }

  private:
    V3f x_, n_;
    float cosine2_;
};

// Measures the squared distance alone.
class SpaceMeasure {
  public:
    explicit SpaceMeasure(const V3f& x) : x_(x) {}

    BlockKeys keys(const PointBlock& block) const {
        BlockKeys keys;
        for (std::size_t i = 0; i < kBlock; ++i) {
            keys[i] = (x_ - V3f(block.x[i], block.y[i], block.z[i])).length2();
        }
        return keys;
    }
    Node8Keys bounds(const BoxNode8& node) const { return box_distances2(node, x_); }

  private:
    V3f x_;
};

class BoxTreeIndex final : public PhotonIndex {
  public:
    BoxTreeIndex(std::span<const V3f> positions, std::span<const std::uint32_t> directions,
                 const Workers& workers)
        : tree_(build_box_tree(positions, directions, workers, PackedDirection::along)) {}

    void nearest(const V3f&, const TangentMetric& metric, Nearest& found) const override {
        nearest_by(metric, found);
    }
    void within(const V3f&, const TangentMetric& metric, float most2,
                std::vector<Neighbour>& found) const override {
        within_by(metric, most2, found);
    }
    void nearest_in_space(const V3f& x, Nearest& found) const override { nearest_by(SpaceMeasure(x), found); }
    void within_in_space(const V3f& x, float most2, std::vector<Neighbour>& found) const override {
        within_by(SpaceMeasure(x), most2, found);
    }

    std::optional<Neighbour> nearest_facing(const V3f& x, const V3f& n, float cosine,
                                            float most2) const override {
        Neighbour best{kNone, just_below(most2)};
        search_nearest(tree_, FacingMeasure(x, n, cosine), best.key,
                       [&best](const BlockKeys& keys, std::uint32_t first) {
                           for (std::uint32_t i = 0; i < kBlock; ++i) {
                               // NaN keys, of points that do not exist, compare false.
                               if (keys[i] <= best.key) best = std::min(best, Neighbour{first + i, keys[i]});
                           }
                           return best.key;
                       });
        if (best.index == kNone) return std::nullopt;
        return best;
    }

  private:
    template <typename Measure>
    void nearest_by(const Measure& measure, Nearest& found) const {
        search_nearest(tree_, measure, found.bound(), [&found](const BlockKeys& keys, std::uint32_t first) {
            return found.take(keys, first);
        });
    }
    template <typename Measure>
    void within_by(const Measure& measure, float most2, std::vector<Neighbour>& found) const {
        const float bound = just_below(most2);
        search_all(tree_, measure, bound, [&](const BlockKeys& keys, std::uint32_t first) {
            for (std::uint32_t i = 0; i < kBlock; ++i) {
                if (keys[i] <= bound) found.push_back({first + i, keys[i]});
            }
        });
    }

    static constexpr std::uint32_t kNone = 0xffffffffU;
    BoxTree tree_;
};

// Visitor for all queries. `key_of(index, r2)` returns the key of a point, `take(key, index)` handles it and
// returns the bound of the keys, and `ball2(key)` returns the squared radius that holds all keys up to that
// one.
template <typename KeyOf, typename Take, typename Ball>
class Visitor final : public PointVisitor {
  public:
    Visitor(KeyOf key_of, Take take, Ball ball2)
        : key_of_(std::move(key_of)), take_(std::move(take)), ball2_(std::move(ball2)) {}

    float visit(std::uint32_t index, float r2) override {
        // Returns slightly more than the bound, so that ties are seen and decided by index, not by the order
        // of the search.
        return std::nextafter(ball2_(take_(key_of_(index, r2), index)), INFINITY);
    }

  private:
    KeyOf key_of_;
    Take take_;
    Ball ball2_;
};

// Radii above the largest finite one are infinite here, which is harmless.
class OtherTree final : public PhotonIndex {
  public:
    OtherTree(std::unique_ptr<PointTree> tree, std::span<const V3f> positions,
              std::span<const PackedDirection> directions)
        : tree_(std::move(tree)), positions_(positions), directions_(directions.begin(), directions.end()) {}

    void nearest(const V3f& x, const TangentMetric& metric, Nearest& found) const override {
        nearest_by(
            x, found, [&](std::uint32_t i, float r2) { return key(metric, i, r2); },
            [&](float key) { return metric.ball2(key); });
    }
    void within(const V3f& x, const TangentMetric& metric, float most2,
                std::vector<Neighbour>& found) const override {
        within_by(
            x, most2, found, [&](std::uint32_t i, float r2) { return key(metric, i, r2); },
            [&](float key) { return metric.ball2(key); });
    }
    void nearest_in_space(const V3f& x, Nearest& found) const override {
        nearest_by(
            x, found, [](std::uint32_t, float r2) { return r2; }, [](float key) { return key; });
    }
    void within_in_space(const V3f& x, float most2, std::vector<Neighbour>& found) const override {
        within_by(
            x, most2, found, [](std::uint32_t, float r2) { return r2; }, [](float key) { return key; });
    }

    std::optional<Neighbour> nearest_facing(const V3f& x, const V3f& n, float cosine,
                                            float most2) const override {
        const FloatTraps none(kNoFaults);
        const FacingMeasure measure(x, n, cosine);
        Nearest best(1, most2);
        Visitor visitor([&](std::uint32_t i,
                            float r2) { return measure(PackedDirection::along(directions_[i].bits()), r2); },
                        [&](float key, std::uint32_t i) { return best.take(key, i); },
                        [](float key) { return key; });
        tree_->visit_ball(x, most2, visitor);
        const std::span<const Neighbour> found = best.sorted();
        if (found.empty()) return std::nullopt;
        return found.front();
    }

  private:
    template <typename KeyOf, typename Ball>
    void nearest_by(const V3f& x, Nearest& found, KeyOf key_of, Ball ball2) const {
        const FloatTraps none(kNoFaults);
        Visitor visitor(
            key_of, [&](float key, std::uint32_t i) { return found.take(key, i); }, ball2);
        tree_->visit_ball(x, std::nextafter(ball2(found.bound()), INFINITY), visitor);
    }
    template <typename KeyOf, typename Ball>
    void within_by(const V3f& x, float most2, std::vector<Neighbour>& found, KeyOf key_of, Ball ball2) const {
        const FloatTraps none(kNoFaults);
        const float bound = just_below(most2);
        const auto before = static_cast<std::ptrdiff_t>(found.size());
        Visitor visitor(
            key_of,
            [&](float key, std::uint32_t i) {
                if (key <= bound) found.push_back({i, key});
                return bound;
            },
            ball2);
        tree_->visit_ball(x, std::nextafter(ball2(bound), INFINITY), visitor);
        std::sort(found.begin() + before, found.end(),
                  [](const Neighbour& a, const Neighbour& b) { return a.index < b.index; });
    }

    float key(const TangentMetric& metric, std::uint32_t i, float r2) const {
        return metric(positions_[i], PackedDirection::along(directions_[i].bits()), r2);
    }

    std::unique_ptr<PointTree> tree_;
    std::span<const V3f> positions_;
    std::vector<PackedDirection> directions_;
};

}  // namespace

std::unique_ptr<PhotonIndex> make_photon_index(IndexKind kind, std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions,
                                               const Workers& workers) {
    if (kind == IndexKind::flann) {
        return make_photon_index(make_flann_tree(positions), positions, directions);
    }
    std::vector<std::uint32_t> payloads(directions.size());
    std::transform(directions.begin(), directions.end(), payloads.begin(),
                   [](PackedDirection d) { return d.bits(); });
    return std::make_unique<BoxTreeIndex>(positions, payloads, workers);
}

std::unique_ptr<PhotonIndex> make_photon_index(std::unique_ptr<PointTree> tree,
                                               std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions) {
    return std::make_unique<OtherTree>(std::move(tree), positions, directions);
}

NearPhotons::NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k,
                         float most2)
    : nearest_(std::min(k, map.size()) + 1, most2), radius2_(most2) {  // one more than k, to fix the radius
    map.index().nearest(x, metric, nearest_);
    found_ = nearest_.sorted();
    if (found_.size() > std::min(k, map.size())) {
        radius2_ = found_.back().key;
        found_ = found_.first(found_.size() - 1);
    }
}

}  // namespace lucerna
