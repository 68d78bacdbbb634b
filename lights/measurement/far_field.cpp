#include "engine/base/elementary.h"
#include "lights/measurement/plane_irradiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "lights/gauss.h"
#include "lights/measurement/basis_shares.h"
#include "lights/measurement/shining_opening.h"
#include "lights/photometric_cell.h"

namespace lucerna {
namespace {

constexpr double kDegree = kPiD / 180;
constexpr double kLeastStep = 0.05;  // degrees
constexpr int kNodes = 2;            // Gauss nodes per step and axis, at which a field is evaluated
constexpr int kPixelNodes = 3;       // Gauss nodes per pixel of M and axis, over which a mean is taken
constexpr int kClampNodes = 2;       // Gauss nodes between knots of the bases, where a clamp may cut in

// Returns the number of steps from 0 to `whole`.
int steps_of(double step, double whole) {
    const double count = std::round(whole / step);
    if (!(step >= kLeastStep && step <= whole) || std::fabs(count * step - whole) > 1e-6 * whole) {
        throw InputError(fmt::format("a step of {:g} degrees; expected {:g} or more, a divisor of {:g}", step,
                                     kLeastStep, whole));
    }
    return static_cast<int>(count);
}

// Distributes light by direction among the hats of a grid of C planes.
class HatGrid {
  public:
    HatGrid(double polar_whole, const FarFieldGrid& grid)
        : polar_(steps_of(grid.polar_step, polar_whole)), azimuth_(steps_of(grid.azimuth_step, 360)) {
        polar_width_ = polar_whole * kDegree / polar_;
        flux_.resize(static_cast<std::size_t>(polar_ + 1) * static_cast<std::size_t>(azimuth_));
    }

    int polar() const { return polar_; }
    int azimuth() const { return azimuth_; }
    double polar_width() const { return polar_width_; }           // radians
    double azimuth_width() const { return 2 * kPiD / azimuth_; }  // radians
    // Angles are in radians; theta is within the grid, phi in [0, 2π].
    void add(double theta, double phi, double flux) {
        const double x = theta / polar_width_, y = phi / azimuth_width();
        const int i = std::clamp(static_cast<int>(x), 0, polar_ - 1);
        const int j = std::clamp(static_cast<int>(y), 0, azimuth_ - 1);
        const double t = std::clamp(x - i, 0.0, 1.0), s = std::clamp(y - j, 0.0, 1.0);
        at(i, j) += flux * (1 - t) * (1 - s);
        at(i, j + 1) += flux * (1 - t) * s;
        at(i + 1, j) += flux * t * (1 - s);
        at(i + 1, j + 1) += flux * t * s;
    }

    // Gives each hat the mean intensity of the hats whose directions are within a cap of `radius` [radians].
    void smooth(double radius) {
        const auto columns = static_cast<std::size_t>(azimuth_);
        // Sums of a row's hats from 0 to 2 columns, so that intervals across 0 are one difference.
        std::vector<double> sums(static_cast<std::size_t>(polar_ + 1) * (2 * columns + 1));
        for (int i = 0; i <= polar_; ++i) {
            double* const row = &sums[static_cast<std::size_t>(i) * (2 * columns + 1)];
            for (std::size_t j = 0; j < 2 * columns; ++j) row[j + 1] = row[j] + at(i, static_cast<int>(j));
        }
        const int reach = static_cast<int>(radius / polar_width_);
        std::vector<double> smoothed(flux_.size());
        for (int i = 0; i <= polar_; ++i) {
            const double theta = i * polar_width_;
            std::vector<double> flux(columns);
            double solid_angles = 0;
            for (int k = std::max(0, i - reach); k <= std::min(polar_, i + reach); ++k) {
                const double other = k * polar_width_, across = sin(theta) * sin(other);
                const double cosine = across > 0 ? (cos(radius) - cos(theta) * cos(other)) / across : -1.0;
                const double turn = cosine <= -1 ? kPiD : acos(std::min(cosine, 1.0));
                const int half = static_cast<int>(turn / azimuth_width());
                const int count = std::min(2 * half + 1, azimuth_);
                solid_angles += count * solid_angle(k);
                const double* const row = &sums[static_cast<std::size_t>(k) * (2 * columns + 1)];
                for (int j = 0; j < azimuth_; ++j) {
                    const int first = count == azimuth_ ? 0 : (j - half + azimuth_) % azimuth_;
                    flux[static_cast<std::size_t>(j)] += row[first + count] - row[first];
                }
            }
            // > 0, as the row itself is within reach.
            for (std::size_t j = 0; j < columns; ++j)
                smoothed[static_cast<std::size_t>(i) * columns + j] = flux[j] / solid_angles * solid_angle(i);
        }
        flux_ = std::move(smoothed);
    }

