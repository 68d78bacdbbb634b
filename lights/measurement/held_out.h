// How far the light that a fitted field casts is from the lamp's: on planes from contact to the far field.
//
// Half of the rays make a field; the other half, which it does not know, say what it should cast, counted
// into the cells of a grid on every plane. The mean square of the difference is the field's bias (blur), its
// own noise and the counts' noise; two fields from two halves tell the noise from the bias, so that the error
// of the field that all rays make can be stated [Stone 1974].
//
// An estimate by rays that a choice was made by is biased. The least of many estimates is too small, because
// it was chosen for its noise, too; and a cell's weight depends on the rays that are counted in it, which
// makes errors too large where cells have few rays. So the estimates that choose a resolution are not those
// that are stated: another part of the rays, by which no choice was made, says these (held_out_parts), with
// the planes, cells and weights of the part that chose.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "lights/measurement/ray_passage.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {

class HeldOutRays {
  public:
    // Judges by `rays` the field that `all` rays make, of which they may be a part. `height` of S in the
    // frame of the rays. Of more rays than are needed some are taken. Keeps a reference to the set.
    HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all, double height);

    // The same on the planes, cells and weights of `like`, which is of other rays of the lamp. Weights from
    // the counts that they weigh would favour cells by chance where a cell has few rays.
    HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all,
                const HeldOutRays& like);

    // The errors of the field that all rays make on `rig`, plane by plane, before its light is clamped. The
    // square of the error that clamping adds on each plane, and the share of the light that the field holds,
    // are those of the field that these rays make, which are fewer and have more noise.
    struct Found {
        std::vector<PlaneError> errors;
        double clamped = 0;
        double held = 0;
    };
    Found find_errors(const Rig& rig, const RayWeights& weights, const Workers& workers) const;

    // Of a field made of other rays, as it is emitted, against all of these.
    std::vector<PlaneError> errors(const LightField& field) const;

    // Per axis: where half of the flux passes S to either side, and the half width of the strip about it that
    // holds half of it [m].
    V2d middle_on_s() const { return planes_.front().middle; }
    V2d half_on_s() const { return planes_.front().half; }
    // The same of the slopes dx/dz and dy/dz.
    V2d half_slopes() const { return planes_.back().half; }

  private:
    static constexpr int kCells = 48;  // per side of a plane's grid: coarser is not seen, finer is noise
    static constexpr std::size_t kAll = std::size_t{kCells} * kCells;

    // A plane's grid: even in a coordinate about the middle of its light, so that it has fine cells where
    // there is most and covers all of the plane.
    struct Plane {
        double distance;  // from S; INFINITY: by direction, in slopes
        V2d middle, half;
        std::vector<double> edges[2];    // kCells + 1 places, relative to `middle`
        std::vector<double> counted[2];  // flux per cell, [x * kCells + y], of either half of the rays
        std::vector<double> weight;      // of a cell's squared difference
        double signal = 0;               // Σ weight times the two halves' product
    };
    void take_rays(std::span<const std::size_t> rays, std::size_t all);
    Plane make_plane(double distance) const;
    void count_rays(Plane& plane) const;  // into its cells
    static void find_signal(Plane& plane);
    // What a ray counts for: its flux, or of rays in colour the mean of its X, Y and Z, each as a share of
    // all rays', as the field's sampled channel is made (ColourChannels).
    double light_of(std::size_t ray) const {
        const double flux = double{set_.rays[ray].flux};
        return set_.coloured() ? flux * channel_weight_.dot(V3d(set_.tristimulus[ray])) : flux;
    }
    V2d place_of(const LampRay& ray, double distance) const;
    std::vector<double> project_half(const Rig& rig, const RayWeights& weights, int half) const;
    std::vector<std::vector<double>> cast(std::span<const std::vector<double>> fields, const Rig& rig,
                                          const Plane& plane) const;

    const RaySet& set_;
    std::vector<std::size_t> rays_;  // those taken
    std::vector<std::size_t> halves_[2];
    // The variance of a half's field over that of the lamp's, which is made of so many times as many rays.
    double half_over_all_variance_ = 2;
    double light_ = 0;  // of those taken
    double height_ = 0;
    V3d channel_weight_{0, 1, 0};
    std::vector<Plane> planes_;  // the first is S itself
};

// Adds to errors what clamping adds to those of `field`.
void add_clamping(std::vector<PlaneError>& errors, const LightField& field);

// The sum over planes of what they are off, squared: what the choice of a resolution makes least.
double total_error(std::span<const PlaneError> errors);

}  // namespace lucerna
