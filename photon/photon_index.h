// Points in space, each with a direction, and the questions that photon mapping asks of them.
//
// Two implementations give the same answers, bit for bit: our tree, which filters whole blocks of photons
// during the search, and any PointTree (FLANN's, or the one that looks at every point), which filters them
// one by one.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kdtree/nearest.h"
#include "kdtree/point_tree.h"
#include "photon/photon.h"
#include "photon/tangent_metric.h"

namespace lucerna {

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

}  // namespace lucerna