    // Returns the direction of the hat of the highest mean intensity.
    V3d brightest() const {
        double most = -1;
        V3d found(0, 0, 1);
        for (int i = 0; i <= polar_; ++i) {
            for (int j = 0; j < azimuth_; ++j) {
                const double intensity = at(i, j) / solid_angle(i);
                if (!(intensity > most)) continue;
                most = intensity;
                const double theta = i * polar_width_, phi = j * azimuth_width();
                found = {sin(theta) * cos(phi), -sin(theta) * sin(phi), cos(theta)};
            }
        }
        return found;
    }

    // Returns the flux over each hat's solid angle. A pole is one direction in all planes.
    PhotometricGrid finish() {
        make_even(0);
        if (polar_ * polar_width_ > 0.75 * kPiD) make_even(polar_);
        PhotometricGrid grid;
        for (int i = 0; i <= polar_; ++i) grid.polar.push_back(i * polar_width_ / kDegree);
        grid.polar.back() = std::round(grid.polar.back());  // 90 or 180
        for (int j = 0; j <= azimuth_; ++j) {
            grid.azimuth.push_back(360.0 * j / azimuth_);
            for (int i = 0; i <= polar_; ++i) {
                grid.candela.push_back(static_cast<float>(std::max(0.0, at(i, j) / solid_angle(i))));
            }
        }
        return grid;
    }

  private:
    std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(i) * static_cast<std::size_t>(azimuth_) +
               static_cast<std::size_t>(j % azimuth_);
    }
    double& at(int i, int j) { return flux_[index(i, j)]; }
    double at(int i, int j) const { return flux_[index(i, j)]; }
    void make_even(int i) {
        double sum = 0;
        for (int j = 0; j < azimuth_; ++j) sum += at(i, j);
        for (int j = 0; j < azimuth_; ++j) at(i, j) = sum / azimuth_;
    }
    // Returns a value > 0, because every hat extends over at least one step.
    double solid_angle(int i) const {
        double polar = 0;
        if (i > 0) polar += PolarStep{(i - 1) * polar_width_, polar_width_}.rising(1);
        if (i < polar_) polar += PolarStep{i * polar_width_, polar_width_}.falling(1);
        return polar * azimuth_width();
    }

