// Stores VPLs during rendering, in blocks of sixteen with each component side by side, so that the
// contributions of a whole block are estimated at once (vpl_contribution.h).
//
// Within a set the lights are in the order of a kd-tree over their positions and normals: neighbours in
// memory shine from the same region in similar directions. Lights on surfaces come first, then those in
// media; no block mixes the two.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/vpl/vpl.h"
#include "kdtree/box_tree.h"

namespace lucerna {

// Holds sixteen lights. Unused lanes hold black lights at the position of the block's first.
struct alignas(64) VplBlock {
    using Lane = std::array<float, kBlock>;
    Lane x, y, z;     // scene units
    Lane nx, ny, nz;  // on a surface the normal, on the side that shines; in a medium the direction of travel
    Lane r, g, b;     // Vpl's contribution
    Lane more;        // on a surface SurfacePoint's error; in a medium the phase function's g
};

// Delimits the blocks of one set.
struct VplRange {
    std::uint32_t surfaces = 0, media = 0, end = 0;  // [surfaces, media) on surfaces, [media, end) in media
};

class VplStore {
  public:
    VplStore() = default;
    VplStore(const VplSets& sets, const Workers& workers);

    std::size_t sets() const { return ranges_.size(); }
    const VplRange& range(std::size_t set) const { return ranges_[set]; }
    const std::vector<VplBlock>& blocks() const { return blocks_; }

    // Returns a light by its place: kBlock · its block + its lane.
    Vpl light(const VplRange& range, std::uint32_t place) const;

    // Returns Vpl::bounces by place, apart from the blocks because the choice of lights does not read it.
    BounceCount bounces(std::uint32_t place) const { return bounces_[place]; }

    std::size_t lights() const { return lights_; }
    // Returns 1 / mean luminance of the contributions. It keeps contribution estimates near 1 whatever the
    // lamps' unit.
    float unit() const { return unit_; }
    std::size_t bytes() const {
        return blocks_.size() * sizeof(VplBlock) + bounces_.size() + origins_.size() * sizeof(origins_[0]) +
               ranges_.size() * sizeof(VplRange);
    }

  private:
    std::vector<VplBlock> blocks_;
    std::vector<BounceCount> bounces_;
    // Holds Vpl::light by place, which is read of selected lights only. It is empty where all are 0.
    std::vector<std::uint32_t> origins_;
    std::vector<VplRange> ranges_;
    std::size_t lights_ = 0;
    float unit_ = 1;
};

}  // namespace lucerna
