// Photons of one class and the index over them. Born complete, constant ever after.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kdtree/point_tree.h"
#include "photon/photon.h"

namespace lucerna {

class PhotonMap {
  public:
    PhotonMap(std::vector<V3f> positions, std::vector<Photon> photons)
        : positions_(std::move(positions)), photons_(std::move(photons)), tree_(make_flann_tree(positions_)) {}

    std::span<const V3f> positions() const { return positions_; }
    std::span<const Photon> photons() const { return photons_; }
    const PointTree& tree() const { return *tree_; }
    std::size_t size() const { return photons_.size(); }

  private:
    std::vector<V3f> positions_;
    std::vector<Photon> photons_;
    std::unique_ptr<PointTree> tree_;  // points into positions_, whose buffer moves with the map
};

}  // namespace lucerna
