#include "engine/scene/density.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

// A point of a stretch may be rounded into the neighbouring brick. This factor covers the resulting change of
// density, with float32 samples and a position error of one last bit.
constexpr float kBoundSlack = 1 + 1e-5F;

double lerp(double t, double a, double b) {
    return a + t * (b - a);
}

std::size_t index_of(int x, int y, int z, const V3i& size) {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(x);
}

std::size_t volume_of(const V3i& size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
           static_cast<std::size_t>(size.z);
}

}  // namespace

DensityGrid::DensityGrid(const V3i& size, std::vector<float> samples, const Box3d& box, Border border)
    : size_(size), samples_(std::move(samples)), box_(box), border_(border) {
    assert(size.x > 0 && size.y > 0 && size.z > 0 && samples_.size() == volume_of(size));
    for (int i = 0; i < 3; ++i) {
        assert(box.max[i] > box.min[i]);
        per_cell_[i] = size[i] / (box.max[i] - box.min[i]);
        bricks_[i] = (size[i] + kBrick - 1) / kBrick;
    }
    per_brick_ = per_cell_ / kBrick;
    largest_.resize(volume_of(bricks_));
    V3i b;
    for (b.z = 0; b.z < bricks_.z; ++b.z) {
        for (b.y = 0; b.y < bricks_.y; ++b.y) {
            for (b.x = 0; b.x < bricks_.x; ++b.x) {
                largest_[index_of(b.x, b.y, b.z, bricks_)] = kBoundSlack * largest_around(b);
            }
        }
    }
}

float DensityGrid::sample(int x, int y, int z) const {
    const bool inside = x >= 0 && y >= 0 && z >= 0 && x < size_.x && y < size_.y && z < size_.z;
    if (!inside && border_ == Border::zero) return 0;
    return samples_[index_of(std::clamp(x, 0, size_.x - 1), std::clamp(y, 0, size_.y - 1),
                             std::clamp(z, 0, size_.z - 1), size_)];
}

// The cells of a brick interpolate between its own samples and the adjacent ones on every side.
float DensityGrid::largest_around(const V3i& brick) const {
    float result = 0;
    for (int z = kBrick * brick.z - 1; z <= kBrick * (brick.z + 1); ++z) {
        for (int y = kBrick * brick.y - 1; y <= kBrick * (brick.y + 1); ++y) {
            for (int x = kBrick * brick.x - 1; x <= kBrick * (brick.x + 1); ++x) {
                result = std::max(result, sample(x, y, z));
            }
        }
    }
    return result;
}

float DensityGrid::largest_in(const V3i& brick) const {
    return largest_[index_of(brick.x, brick.y, brick.z, bricks_)];
}

float DensityGrid::largest() const {
    return *std::max_element(samples_.begin(), samples_.end());
}

double DensityGrid::at(const V3d& p) const {
    double f[3];
    int i[3];
    for (int k = 0; k < 3; ++k) {
        // Rounding may move a point slightly outside the box; the limits keep the index within int.
        const double cell =
            std::clamp((p[k] - box_.min[k]) * per_cell_[k] - 0.5, -1.0, static_cast<double>(size_[k]));
        const double whole = std::floor(cell);
        i[k] = static_cast<int>(whole);
        f[k] = cell - whole;
    }
    const auto row = [&](int y, int z) {
        return lerp(f[0], static_cast<double>(sample(i[0], y, z)),
                    static_cast<double>(sample(i[0] + 1, y, z)));
    };
    const auto face = [&](int z) { return lerp(f[1], row(i[1], z), row(i[1] + 1, z)); };
    return lerp(f[2], face(i[2]), face(i[2] + 1));
}

double density_at(const Density& density, const V3d& p) {
    if (const auto* grid = std::get_if<DensityGrid>(&density)) return grid->at(p);
    if (const auto* exponential = std::get_if<ExponentialDensity>(&density)) {
        return exponential->a * exp(-exponential->b * exponential->up.dot(p - exponential->base));
    }
    return 1;
}

DensityTraversal::DensityTraversal(const Density& density, const V3d& o, const V3d& d, double begin,
                                   double last)
    : density_(&density), o_(o), d_(d), begin_(begin), end_(last), last_(last) {
    if (const auto* exponential = std::get_if<ExponentialDensity>(&density)) {
        bound_exponential(*exponential);
    } else if (const auto* grid = std::get_if<DensityGrid>(&density)) {
        brick_o_ = grid->to_bricks(o);
        brick_d_ = grid->direction_to_bricks(d);
        for (int k = 0; k < 3; ++k) {
            const double at = std::floor(brick_o_[k] + begin * brick_d_[k]);
            brick_[k] = static_cast<int>(std::clamp(at, 0.0, grid->bricks()[k] - 1.0));
        }
        enter_brick(*grid);
    }
}

void DensityTraversal::next() {
    if (end_ >= last_) return;
    begin_ = end_;
    if (const auto* exponential = std::get_if<ExponentialDensity>(density_)) {
        bound_exponential(*exponential);
    } else if (const auto* grid = std::get_if<DensityGrid>(density_)) {
        exit_brick(*grid);
    } else {
        end_ = last_;
    }
}

// Along a line the density is monotonic, so that the larger end bounds it. Stretches over which it changes by
// a factor of 2 waste little. There are at most 64, in case the slope is too steep for float32.
void DensityTraversal::bound_exponential(const ExponentialDensity& density) {
    const double slope = std::fabs(density.b * density.up.dot(d_));
    const double length = std::max(slope > 0 ? M_LN2 / slope : INFINITY, (last_ - begin_) / 64);
    end_ = begin_ + length < last_ ? begin_ + length : last_;
    bound_ = std::max(at(begin_), at(end_)) * static_cast<double>(kBoundSlack);
}

void DensityTraversal::enter_brick(const DensityGrid& grid) {
    bound_ = static_cast<double>(grid.largest_in(brick_));
    double nearest = INFINITY;
    for (int k = 0; k < 3; ++k) {
        if (brick_d_[k] == 0) continue;
        const double wall = brick_[k] + (brick_d_[k] > 0 ? 1.0 : 0.0);
        const double t = (wall - brick_o_[k]) / brick_d_[k];
        if (t < nearest) {
            nearest = t;
            axis_ = k;
        }
    }
    end_ = std::min(std::max(begin_, nearest), last_);
}

// Steps along the axis whose wall is the nearest, so that the walk ends whatever the rounding.
void DensityTraversal::exit_brick(const DensityGrid& grid) {
    brick_[axis_] += brick_d_[axis_] > 0 ? 1 : -1;
    if (brick_[axis_] < 0 || brick_[axis_] >= grid.bricks()[axis_]) {
        // Only a rounding error of the box lies beyond the last wall.
        brick_[axis_] = std::clamp(brick_[axis_], 0, grid.bricks()[axis_] - 1);
        bound_ = static_cast<double>(grid.largest_in(brick_));
        end_ = last_;
        return;
    }
    enter_brick(grid);
}

}  // namespace lucerna
