#include "engine/colour/working_space.h"

#include <algorithm>
#include <array>

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

Rgb WorkingSpace::ratio(const Rgb& srgb) const {
    if (is_srgb() || (srgb.x == srgb.y && srgb.y == srgb.z)) return srgb;
    return held(Rgb(from_srgb_ * V3d(srgb)));
}

Rgb WorkingSpace::ratio_of_xyz(const V3d& xyz) const {
    if (is_srgb()) return xyz_colour(xyz);
    return Rgb(held_in_gamut(space_->from_xyz(xyz), space_->luminances()));
}

Rgb WorkingSpace::light_of_xyz(const V3d& xyz) const {
    return ratio_of_xyz(xyz) * white_;
}

Rgb WorkingSpace::open_light_of_xyz(const V3d& xyz) const {
    if (is_srgb()) return xyz_to_rgb(xyz);
    return Rgb(space_->from_xyz(xyz)) * white_;
}

bool WorkingSpace::holds(const V3d& xyz) const {
    constexpr double kRounding = 1e-5;
    const V3d rgb = is_srgb() ? V3d(xyz_to_rgb(xyz)) : space_->from_xyz(xyz);
    return std::min({rgb.x, rgb.y, rgb.z}) >= -kRounding * std::max({rgb.x, rgb.y, rgb.z});
}

Rgb WorkingSpace::light_of_spectrum(std::span<const SpectralSample> spectrum) const {
    return is_srgb() ? emission_rgb(spectrum) : light_of_xyz(emission_xyz(spectrum));
}

Rgb WorkingSpace::ratio_of_spectrum(std::span<const SpectralSample> spectrum) const {
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
    return is_srgb() ? rgb_to_xyz(light) : space_->to_xyz(V3d(light) / V3d(white_));
}

RgbMatrix WorkingSpace::light_from_xyz() const {
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
