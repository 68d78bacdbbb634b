// Photons of one class and the index over them. Born complete, constant ever after.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "photon/photon.h"
#include "photon/photon_index.h"

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
    // A photon of `power` [W] that travels along d and lands on a surface: on the side that it hits.
    void add_hit(const SurfacePoint& at, const V3f& d, const Rgb& power, std::uint32_t light, CellId cell) {
        add(at.p, PackedDirection(at.n.dot(d) > 0 ? -at.n : at.n), {PackedDirection(d), power, light, cell});
    }
};

class PhotonMap {
  public:
    // They are kept in an order of the map's own, the same for either index and any number of threads: that
    // of `box_order`. A map made of another's photons has the other's order.
    explicit PhotonMap(const Photons& landed, IndexKind index = IndexKind::tree, const Workers& workers = {});

    std::span<const V3f> positions() const { return all_.positions; }
    std::span<const PackedDirection> normals() const { return all_.normals; }
    std::span<const Photon> photons() const { return all_.photons; }
    const PhotonIndex& index() const { return *index_; }
    IndexKind index_kind() const { return kind_; }
    std::size_t size() const { return all_.size(); }

  private:
    Photons all_;
    IndexKind kind_;
    std::unique_ptr<PhotonIndex> index_;  // may point into the positions, whose buffer moves with the map
};

}  // namespace lucerna
