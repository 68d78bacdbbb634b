// Photons of one class and the index over them, complete on construction and constant thereafter.
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

// Points in space, each with a direction, and the queries of photon mapping over them.
//
// The two implementations give the same results, bit for bit: Lucerna's own tree, which filters whole blocks
// of photons during the search, and any PointTree (FLANN's or the brute-force one), whose results are
// filtered one by one.

enum class IndexKind : std::uint8_t { tree, flann };

// Queries are const and safe from any thread.
class PhotonIndex {
  public:
    virtual ~PhotonIndex() = default;

    // Offers to `found` every photon that may be among the k nearest to x, which is the metric's own point.
    // Photons on the wrong side do not reduce the radius.
    virtual void nearest(const V3f& x, const TangentMetric& metric, Nearest& found) const = 0;

    // Appends all photons of squared distance below `most2` > 0, in the order of their indices.
    virtual void within(const V3f& x, const TangentMetric& metric, float most2,
                        std::vector<Neighbour>& found) const = 0;

    // The same two queries for photons in media, by distance in space, whatever their directions.
    virtual void nearest_in_space(const V3f& x, Nearest& found) const = 0;
    virtual void within_in_space(const V3f& x, float most2, std::vector<Neighbour>& found) const = 0;

    // Returns the nearest point in space, at a squared distance below `most2` > 0, whose direction makes a
    // cosine above `cosine` (0 to 1) with n (unit); ties are decided by index. Its key is the squared
    // distance.
    virtual std::optional<Neighbour> nearest_facing(const V3f& x, const V3f& n, float cosine,
                                                    float most2) const = 0;
};

// Builds an index. Directions are those of travel, or normals. The tree is fast for points in `box_order`, as
// a photon map keeps them, and correct for any order. Positions must be finite.
std::unique_ptr<PhotonIndex> make_photon_index(IndexKind kind, std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions,
                                               const Workers& workers);
// Builds an index over another kind of tree. `positions` are those of the tree and must outlive the index.
std::unique_ptr<PhotonIndex> make_photon_index(std::unique_ptr<PointTree> tree,
                                               std::span<const V3f> positions,
                                               std::span<const PackedDirection> directions);

// Number of bounces of a photon's path before it, as stored: at most kMostKeptBounces, which stands for all
// larger numbers.
using BounceCount = std::uint8_t;
inline constexpr int kMostKeptBounces = 255;
inline BounceCount kept_bounces(std::uint32_t bounces) {
    return static_cast<BounceCount>(std::min<std::uint32_t>(bounces, kMostKeptBounces));
}

// Photons as light paths deposit them, as four arrays with one entry for each photon.
struct Photons {
    std::vector<V3f> positions;  // finite, relative to the scene's origin
    // Geometric normals on the side that was hit; meaningless in media. Density estimates do not compare
    // them, since a photon's direction tells which side it hit. They are used where rays leave from photons
    // and where values are cached.
    std::vector<PackedDirection> normals;
    std::vector<Photon> photons;
    std::vector<BounceCount> bounces;  // before the photon; used where path lengths are limited

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
    // Adds a photon of `power` [W] that travels along d and hits a surface; its normal is on the side that it
    // hits.
    void add_hit(const SurfacePoint& at, const V3f& d, const Rgb& power, std::uint32_t light, CellId cell,
                 std::uint32_t bounced = 0, bool strayed = false) {
        add(at.p, PackedDirection(face_forward(at.n, -d)), {PackedDirection(d), power, light, cell, strayed},
            bounced);
    }
};

class PhotonMap {
  public:
    // Keeps the photons in `box_order`, which is the same for either index and any number of threads. A map
    // made from another map's photons keeps their order.
    explicit PhotonMap(const Photons& deposited, IndexKind index = IndexKind::tree,
                       const Workers& workers = {});

    std::span<const V3f> positions() const { return all_.positions; }
    std::span<const PackedDirection> normals() const { return all_.normals; }
    std::span<const Photon> photons() const { return all_.photons; }
    std::span<const BounceCount> bounces() const { return all_.bounces; }
    // Returns the largest number of bounces, or 0 for an empty map.
    int deepest() const { return deepest_; }
    const PhotonIndex& index() const { return *index_; }
    IndexKind index_kind() const { return kind_; }
    std::size_t size() const { return all_.size(); }

  private:
    Photons all_;
    int deepest_ = 0;
    IndexKind kind_;
    std::unique_ptr<PhotonIndex> index_;  // may refer to the positions, whose buffer moves with the map
};

// Finds the k nearest photons by the tangent metric and their radius, on construction, for estimates, guides
// and pre-passes. Used by one thread, on its stack.
class NearPhotons {
  public:
    // k >= 1; `most2` > 0 is the largest squared distance. `x` is the metric's own point.
    NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k, float most2);

    // Returns the photons, nearest first, with ties in order of index, so that the order, and sums in that
    // order, do not depend on the search. Keys are squared distances.
    std::span<const Neighbour> found() const { return found_; }
    // Returns the squared distance of the next photon beyond the k, or `most2` if there are no more than k.
    float radius2() const { return radius2_; }

  private:
    Nearest nearest_;
    std::span<const Neighbour> found_;
    float radius2_;
};

}  // namespace lucerna
