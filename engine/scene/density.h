// Describes the density of a medium as a function of position: a dimensionless factor of its coefficients.
//
// It provides the density at a point, and a bound along a stretch of a ray, as delta and ratio tracking need.
// Points are in the medium's own space.
#pragma once

#include <variant>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// The density is 1 everywhere.
struct UniformDensity {};

// The density is a·exp(-b h), with h the height over the box's lower corner along `up` (pbrt 1 and 2).
struct ExponentialDensity {
    double a = 1, b = 1;  // a >= 0; b per unit of length of the medium's space
    V3d up{0, 1, 0};      // unit
    V3d base{0, 0, 0};    // where h = 0
};

// Holds samples at the centres of a box's cells, and interpolates trilinearly. It also keeps the largest
// sample of each brick of kBrick³ cells, so that an empty part of the grid costs almost nothing.
class DensityGrid {
  public:
    // Determines the density beyond the outermost samples, within half a cell of the box's faces.
    enum class Border : std::uint8_t {
        hold,  // constant (pbrt 1 and 2)
        zero,  // falls to 0 (pbrt 3 and 4)
    };
    static constexpr int kBrick = 4;

    // `samples` has size.x · size.y · size.z elements, finite and not negative; x runs fastest.
    DensityGrid(const V3i& size, std::vector<float> samples, const Box3d& box, Border border);

    double at(const V3d& p) const;  // p within the box
    float largest() const;
    const V3i& size() const { return size_; }

    // These serve a walk through the bricks, in coordinates in which a brick has length 1.
    V3d to_bricks(const V3d& p) const { return (p - box_.min) * per_brick_; }
    V3d direction_to_bricks(const V3d& d) const { return d * per_brick_; }
    const V3i& bricks() const { return bricks_; }
    float largest_in(const V3i& brick) const;

  private:
    float sample(int x, int y, int z) const;
    float largest_around(const V3i& brick) const;

    V3i size_;
    std::vector<float> samples_;
    Box3d box_;
    Border border_;
    V3d per_cell_, per_brick_;  // cells, bricks per unit of length
    V3i bricks_;
    std::vector<float> largest_;  // per brick
};

using Density = std::variant<UniformDensity, ExponentialDensity, DensityGrid>;

double density_at(const Density& density, const V3d& p);

// Follows a straight line p(t) = o + t d through a density (t in scene units), cut into stretches begin <= t
// < end() on each of which one bound holds.
class DensityTraversal {
  public:
    DensityTraversal(const Density& density, const V3d& o, const V3d& d, double begin, double last);

    double end() const { return end_; }
    double bound() const { return bound_; }
    // Advances to the stretch that begins at end(). Does nothing at the last one.
    void next();

    double at(double t) const { return density_at(*density_, o_ + t * d_); }

  private:
    void bound_exponential(const ExponentialDensity& density);
    void enter_brick(const DensityGrid& grid);
    void exit_brick(const DensityGrid& grid);

    const Density* density_;
    V3d o_, d_;
    double begin_, end_, last_;
    double bound_ = 1;
    V3d brick_o_{0, 0, 0}, brick_d_{0, 0, 0};  // the line in brick coordinates
    V3i brick_{0, 0, 0};
    int axis_ = 0;  // axis of the wall through which the line leaves the brick
};

}  // namespace lucerna
