// Integrates what every filter transmits to one point of M: the inner half of the virtual acquisition.
#pragma once

#include <vector>

#include "lights/light_field.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/opacity.h"

namespace lucerna {

// Sums ∫∫ max(0, ±Φ̃_m Φ̃_n) L g du dv over points of M, for a block of filters. Not thread-safe.
class PointIntegral {
  public:
    PointIntegral(const EmitterModel& emitter, const Rig& rig, int rule);

    // Starts a new sum, with filters [first, last] of each axis.
    void begin(const V2i& first, const V2i& last);
    // Adds `weight` times the integrals at a point of M.
    void add(const V2d& on_m, double weight);
    // Return the sums for a filter of the block. For several colours, channels 0, 1 and 2 are X, Y and Z.
    double positive(int m, int n, std::size_t channel = 0) const {
        return positive_[channel * block_ + slot(m, n)];
    }
    double negative(int m, int n, std::size_t channel = 0) const {
        return negative_[channel * block_ + slot(m, n)];
    }

  private:
    struct Range {
        double from, to;
    };
    // A row between two ends, each of which is fixed or moves with the emitter's outline.
    struct Chord {
        double from_edge, to_edge;    // fixed ends [m]
        bool moving_from, moving_to;  // the end is instead the outline's left or right one
    };

    std::size_t slot(int m, int n) const {
        return static_cast<std::size_t>(n - origin_.y) * width_ + static_cast<std::size_t>(m - origin_.x);
    }
    void add_rectangle();
    void add_disc();
    void add_disc_panel(int k);
    void add_cut(const Range& v, const Chord& chord);
    // Adds one row of S: the light of `u_` at height v, weighted by the node's filters.
    void add_row(const FilterNode& v);
    template <std::size_t kChannels>
    void add_row_of(const FilterNode& v);

    const EmitterModel& emitter_;
    const Rig& rig_;
    int rule_;
    FilterAxis axis_[2];
    V2i origin_{0, 0};  // filter of slot 0; a margin surrounds the block
    std::size_t channels_ = 1;
    std::size_t width_ = 0;  // slots per row of filters
    std::size_t block_ = 0;  // slots of one channel
    Range reach_[2]{};       // of the block's filters on S
    V2d on_m_{0, 0};
    double weight_ = 0;
    double share_ = 0;               // position of S from the emitter to M: setback / (setback + D)
    V2d centre_{0, 0}, half_{0, 0};  // the emitter's outline as seen from the point, projected on S
    std::vector<FilterNode> u_, v_;
    std::vector<double> cuts_;
    std::vector<double> row_positive_, row_negative_;  // sums of one row of S, per channel and filter along u
    std::vector<double> positive_, negative_;          // per channel and slot
};

}  // namespace lucerna
