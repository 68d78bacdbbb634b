// Traces several light paths at a time, one segment of each in turn: while one ray is traced, memory fetches
// the data of the hits before.
//
// A light path waits for memory at every surface, for the triangle's corners and then for its shading data.
// The waits of one path follow each other; those of several paths overlap. The paths, their random numbers
// and their ends are those of trace_light_path(); only the order in which visitors see them differs, because
// the paths of a group take turns.
#pragma once

#include <array>
#include <cassert>
#include <optional>

#include "photon/light_path.h"

namespace lucerna {

template <typename Visitor>
class LightPathGroup {
  public:
    // All three must outlive it.
    LightPathGroup(const Scene& scene, const LightPathLimits& limits, Visitor& visitor)
        : scene_(scene), limits_(limits), visitor_(visitor) {
        for (std::uint32_t i = 0; i < kSize; ++i) order_[i] = i;
    }

    // Starts a path; if the group is full, follows the others until one of them ends.
    void add(const LightPathStart& start, const Sampler& sampler) {
        while (under_way_ == kSize) step();
        slots_[order_[under_way_++]].emplace(scene_, start, sampler, visitor_.ledger, limits_.specular_below);
    }
    // Follows all paths to their ends. Must be called before the group is destroyed.
    void finish() {
        while (under_way_ > 0) step();
    }

    // More paths bring no gain; the prefetched cache lines stay well within the L1 cache.
    static constexpr std::uint32_t kSize = 16;

  private:
    // Cannot be moved, because the light path refers to the sampler.
    struct Slot {
        Slot(const Scene& scene, const LightPathStart& at, const Sampler& numbers, Ledger& ledger,
             float below)
            : start(at), sampler(numbers), light_path(scene, start, sampler, ledger, below) {}
        Slot(Slot&&) = delete;
        Slot& operator=(Slot&&) = delete;

        LightPathStart start;
        Sampler sampler;
        LightPath light_path;
        int segments = 0;
    };

    // Follows one segment of every path. Short loops give the processor steps of several paths to execute
    // while one path waits for a square root, a quotient or a mispredicted branch.
    void step() {
        const std::uint32_t count = under_way_;
        for (std::uint32_t i = 0; i < count; ++i) rays_[i] = slots_[order_[i]]->light_path.ray();
        scene_.closest_hits({rays_.data(), count}, {closest_.data(), count});
        for (std::uint32_t i = 0; i < count; ++i) {
            if (closest_[i]) scene_.prefetch_vertices(*closest_[i]);
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            hits_[i].reset();
            if (closest_[i]) scene_.intersect(rays_[i], *closest_[i], hits_[i].emplace());
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            LightPath& path = slots_[order_[i]]->light_path;
            scattered_[i] = path.propagate(rays_[i], hits_[i]);
            bsdfs_[i].reset();
            if (is_at_surface(path, hits_[i], scattered_[i])) bsdfs_[i].emplace(BsdfAt{scene_, *hits_[i]});
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            if (bsdfs_[i]) samples_[i] = slots_[order_[i]]->light_path.sample(*bsdfs_[i]);
        }
        // Moves the slots of ended paths behind the others, whose order stays.
        std::array<std::uint32_t, kSize> ended;
        std::uint32_t going_on = 0, ends = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t slot = order_[i];
            if (finish_segment(*slots_[slot], i)) {
                order_[going_on++] = slot;
            } else {
                ended[ends++] = slot;
            }
        }
        for (std::uint32_t i = 0; i < ends; ++i) order_[going_on + i] = ended[i];
        under_way_ = going_on;
    }

    // Converts to a Bsdf, which is thus constructed in place.
    struct BsdfAt {
        const Scene& scene;
        const Hit& hit;
        operator Bsdf() const { return scene.bsdf(hit); }
    };

    // Finishes segment i of this step. Returns false if the path has ended.
    bool finish_segment(Slot& slot, std::uint32_t i) {
        const bool goes_on = bsdfs_[i]
                                 ? interact_at_surface(slot.light_path, *hits_[i], *bsdfs_[i], samples_[i],
                                                       slot.start, visitor_)
                                 : interact_elsewhere(slot.light_path, scattered_[i], slot.start, visitor_);
        return goes_on && is_followed(slot.light_path, limits_, ++slot.segments, visitor_.ledger);
    }

    const Scene& scene_;
    const LightPathLimits& limits_;
    Visitor& visitor_;
    std::array<std::optional<Slot>, kSize> slots_;
    std::array<std::uint32_t, kSize> order_;  // of slots: first those in use, then the free ones
    std::uint32_t under_way_ = 0;
    // Rays and hits of the segments of this step, in their order.
    std::array<Ray, kSize> rays_;
    std::array<std::optional<ClosestHit>, kSize> closest_;
    std::array<std::optional<Hit>, kSize> hits_;
    std::array<std::optional<MediaTraversal::Scattered>, kSize> scattered_;
    std::array<std::optional<Bsdf>, kSize> bsdfs_;  // set if the segment ends at a surface
    std::array<std::optional<BsdfSample>, kSize> samples_;
};

}  // namespace lucerna