    int polar_, azimuth_;     // steps
    double polar_width_ = 0;  // radians
    std::vector<double> flux_;
};

// Returns the steepest slope at which a ray passes both S and M.
double largest_slope(const Rig& rig) {
    double slope2 = 0;
    for (int axis = 0; axis < 2; ++axis) {
        const double on_m =
            rig.shift[axis] > 0 ? 0.5 * rig.pixels[axis] * rig.pixel[axis] : rig.m_edge(axis, 0, true);
        const double on_s = rig.shift[axis] > 0 ? rig.spacing[axis] : -rig.interval_edge(axis, 0);
        slope2 += sqr((on_m + on_s) / rig.distance);  // D > 0
    }
    return std::sqrt(slope2);
}

// A direction at which the field is evaluated, and its solid angle.
struct Node {
    double theta, phi, solid;
};

std::vector<Node> nodes_of(const HatGrid& grid, double theta_most) {
    std::vector<Node> nodes;
    for (int i = 0; i < grid.polar() && i * grid.polar_width() < theta_most; ++i) {
        for (int j = 0; j < grid.azimuth(); ++j) {
            for (const GaussNode& t : gauss_rule(kNodes)) {
                for (const GaussNode& s : gauss_rule(kNodes)) {
                    const double theta = (i + t.x) * grid.polar_width();
                    nodes.push_back(
                        {theta, (j + s.x) * grid.azimuth_width(),
                         t.weight * s.weight * sin(theta) * grid.polar_width() * grid.azimuth_width()});
                }
            }
        }
    }
    return nodes;
}

// Returns the field with constant radiance over a pixel instead of constant flux density: each coefficient is
// divided by the mean of cos⁴θ from its filter's centre over its pixel, because the geometric term is
// proportional to cos⁴θ.
LightField evened(const LightField& field) {
    const Rig& rig = field.rig();
    std::vector<float> e(field.coefficients().begin(), field.coefficients().end());
    const auto slope = [&rig](int axis, int filter, int pixel, double within) {
        const double on_m = rig.column_edge(axis, filter + 1, 0) + (pixel + within) * rig.pixel[axis];
        return (on_m - rig.filter(axis, filter)) / rig.distance;  // D > 0
    };
    for (int m = 0; m < rig.views.x; ++m) {
        for (int k = 0; k < rig.pixels.x; ++k) {
            for (int n = 0; n < rig.views.y; ++n) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    double mean = 0;
                    for (const GaussNode& x : gauss_rule(kPixelNodes)) {
                        for (const GaussNode& y : gauss_rule(kPixelNodes)) {
                            const double over_cos2 = 1 + sqr(slope(0, m, k, x.x)) + sqr(slope(1, n, l, y.x));
                            mean += x.weight * y.weight / sqr(over_cos2);
                        }
                    }
                    e[rig.index(m, n, k, l)] /= static_cast<float>(mean);  // slopes are finite, so mean > 0
                }
            }
        }
    }
    return {rig, std::move(e), field.info()};
}

}  // namespace

namespace {

// Returns the intensity's factor on the integral of h.
double far_factor(const Rig& rig, const V2d& slope) {
    const double over_cos2 = 1 + slope.length2();
    return sqr(rig.distance) * over_cos2 * std::sqrt(over_cos2);
}

bool has_negative(const LightField& field) {
    return std::any_of(field.coefficients().begin(), field.coefficients().end(),
                       [](float e) { return e < 0; });
}

// Evaluates far_intensity() with h clamped as it is rendered, by a sum, since h is no longer a product.
double clamped_far_intensity(const LightField& field, const V2d& slope) {
    const Rig& rig = field.rig();
    const auto across = basis_nodes(rig, 0, slope.x * rig.distance, 1, kClampNodes);
    const auto up = basis_nodes(rig, 1, slope.y * rig.distance, 1, kClampNodes);
    double sum = 0;
    for (const BasisNode& x : across) {
        for (const BasisNode& y : up) {
            sum += x.weight * y.weight * double{field.flux_density({x.on_s, y.on_s}, {x.on_m, y.on_m})};
        }
    }
    return far_factor(rig, slope) * sum;
}

}  // namespace

double far_intensity(const LightField& field, const V2d& slope) {
    const Rig& rig = field.rig();
    // Rays of the slope that pass S at u pass M at u + slope·D.
    const auto across = basis_shares(rig, 0, slope.x * rig.distance, 1);
    const auto up = basis_shares(rig, 1, slope.y * rig.distance, 1);
    double sum = 0;
    for (const BasisShare& x : across) {
        double row = 0;
        for (const BasisShare& y : up) {
            row += y.weight * double{field.coefficients()[rig.index(x.filter, y.filter, x.pixel, y.pixel)]};
        }
        sum += x.weight * row;
    }
    return far_factor(rig, slope) * sum;
}

