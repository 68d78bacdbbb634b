// Divides the value of an estimate among its photons, by whether their paths have strayed from perfectly
// specular surfaces and by light group. The shares of layers are the same, bit for bit, whether groups are
// wanted or not.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/scene/path_account.h"
#include "photon/photon.h"

namespace lucerna {

class PhotonShares {
  public:
    // Distinguishes photons as `path` does, which must outlive this.
    explicit PhotonShares(const PathAccount& path) : path_(path) {}

    // Adds the contribution of a photon, in any unit.
    void add(std::uint32_t light, bool strayed, const Rgb& brought) {
        by_straying_[strayed ? 1 : 0] += V3d(brought);
        if (!path_.has_groups()) return;
        const std::uint32_t group = path_.group_of(light);
        for (Share& share : by_group_) {
            if (share.group == group) {
                share.sum += V3d(brought);
                return;
            }
        }
        by_group_.push_back({group, light, V3d(brought)});
    }

    // Returns the part of `value` from photons that have strayed, or from those that have not.
    Rgb part(const Rgb& value, bool strayed) const { return share_of(value, by_straying_[strayed ? 1 : 0]); }
    // Books `value` by light group only.
    void book_groups(const Rgb& value) const {
        for (const Share& share : by_group_) path_.add_to_group(share_of(value, share.sum), share.light);
    }

  private:
    struct Share {
        std::uint32_t group, light;
        V3d sum;
    };
    Rgb share_of(const Rgb& value, const V3d& sum) const {
        const V3d all = by_straying_[0] + by_straying_[1];
        Rgb part(0.0F);
        for (int c = 0; c < 3; ++c) {
            if (all[c] > 0) part[c] = static_cast<float>(double{value[c]} * (sum[c] / all[c]));
        }
        return part;
    }

    const PathAccount& path_;
    std::array<V3d, 2> by_straying_{V3d(0.0), V3d(0.0)};  // of photons that have not strayed, and that have
    std::vector<Share> by_group_;
};

}  // namespace lucerna
