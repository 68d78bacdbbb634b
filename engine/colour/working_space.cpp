#include "engine/colour/working_space.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 3> kNames{"srgb", "rec2020", "acescg"};

Rgb held(const Rgb& c) {
    return {std::max(0.0F, c.x), std::max(0.0F, c.y), std::max(0.0F, c.z)};
}

}  // namespace

std::span<const std::string_view> WorkingSpace::names() {
    return kNames;
}

std::optional<WorkingSpace> WorkingSpace::named(std::string_view name) {
    if (std::ranges::find(kNames, name) == kNames.end()) return std::nullopt;
    return WorkingSpace(*find_colour_space(name));
}

WorkingSpace::WorkingSpace(const ColourSpace& space) {
    const ColourSpace& srgb = colour_spaces().front();
    if (&space == &srgb) return;
    space_ = &space;
    weights_ = V3f(space.luminances());
    white_ = Rgb(space.luminances() / srgb.luminances());
    from_srgb_ = conversion(srgb, space);
}

WorkingSpace WorkingSpace::of_intervals(const std::array<double, 4>& limits) {
    WorkingSpace made;
    made.limits_ = limits;
    for (int primary = 0; primary < 3; ++primary) {
        const auto only = [primary](int c) { return c == primary ? 1.0 : 0.0; };
        const V3d mean = made.mean_over_intervals(
            std::array<SpectralSample, 3>{{{kBlue, only(2)}, {kGreen, only(1)}, {kRed, only(0)}}});
        for (int c = 0; c < 3; ++c) made.from_srgb_.rows[static_cast<std::size_t>(c)][primary] = mean[c];
    }
    return made;
}

// A spectrum is constant beyond its ends.
V3d WorkingSpace::mean_over_intervals(std::span<const SpectralSample> spectrum) const {
    const auto at = [spectrum](double nm) {
        const auto next = std::ranges::lower_bound(spectrum, nm, {}, &SpectralSample::nanometres);
        if (next == spectrum.end()) return spectrum.back().weight;
        if (next == spectrum.begin()) return spectrum.front().weight;
        const SpectralSample& before = *(next - 1);
        return std::lerp(before.weight, next->weight,
                         (nm - before.nanometres) / (next->nanometres - before.nanometres));
    };
    constexpr int kSteps = 64;
    V3d mean(0, 0, 0);
    for (int c = 0; c < 3; ++c) {
        const double from = (*limits_)[static_cast<std::size_t>(c)];
        const double width = (*limits_)[static_cast<std::size_t>(c) + 1] - from;
        for (int i = 0; i < kSteps; ++i) mean[c] += at(from + (i + 0.5) / kSteps * width) / kSteps;
    }
    return mean;
}

RgbMatrix WorkingSpace::from(const ColourSpace& space) const {
    const RgbMatrix to_space = conversion(space, this->space());
    return limits_ ? from_srgb_ * to_space : to_space;
}

Rgb WorkingSpace::ratio(const Rgb& srgb) const {
    if (is_srgb() || (srgb.x == srgb.y && srgb.y == srgb.z)) return srgb;
    return held(Rgb(from_srgb_ * V3d(srgb)));
}

Rgb WorkingSpace::ratio_of_xyz(const V3d& xyz) const {
    if (!space_) return ratio(xyz_colour(xyz));
    return Rgb(held_in_gamut(space_->from_xyz(xyz), space_->luminances()));
}

Rgb WorkingSpace::light_of_xyz(const V3d& xyz) const {
    return limits_ ? Rgb(static_cast<float>(xyz.y)) : ratio_of_xyz(xyz) * white_;
}

Rgb WorkingSpace::open_light_of_xyz(const V3d& xyz) const {
    if (limits_) return light_of_xyz(xyz);
    if (is_srgb()) return xyz_to_rgb(xyz);
    return Rgb(space_->from_xyz(xyz)) * white_;
}

bool WorkingSpace::holds(const V3d& xyz) const {
    if (limits_) return true;
    constexpr double kRounding = 1e-5;
    const V3d rgb = is_srgb() ? V3d(xyz_to_rgb(xyz)) : space_->from_xyz(xyz);
    return std::min({rgb.x, rgb.y, rgb.z}) >= -kRounding * std::max({rgb.x, rgb.y, rgb.z});
}

Rgb WorkingSpace::light_of_spectrum(std::span<const SpectralSample> spectrum) const {
    return is_srgb() ? emission_rgb(spectrum) : light_of_xyz(emission_xyz(spectrum));
}

Rgb WorkingSpace::ratio_of_spectrum(std::span<const SpectralSample> spectrum) const {
    if (limits_) return held(Rgb(mean_over_intervals(spectrum)));
    if (is_srgb()) return ratio_rgb(spectrum);
    const SpectralSample one[1] = {{555, 1}};
    const V3d rgb = space_->from_xyz(emission_xyz(spectrum));
    const V3d white = space_->from_xyz(emission_xyz(one));  // equal energy: no component is near 0
    const auto [least, most] = std::minmax_element(
        spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return a.weight < b.weight; });
    Rgb result;
    for (int c = 0; c < 3; ++c)
        result[c] = static_cast<float>(
            std::clamp(rgb[c] / white[c], std::max(0.0, least->weight), std::max(0.0, most->weight)));
    return result;
}

V3d WorkingSpace::light_to_xyz(const Rgb& light) const {
    if (limits_) return double{luminance(light)} * kWhiteXyz;
    return is_srgb() ? rgb_to_xyz(light) : space_->to_xyz(V3d(light) / V3d(white_));
}

RgbMatrix WorkingSpace::light_from_xyz() const {
    if (limits_) return {{V3d(0, 1, 0), V3d(0, 1, 0), V3d(0, 1, 0)}};
    RgbMatrix matrix = space().from_xyz_matrix;
    for (int c = 0; c < 3; ++c) matrix.rows[static_cast<std::size_t>(c)] *= double{white_[c]};
    return matrix;
}

Rgb light_of_luminance_one(const WorkingSpace& colours, const V3d& xyz) {
    if (!(xyz.y > 0)) return colours.white();
    if (colours.is_srgb()) return colour_of_luminance_one(xyz_to_rgb(xyz));
    const Rgb light = colours.light_of_xyz(xyz / xyz.y);
    return light / luminance(light);  // already about 1; removes the rounding error
}

}  // namespace lucerna