namespace {

// Adds what a field along `axes` sends towards each node, times `gain`.
void add_far_light(const LightField& field, const SlabAxes& axes, bool as_rendered, double gain,
                   std::span<const Node> nodes, const Workers& workers, Monitor& monitor, Phase& phase,
                   std::vector<double>& flux) {
    const double most = largest_slope(field.rig());
    const bool boxes = field.rig().basis == PixelBasis::box && !as_rendered;
    const bool clamps = as_rendered && has_negative(field);
    const std::optional<LightField> even = boxes ? std::optional(evened(field)) : std::nullopt;
    const LightField& shown = even ? *even : field;
    constexpr std::int64_t kGrain = 256;
    parallel_ranges(
        workers, static_cast<std::int64_t>(nodes.size()), kGrain,
        [&](std::int64_t begin, std::int64_t end, std::int64_t) {
            if (monitor.stopped()) throw Stopped("far field: stopped");
            for (std::int64_t n = begin; n < end; ++n) {
                const Node& node = nodes[static_cast<std::size_t>(n)];
                const double sine = sin(node.theta);
                const V3d d = axes.to_slab({sine * cos(node.phi), -sine * sin(node.phi), cos(node.theta)});
                if (!(d.z > 0) || hypot(d.x, d.y) > most * d.z) continue;
                const V2d slope(d.x / d.z, d.y / d.z);
                const double intensity =
                    clamps ? clamped_far_intensity(shown, slope) : far_intensity(shown, slope);
                flux[static_cast<std::size_t>(n)] +=
                    gain * node.solid * (boxes ? sqr(sqr(d.z)) : 1.0) * intensity;
            }
            phase.advance(static_cast<std::uint64_t>(end - begin));
        });
}

PhotometricWeb web_of(HatGrid grid, std::span<const Node> nodes, std::span<const double> flux,
                      double measured, PhotometricInfo info) {
    for (std::size_t n = 0; n < nodes.size(); ++n) grid.add(nodes[n].theta, nodes[n].phi, flux[n]);
    const PhotometricGrid hats = grid.finish();
    const PhotometricWeb web(hats, info);
    if (!(web.flux() > 0)) throw InputError("the lamp emits nothing into the far field");
    double differs = 0;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto& [theta, phi, solid] = nodes[n];
        const double sine = sin(theta);
        const V3d w(sine * cos(phi), -sine * sin(phi), cos(theta));
        differs += std::fabs(solid * web.intensity(w) - flux[n]);
    }
    info.grid_error = differs / web.flux();
    return scaled(PhotometricWeb(hats, std::move(info)), measured / web.flux());
}

void require_light(double flux) {
    if (!(flux > 0)) {
        throw InputError(fmt::format("the lamp's flux is {:g}; expected a positive flux", flux));
    }
}

}  // namespace

PhotometricWeb far_field(const LightField& field, const FarFieldGrid& steps, const Workers& workers,
                         Monitor& monitor) {
    if (field.coloured()) return far_field(field.channel(1), steps, workers, monitor);
    const Rig& rig = field.rig();
    require_light(field.flux());
    const HatGrid grid(90, steps);
    const std::vector<Node> nodes = nodes_of(grid, atan(largest_slope(rig)));
    std::vector<double> flux(nodes.size());
    {
        Phase phase(monitor, "far field", nodes.size());
        add_far_light(field, {}, steps.as_rendered, 1, nodes, workers, monitor, phase, flux);
    }
    PhotometricInfo info;
    info.provenance = field.info().provenance;
    PhotometricWeb web = web_of(grid, nodes, flux, field.flux(), std::move(info));
    const SlabAxes straight;
    const SlabView slab{straight, field};
    const V3d plane(-2 * rig.interval_edge(0, 0), -2 * rig.interval_edge(1, 0), 0);
    web.set_opening(shining_opening({&slab, 1}, plane, web, workers));
    return web;
}

