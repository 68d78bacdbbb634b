// Photons of one class and the index over them. Born complete, constant ever after.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kdtree/point_tree.h"
#include "photon/photon.h"

namespace lucerna {

// Photons as they land: one entry each in three arrays.
struct Photons {
    std::vector<V3f> positions;            // finite, relative to the scene's origin
    std::vector<PackedDirection> normals;  // geometric, on the side that was hit; of no meaning in media
    std::vector<Photon> photons;

    std::size_t size() const { return photons.size(); }
    void reserve(std::size_t n) {
        positions.reserve(n);
        normals.reserve(n);
        photons.reserve(n);
    }
    void add(const V3f& position, const PackedDirection& normal, const Photon& photon) {
        positions.push_back(position);
        normals.push_back(normal);
        photons.push_back(photon);
    }
};

class PhotonMap {
  public:
    // They are kept in an order of the map's own.
    explicit PhotonMap(const Photons& landed);

    std::span<const V3f> positions() const { return all_.positions; }
    std::span<const PackedDirection> normals() const { return all_.normals; }
    std::span<const Photon> photons() const { return all_.photons; }
    const PointTree& tree() const { return *tree_; }
    std::size_t size() const { return all_.size(); }

  private:
    Photons all_;
    std::unique_ptr<PointTree> tree_;  // points into the positions, whose buffer moves with the map
};

}  // namespace lucerna
