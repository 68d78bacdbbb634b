#include "lights/photometric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "lights/photometric_cell.h"

namespace lucerna {
namespace {

constexpr double kLeastStep = 1e-4;  // degrees between neighbouring angles of a grid

std::string fault_of_angles(const std::vector<double>& angles, std::string_view name) {
    if (angles.size() < 2) return fmt::format("{} {} angle; at least 2 are needed", angles.size(), name);
    for (std::size_t i = 0; i < angles.size(); ++i) {
        if (!std::isfinite(angles[i])) return fmt::format("{} angle {} is not finite", name, i + 1);
        if (i > 0 && !(angles[i] - angles[i - 1] >= kLeastStep)) {
            return fmt::format("{} angle {:g} follows {:g}; expected ascending angles", name, angles[i],
                               angles[i - 1]);
        }
    }
    return {};
}

// Returns the step that holds x in ascending angles; none if x lies outside.
std::optional<std::size_t> step_of(const std::vector<double>& angles, double x) {
    if (!(x >= angles.front() && x <= angles.back())) return std::nullopt;
    const auto beyond = std::upper_bound(angles.begin() + 1, angles.end() - 1, x);
    return static_cast<std::size_t>(beyond - angles.begin()) - 1;
}

PhotometricCell cell_of(const PhotometricGrid& grid, const std::vector<double>& polar,
                        const std::vector<double>& azimuth, std::size_t i, std::size_t j) {
    return {{polar[i], polar[i + 1] - polar[i]},
            azimuth[j + 1] - azimuth[j],
            {double{grid.at(j, i)}, double{grid.at(j + 1, i)}},
            {double{grid.at(j, i + 1)}, double{grid.at(j + 1, i + 1)}}};
}

}  // namespace

std::string PhotometricGrid::fault() const {
    // Planes of type B are turned by the vertical angle.
    const bool b = planes == PhotometricPlanes::b;
    const std::string_view name_of_polar = b ? "horizontal" : "vertical";
    const std::string_view name_of_azimuth = b ? "vertical" : "horizontal";
    if (std::string why = fault_of_angles(polar, name_of_polar); !why.empty()) return why;
    if (std::string why = fault_of_angles(azimuth, name_of_azimuth); !why.empty()) return why;
    if (!(polar.front() >= 0 && polar.back() <= 180)) {
        const double zero = planes == PhotometricPlanes::c ? 0 : 90;
        return fmt::format("{} angles from {:g} to {:g}; expected {:g} to {:g}", name_of_polar,
                           polar.front() - zero, polar.back() - zero, -zero, 180 - zero);
    }
    if (!(azimuth.back() - azimuth.front() <= 360)) {
        return fmt::format("{} angles from {:g} to {:g}; expected a range of at most 360 degrees",
                           name_of_azimuth, azimuth.front(), azimuth.back());
    }
    if (candela.size() != polar.size() * azimuth.size()) {
        return fmt::format("{} intensities for {} x {} angles", candela.size(), azimuth.size(), polar.size());
    }
    for (const float value : candela) {
        if (!(value >= 0) || !std::isfinite(value))
            return fmt::format("an intensity of {:g} cd; expected a finite value, not negative", value);
    }
    return {};
}

PhotometricWeb::PhotometricWeb(PhotometricGrid grid, PhotometricInfo info)
    : grid_(std::move(grid)), info_(std::move(info)) {
    if (const std::string why = grid_.fault(); !why.empty()) throw InputError("photometric web: " + why);
    for (const double angle : grid_.polar) polar_.push_back(angle * kRadiansPerDegree);
    for (const double angle : grid_.azimuth)
        azimuth_.push_back((angle - grid_.azimuth.front()) * kRadiansPerDegree);
    polar_.back() = std::min(polar_.back(), kPiD);
    switch (grid_.planes) {
        case PhotometricPlanes::c:
            zero_ = V3d(1, 0, 0), quarter_ = V3d(0, -1, 0), pole_ = V3d(0, 0, 1);
            break;
        case PhotometricPlanes::b:
            zero_ = V3d(0, 0, 1), quarter_ = V3d(1, 0, 0), pole_ = V3d(0, -1, 0);
            break;
        case PhotometricPlanes::a:
            zero_ = V3d(1, 0, 0), quarter_ = V3d(0, 1, 0), pole_ = V3d(0, 0, 1);
            break;
    }
    cells_ = TexelCdf(
        static_cast<int>(azimuth_.size()) - 1, static_cast<int>(polar_.size()) - 1, [&](int j, int i) {
            return cell_of(grid_, polar_, azimuth_, static_cast<std::size_t>(i), static_cast<std::size_t>(j))
                .flux();
        });
    if (!std::isfinite(cells_.total())) throw InputError("photometric web: its flux is not finite");
    peak_ = static_cast<double>(*std::max_element(grid_.candela.begin(), grid_.candela.end()));
}

PhotometricWeb::Place PhotometricWeb::place_of(const V3d& w) const {
    const double x = w.dot(zero_), y = w.dot(quarter_), z = w.dot(pole_);
    double azimuth = atan2(y, x) - grid_.azimuth.front() * kRadiansPerDegree;
    azimuth -= 2 * kPiD * std::floor(azimuth / (2 * kPiD));
    return {atan2(hypot(x, y), z), azimuth};
}

double PhotometricWeb::intensity(const V3d& w) const {
    const Place place = place_of(w);
    // Rounding may put a direction of the last plane slightly beyond it.
    constexpr double kSlack = 1e-12;
    const double polar = std::fabs(place.polar - polar_.back()) < kSlack ? polar_.back() : place.polar;
    double azimuth = std::fabs(place.azimuth - azimuth_.back()) < kSlack ? azimuth_.back() : place.azimuth;
    if (2 * kPiD - azimuth < kSlack) azimuth = 0;
    const auto i = step_of(polar_, std::fabs(polar - polar_.front()) < kSlack ? polar_.front() : polar);
    const auto j = step_of(azimuth_, azimuth);
    if (!i || !j) return 0;
    const PhotometricCell cell = cell_of(grid_, polar_, azimuth_, *i, *j);
    // Steps of a grid are positive; see fault().
    const double t = std::clamp((polar - polar_[*i]) / cell.step.width, 0.0, 1.0);
    const double s = (azimuth - azimuth_[*j]) / cell.azimuth_width;
    return cell.value(t, s);
}

std::optional<PhotometricWeb::Drawn> PhotometricWeb::draw(const V2f& u) const {
    if (!(cells_.total() > 0)) return std::nullopt;
    const TexelCdf::Draw drawn = cells_.draw(u);
    const auto i = static_cast<std::size_t>(drawn.y), j = static_cast<std::size_t>(drawn.x);
    const PhotometricCell cell = cell_of(grid_, polar_, azimuth_, i, j);
    const double t = cell.draw_polar(double{drawn.within.y});
    const double s = cell.draw_azimuth(double{drawn.within.x}, t);
    const double value = cell.value(t, s);
    const auto pdf = static_cast<float>(value / cells_.total());
    if (!(pdf > 0)) return std::nullopt;  // the edge of the lit directions
    const double polar = polar_[i] + t * cell.step.width;
    const double azimuth = grid_.azimuth.front() * kRadiansPerDegree + azimuth_[j] + s * cell.azimuth_width;
    const V3d w = sin(polar) * (cos(azimuth) * zero_ + sin(azimuth) * quarter_) + cos(polar) * pole_;
    return Drawn{V3f(w).normalized(), Rgb(static_cast<float>(value)), pdf};
}

V3d PhotometricWeb::direction(double polar, double azimuth) const {
    const double theta = polar * kRadiansPerDegree, phi = azimuth * kRadiansPerDegree;
    return sin(theta) * (cos(phi) * zero_ + sin(phi) * quarter_) + cos(theta) * pole_;
}

Beam beam_of(const PhotometricWeb& web) {
    Beam beam;
    const PhotometricGrid& grid = web.grid();
    const auto most = static_cast<std::size_t>(std::ranges::max_element(grid.candela) - grid.candela.begin());
    beam.peak = web.peak();
    beam.brightest =
        web.direction(grid.polar[most % grid.polar.size()], grid.azimuth[most / grid.polar.size()]);
    if (!(beam.peak > 0)) return beam;
    // The interpolant is followed in steps finer than those of files, from 90 degrees to the axis.
    constexpr int kSteps = 3600;  // of half a turn
    const double axis = beam.brightest.z < 0 ? -1 : 1;
    const auto angle = [&](const V3d& across, double threshold) {
        const auto intensity = [&](int step) {
            const double phi = kPiD * step / kSteps;
            return web.intensity(sin(phi) * across + axis * cos(phi) * V3d(0, 0, 1));
        };
        // Returns the outermost angle on the side of `sign`, in steps; none if nothing is above the
        // threshold.
        const auto outermost = [&](int sign) -> std::optional<double> {
            int step = kSteps / 2;
            const auto is_inside = [&](int at) { return intensity(sign * at) >= threshold; };
            if (is_inside(step)) {
                while (step < kSteps && is_inside(step + 1)) ++step;
                if (step == kSteps) return sign * step;
            } else {
                while (!is_inside(step)) {
                    if (step == -kSteps / 2) return std::nullopt;
                    --step;
                }
            }
            const double inside = intensity(sign * step);
            const double outside = intensity(sign * (step + 1));  // < threshold <= inside
            return sign * (step + (inside - threshold) / (inside - outside));
        };
        const auto high = outermost(1), low = outermost(-1);
        if (!high || !low) return 0.0;
        return 180.0 / kSteps * (*high - *low);
    };
    const V3d planes[] = {{1, 0, 0}, {0, -1, 0}};
    for (std::size_t plane = 0; plane < 2; ++plane) {
        beam.beam_angle[plane] = angle(planes[plane], 0.5 * beam.peak);
        beam.field_angle[plane] = angle(planes[plane], 0.1 * beam.peak);
    }
    return beam;
}

PhotometricWeb scaled(const PhotometricWeb& web, double factor) {
    assert(std::isfinite(factor) && factor >= 0);
    PhotometricGrid grid = web.grid();
    for (float& value : grid.candela) value = static_cast<float>(double{value} * factor);
    return PhotometricWeb(std::move(grid), web.info());
}

namespace {

// Returns 0, step, 2 step … `whole`.
std::vector<double> even_angles(double step, double whole) {
    const double count = std::round(whole / step);
    if (!(step >= 0.05 && step <= whole) || std::fabs(count * step - whole) > 1e-6 * whole) {
        throw InputError(
            fmt::format("a step of {:g} degrees; expected a divisor of {:g} of at least 0.05", step, whole));
    }
    std::vector<double> angles;
    for (int i = 0; i <= static_cast<int>(count); ++i) angles.push_back(whole * i / count);
    return angles;
}

}  // namespace

PhotometricWeb resampled(const LuminaireEmitter& emitter, double polar_step, double azimuth_step) {
    PhotometricGrid grid{
        PhotometricPlanes::c, even_angles(polar_step, 180), even_angles(azimuth_step, 360), {}};
    for (const double c : grid.azimuth) {
        for (const double gamma : grid.polar) {
            const double theta = gamma * kRadiansPerDegree, phi = c * kRadiansPerDegree;
            const V3d w(sin(theta) * cos(phi), -sin(theta) * sin(phi), cos(theta));
            grid.candela.push_back(static_cast<float>(emitter.web.intensity(emitter.to_emitter(w))));
        }
    }
    return PhotometricWeb(std::move(grid), emitter.web.info());
}

}  // namespace lucerna