PhotometricWeb far_field(const Lumigraph& lamp, const FarFieldGrid& steps, const Workers& workers,
                         Monitor& monitor) {
    if (lamp.simple()) return far_field(lamp.slabs()[0].field, steps, workers, monitor);
    if (lamp.coloured()) return far_field(lamp.channel(1), steps, workers, monitor);
    require_light(lamp.flux());
    const HatGrid grid(180, steps);
    const std::vector<Node> nodes = nodes_of(grid, kPiD);
    std::vector<double> flux(nodes.size());
    {
        Phase phase(monitor, "far field", nodes.size() * lamp.slabs().size());
        for (const Slab& slab : lamp.slabs()) {
            // A slab is rendered with its measured flux.
            const double clamped = steps.as_rendered ? slab.field.clamped_flux(workers) : 0;
            const double gain = clamped > 0 ? std::max(0.0, slab.field.flux()) / clamped : 1;
            add_far_light(slab.field, slab.axes, steps.as_rendered, gain, nodes, workers, monitor, phase,
                          flux);
        }
    }
    PhotometricInfo info;
    info.provenance = lamp.provenance();
    PhotometricWeb web = web_of(grid, nodes, flux, lamp.flux(), std::move(info));
    std::vector<SlabView> slabs;
    for (const Slab& slab : lamp.slabs()) slabs.push_back({slab.axes, slab.field});
    web.set_opening(shining_opening(slabs, lamp.box().size(), web, workers));
    return web;
}

namespace {

// Distributes the rays' light among the hats of a grid that holds all their directions.
HatGrid counted(const RaySet& rays, const FarFieldGrid& steps) {
    const bool backward =
        std::any_of(rays.rays.begin(), rays.rays.end(), [](const LampRay& r) { return r.d.z < 0; });
    HatGrid grid(backward ? 180 : 90, steps);
    for (std::size_t i = 0; i < rays.rays.size(); ++i) {
        const V3d d(rays.rays[i].d);
        const double theta = atan2(hypot(d.x, d.y), d.z), phi = atan2(-d.y, d.x);
        grid.add(theta, phi < 0 ? phi + 2 * kPiD : phi, rays.light_of(i));
    }
    return grid;
}

// Returns how many equal rays are worth as much as those within `radius` [radians] of a direction.
double rays_near(const RaySet& rays, const V3d& w, double radius) {
    const double least = cos(radius);
    double light = 0, squares = 0;
    for (std::size_t i = 0; i < rays.rays.size(); ++i) {
        if (!(V3d(rays.rays[i].d).dot(w) > least)) continue;
        light += rays.light_of(i);
        squares += sqr(rays.light_of(i));
    }
    return squares > 0 ? sqr(light) / squares : 0.0;
}

}  // namespace

double smoothing_cap(const RaySet& rays, const FarFieldGrid& steps) {
    constexpr double kRadii[] = {0.1, 0.2, 0.5, 1, 2, 3, 5, 7, 10};  // degrees
    constexpr double kEnough = 400;  // rays, whose number has a standard error of 5 %
    const HatGrid grid = counted(rays, steps);
    for (const double radius : kRadii) {
        HatGrid smoothed = grid;
        smoothed.smooth(radius * kDegree);
        if (rays_near(rays, smoothed.brightest(), radius * kDegree) >= kEnough) return radius;
    }
    return std::end(kRadii)[-1];
}

PhotometricWeb far_field(const RaySet& rays, const FarFieldGrid& steps) {
    double sum = 0;
    for (std::size_t i = 0; i < rays.rays.size(); ++i) sum += rays.light_of(i);
    if (!(sum > 0)) throw InputError("the rays carry no flux");
    PhotometricInfo info;
    info.smoothed = steps.cap > 0 ? steps.cap : smoothing_cap(rays, steps);
    info.provenance = rays.provenance;
    HatGrid grid = counted(rays, steps);
    grid.smooth(info.smoothed * kDegree);
    const PhotometricWeb web(grid.finish(), std::move(info));
    // Unusable rays are part of the lamp, and smoothing changes its flux where the grid ends.
    return scaled(web, (rays.flux > 0 ? rays.flux : sum) / web.flux());
}

}  // namespace lucerna
