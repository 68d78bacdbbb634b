// Photons of one class and the index over them. Born complete, constant ever after.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "kdtree/nearest.h"
#include "kdtree/point_tree.h"
#include "photon/photon.h"
#include "photon/tangent_metric.h"

namespace lucerna {

// Points in space, each with a direction, and the questions that photon mapping asks of them.
//
// Two implementations give the same answers, bit for bit: our tree, which filters whole blocks of photons
// during the search, and any PointTree (FLANN's, or the one that looks at every point), which filters them
// one by one.

enum class IndexKind : std::uint8_t { tree, flann };

// Queries are const and safe from any thread.
class PhotonIndex {
  public:
    virtual ~PhotonIndex() = default;

    // Offers to `found` every photon that may be among the k nearest to x, which is the metric's own point.
    // Photons on the wrong side never shrink the radius.
    virtual void nearest(const V3f& x, const TangentMetric& metric, Nearest& found) const = 0;

    // Appends all photons of squared distance below `most2` > 0, in the order of their indices.
    virtual void within(const V3f& x, const TangentMetric& metric, float most2,
                        std::vector<Neighbour>& found) const = 0;

    // Both for photons in media, by distance in space, whatever their directions.
    virtual void nearest_in_space(const V3f& x, Nearest& found) const = 0;
    virtual void within_in_space(const V3f& x, float most2, std::vector<Neighbour>& found) const = 0;

    // The nearest in space, below `most2` > 0, of those whose direction and n (unit) have a cosine above
    // `cosine` (0 to 1); ties by index. Its key is the squared distance.
    virtual std::optional<Neighbour> nearest_facing(const V3f& x, const V3f& n, float cosine,
                                                    float most2) const = 0;
};

// The points' directions: of travel, or of a normal. A tree is fast for points in `box_order`, as a photon
// map keeps them, and right for any. Positions are finite.
std::unique_ptr<PhotonIndex> make_photon_index(IndexKind kind, std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions,
                                               const Workers& workers);
// The same over a tree of another make. `positions` are those of the tree, and must outlive the index.
std::unique_ptr<PhotonIndex> make_photon_index(std::unique_ptr<PointTree> tree,
                                               std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions);

// How often a photon's path has bounced before it, as photons keep it: at most kMostKeptBounces, which stands
// for all above it.
using BounceCount = std::uint8_t;
inline constexpr int kMostKeptBounces = 255;
inline BounceCount kept_bounces(std::uint32_t bounces) {
    return static_cast<BounceCount>(std::min<std::uint32_t>(bounces, kMostKeptBounces));
}

// Photons as light paths deposit them: one entry each in four arrays.
struct Photons {
    std::vector<V3f> positions;  // finite, relative to the scene's origin
    // Geometric, on the side that was hit; of no meaning in media. Estimates do not compare them: a photon's
    // direction says which side it hit. Read where rays leave from photons, and where values are cached.
    std::vector<PackedDirection> normals;
    std::vector<Photon> photons;
    std::vector<BounceCount> bounces;  // before; read where paths may not be longer than so much

    std::size_t size() const { return photons.size(); }
    void reserve(std::size_t n) {
        positions.reserve(n);
        normals.reserve(n);
        photons.reserve(n);
        bounces.reserve(n);
    }
    void resize(std::size_t n) {
        positions.resize(n);
        normals.resize(n);
        photons.resize(n);
        bounces.resize(n);
    }
    void add(const V3f& position, const PackedDirection& normal, const Photon& photon,
             std::uint32_t bounced = 0) {
        positions.push_back(position);
        normals.push_back(normal);
        photons.push_back(photon);
        bounces.push_back(kept_bounces(bounced));
    }
    template <typename Archive>
    void fields(Archive& archive) {
        archive(positions, normals, photons, bounces);
    }
    void append(const Photons& more) {
        positions.insert(positions.end(), more.positions.begin(), more.positions.end());
        normals.insert(normals.end(), more.normals.begin(), more.normals.end());
        photons.insert(photons.end(), more.photons.begin(), more.photons.end());
        bounces.insert(bounces.end(), more.bounces.begin(), more.bounces.end());
    }
    // A photon of `power` [W] that travels along d and lands on a surface: on the side that it hits.
    void add_hit(const SurfacePoint& at, const V3f& d, const Rgb& power, std::uint32_t light, CellId cell,
                 std::uint32_t bounced = 0, bool strayed = false) {
        add(at.p, PackedDirection(face_forward(at.n, -d)), {PackedDirection(d), power, light, cell, strayed},
            bounced);
    }
};

class PhotonMap {
  public:
    // They are kept in an order of the map's own, the same for either index and any number of threads: that
    // of `box_order`. A map made of another's photons has the other's order.
    explicit PhotonMap(const Photons& deposited, IndexKind index = IndexKind::tree,
                       const Workers& workers = {});

    std::span<const V3f> positions() const { return all_.positions; }
    std::span<const PackedDirection> normals() const { return all_.normals; }
    std::span<const Photon> photons() const { return all_.photons; }
    std::span<const BounceCount> bounces() const { return all_.bounces; }
    // The largest of them; 0 of an empty map.
    int deepest() const { return deepest_; }
    const PhotonIndex& index() const { return *index_; }
    IndexKind index_kind() const { return kind_; }
    std::size_t size() const { return all_.size(); }

  private:
    Photons all_;
    int deepest_ = 0;
    IndexKind kind_;
    std::unique_ptr<PhotonIndex> index_;  // may point into the positions, whose buffer moves with the map
};

// The photons near a point: the one search that every estimate, gate and guide is made of.

// The k nearest photons by the tangent metric, and what radius they fill. Searched on construction; for one
// thread, on its stack.
class NearPhotons {
  public:
    // k >= 1; `most2` > 0 is the largest squared distance. `x` is the metric's own point.
    NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k, float most2);

    // Nearest first; ties by index, so that the order, and what is summed in it, does not depend on the
    // search. Keys are squared distances.
    std::span<const Neighbour> found() const { return found_; }
    // The squared distance of the next one beyond the k; `most2` if there are no more than k.
    float radius2() const { return radius2_; }

  private:
    Nearest nearest_;
    std::span<const Neighbour> found_;
    float radius2_;
};

}  // namespace lucerna
