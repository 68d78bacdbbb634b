// The error of the light that a fitted field casts, on planes from contact to the far field.
//
// Half of the rays make a field; the other half, which that field does not know, is counted into the cells of
// a grid on every plane and gives the true light. The mean squared difference contains the field's bias
// (blur), its own noise and the counts' noise. Two fields from two halves separate noise from bias, so that
// the error of the field of all rays can be stated [Stone 1974].
//
// An estimate from rays that took part in a choice is biased. The least of many estimates is too small,
// because it was chosen for its noise, too. A cell's weight depends on the rays counted in it, which makes
// errors too large where cells have few rays. So the stated estimates are not those that chose the
// resolution: another part of the rays, which took part in no choice, gives them (held_out_parts), with the
// planes, cells and weights of the part that chose.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "lights/measurement/ray_passage.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {

class HeldOutRays {
  public:
    // Judges by `rays` the field that `all` rays make; `rays` may be a subset of them. `height` is that of S
    // in the frame of the rays. If there are more than `most` rays, at most that many of them are used.
    HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all, double height,
                std::size_t most);

    // Judges by all `rays`, with the planes, cells and weights of `like`, which is made of other
    // rays of the lamp. Weights from the counts that they weight would favour cells by chance where cells
    // have few rays.
    HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all,
                const HeldOutRays& like);

    // The errors of the field that all rays make on `rig`, plane by plane. `moved` is the
    // squared error that making the field positive (round_to_rays.h) adds on each plane, extrapolated to all
    // rays, and `held` the share of the light that the field holds.
    struct Found {
        std::vector<PlaneError> errors;
        double moved = 0;
        double held = 0;
    };
    Found find_errors(const Rig& rig, const RayWeights& weights, const Workers& workers) const;

    // Returns the errors of a field made of other rays against all rays used here. No coefficient may be
    // negative.
    std::vector<PlaneError> errors(const LightField& field) const;

    // Adds what a change of the field `from` to `to`, on the same planes, changes of the light they cast.
    void add_change(std::vector<PlaneError>& errors, const LightField& from, const LightField& to,
                    const Workers& workers) const;

    // Return, per axis, the median of the flux on S, and the half width of the strip around it that holds
    // half of the flux [m].
    V2d middle_on_s() const { return planes_.front().middle; }
    V2d half_on_s() const { return planes_.front().half; }
    // Returns the half width as above for the slopes dx/dz and dy/dz.
    V2d half_slopes() const { return planes_.back().half; }
    std::size_t rays() const { return halves_[0].size() + halves_[1].size(); }  // used here

  private:
    static constexpr int kCells = 48;  // per side; coarser cells show too little, finer ones noise
    static constexpr std::size_t kAll = std::size_t{kCells} * kCells;

    // A ray from S to any plane.
    struct Line {
        V2d on_s, slope;  // metres in the rays' frame; dx/dz and dy/dz
        double light;     // flux, or for coloured rays the mean of X, Y and Z, each as a share of all rays',
                          // like the field's sampled channel (ColourChannels)
        V2d at(double distance) const { return std::isinf(distance) ? slope : on_s + distance * slope; }
    };

    // A plane's grid. It is uniform in a coordinate about the middle of the plane's light, so that its cells
    // are fine where most light is and it covers the whole plane.
    struct Plane {
        double distance;  // from S; INFINITY: by direction, in slopes
        V2d middle, half;
        std::vector<double> edges[2];    // kCells + 1 positions, relative to `middle`
        std::vector<double> counted[2];  // flux per cell, [x * kCells + y], for either half of the rays
        std::vector<double> weight;      // weight of a cell's squared difference
        double signal = 0;               // Σ weight times the product of the two halves

        std::size_t cell_of(const V2d& at) const;
    };
    using Cells = std::vector<double>;  // flux per cell of a plane

    void take_rays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all);
    // Lines that pass S side by side add to the same coefficients.
    void sort_lines();
    Plane make_plane(double distance) const;
    void count_rays(Plane& plane) const;  // into its cells
    static void find_signal(Plane& plane);
    // Returns the fluxes of the coefficients that one half of the rays makes: E times a cell's volume.
    std::vector<float> project_half(const Rig& rig, const RayWeights& weights, int half) const;
    // Extrapolates a sum over negative coefficients of the fields of the halves, and of both, to the field of
    // all rays. Such coefficients are mostly noise.
    double of_all_rays(double of_halves, double of_both) const;
    // Returns the fluxes of the field's coefficients, as a share of all light like those of project_half().
    std::vector<float> fluxes_of(const LightField& field) const;
    // Returns what the coefficients of each field, followed by kColumns zeros, cast into the cells of each
    // plane: [plane][field].
    std::vector<std::vector<Cells>> cast(std::span<const std::vector<float>> fields, const Rig& rig,
                                         const Workers& workers) const;

    std::vector<Line> halves_[2];
    // The variance of a half's field over that of the lamp's, which is the ratio of their numbers of rays.
    double half_over_all_variance_ = 2;
    double light_ = 0;      // of the rays used
    double set_light_ = 0;  // of all rays of the set
    double height_ = 0;
    V3d channel_weight_{0, 1, 0};
    std::vector<Plane> planes_;  // the first is S itself
};

// Returns the sum of the squared errors over planes, which the choice of a resolution minimises.
double total_error(std::span<const PlaneError> errors);

}  // namespace lucerna
