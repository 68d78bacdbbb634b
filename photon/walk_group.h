// Several light paths at a time, each a leg in turn: while one ray is traced, memory brings what the last
// ones met.
//
// A walk waits for memory at every surface: for the triangle's corners, then for what stands at them. Of one
// path each wait follows from the last; of many they overlap. The paths, their numbers and their ends are
// those of walk(); only the order in which visitors see them differs: paths that are under way together take
// turns. Those that are of no more use (PathUse) end at a bounce, and the ledger says what they carried.
#pragma once

#include <array>
#include <cassert>
#include <optional>

#include "photon/walk.h"

namespace lucerna {

// Calls its visitors as walk() does.
template <typename Visit, typename Scatter, typename Leave>
class WalkGroup {
  public:
    WalkGroup(const Scene& scene, Ledger& ledger, Visit visit, Scatter scatter, Leave leave,
              float specular_below, PathUse use = PathUse::all)
        : scene_(scene),
          ledger_(ledger),
          visit_(std::move(visit)),
          scatter_(std::move(scatter)),
          leave_(std::move(leave)),
          specular_below_(specular_below),
          use_(use) {
        for (std::uint32_t i = 0; i < kSize; ++i) order_[i] = i;
    }

    // Sets out on a path; all that are under way go on until there is room for it.
    void add(const LightPathStart& start, const Stream& stream) {
        while (under_way_ == kSize) step();
        slots_[order_[under_way_++]].emplace(scene_, start, stream, ledger_, specular_below_);
    }
    // Follows all to their ends. To be called before the group goes.
    void finish() {
        while (under_way_ > 0) step();
    }

    // More bring nothing: the lines that are fetched ahead stay well within the first cache.
    static constexpr std::uint32_t kSize = 16;

  private:
    // Not to be moved: the walker refers to the stream.
    struct Slot {
        Slot(const Scene& scene, const LightPathStart& at, const Stream& numbers, Ledger& ledger, float below)
            : start(at), stream(numbers), walker(scene, start, stream, ledger, below) {}
        Slot(Slot&&) = delete;
        Slot& operator=(Slot&&) = delete;

        LightPathStart start;
        Stream stream;
        Walker walker;
        Ray ray;
        std::optional<Met> met;
        std::uint32_t legs = 0;
    };

    // A leg of every path.
    void step() {
        for (std::uint32_t i = 0; i < under_way_; ++i) {
            Slot& slot = *slots_[order_[i]];
            slot.ray = slot.walker.ray();
            slot.met = scene_.meet(slot.ray);
            if (slot.met) scene_.prefetch_corners(*slot.met);
        }
        for (std::uint32_t i = 0; i < under_way_; ++i) {
            Slot& slot = *slots_[order_[i]];
            if (slot.met) scene_.prefetch_vertices(*slot.met);
        }
        // Those that end make room behind the others, whose order stays.
        std::array<std::uint32_t, kSize> ended;
        std::uint32_t going_on = 0, ends = 0;
        for (std::uint32_t i = 0; i < under_way_; ++i) {
            const std::uint32_t slot = order_[i];
            if (finish_leg(*slots_[slot])) {
                order_[going_on++] = slot;
            } else {
                ended[ends++] = slot;
            }
        }
        for (std::uint32_t i = 0; i < ends; ++i) order_[going_on + i] = ended[i];
        under_way_ = going_on;
    }

    // False: the path has come to its end.
    bool finish_leg(Slot& slot) {
        const auto hit = [&](const Ray& ray) {
            return slot.met ? std::optional<Hit>(scene_.hit(ray, *slot.met)) : std::nullopt;
        };
        const Walker::Leg leg = slot.walker.travel(slot.ray, hit);
        if (!take_leg(scene_, slot.walker, leg, slot.start, ledger_, visit_, scatter_, leave_)) return false;
        if (!is_of_use(slot.walker.path(), use_)) {
            ledger_.not_followed += V3d(slot.walker.power());
            return false;
        }
        if (++slot.legs < kMaxBounces) return true;
        ledger_.cut += V3d(slot.walker.power());
        return false;
    }

    const Scene& scene_;
    Ledger& ledger_;
    Visit visit_;
    Scatter scatter_;
    Leave leave_;
    float specular_below_;
    PathUse use_;
    std::array<std::optional<Slot>, kSize> slots_;
    std::array<std::uint32_t, kSize> order_;  // of slots: first those under way, then those free
    std::uint32_t under_way_ = 0;
};

}  // namespace lucerna
