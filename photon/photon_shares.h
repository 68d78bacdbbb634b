// Which photons an estimate's value came from: by whether they have strayed from mirrors and glass, and by
// light group. Shares of the value rather than sums of their own, which would round differently: parts add up
// to what the image shows.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/light_parts.h"
#include "photon/photon.h"

namespace lucerna {

class PhotonShares {
  public:
    // Shares as `parts` tells them apart.
    explicit PhotonShares(const PartsSink& parts) : parts_(parts) {}

    // A photon that counts, and what it brings, in any unit.
    void add(std::uint32_t light, bool strayed, const Rgb& brought) {
        const std::uint32_t group = parts_.group_of(light);
        for (Share& share : shares_) {
            if (share.group != group || share.strayed != strayed) continue;
            share.sum += V3d(brought);
            return;
        }
        shares_.push_back({group, light, strayed, V3d(brought)});
    }

    // Calls tell(part of the value, some light of its group, strayed) for each.
    template <typename Tell>
    void share_out(const Rgb& value, Tell&& tell) const {
        V3d all(0.0);
        for (const Share& share : shares_) all += share.sum;
        for (const Share& share : shares_) {
            Rgb part(0.0F);
            for (int c = 0; c < 3; ++c) {
                if (all[c] > 0) part[c] = static_cast<float>(double{value[c]} * (share.sum[c] / all[c]));
            }
            tell(part, share.light, share.strayed);
        }
    }

  private:
    struct Share {
        std::uint32_t group, light;
        bool strayed;
        V3d sum;
    };
    PartsSink parts_;
    std::vector<Share> shares_;
};

}  // namespace lucerna
