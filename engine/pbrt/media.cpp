// Participating media: MakeNamedMedium of versions 3 and 4, Volume of versions 1 and 2.
//
// Coefficients are per unit of world length whatever the transformation, which only moves boxes and grids.
// The versions have different defaults: 1 and 2 have a clear medium and emit "Le" per length, 3 and 4 have
// whole milk and emit sigma_a times "Le".
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/vec.h"
#include "engine/pbrt/state.h"
#include "engine/scene/medium.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

using Type = Param::Type;

constexpr double kLargestSigma = 1e15;  // per scene unit

Rgb coefficient(Reading& reading, Params& params, std::string_view name, const Rgb& fallback, double scale) {
    const Rgb value = read_spectrum(reading, params, name, ColorUse::ratio).value_or(fallback);
    Rgb result;
    for (int k = 0; k < 3; ++k) {
        // A narrow spectrum may lie outside the colour triangle; negative coefficients are set to 0.
        const double scaled = std::max(0.0, static_cast<double>(value[k])) * scale;
        if (!(scaled <= kLargestSigma)) {
            params.warn_or_refuse(params.place_of(params.has(name) ? name : "scale"),
                                  fmt::format("\"{}\" of {} is {:g} in channel {}; expected 0 to {:g}", name,
                                              params.owner(), scaled, k, kLargestSigma),
                                  fmt::format("{:g} is used", kLargestSigma));
        }
        result[k] = static_cast<float>(std::min(scaled, kLargestSigma));
    }
    return result;
}

float read_g(Params& params) {
    constexpr auto most = static_cast<double>(kLargestG);
    return static_cast<float>(params.real_within("g", 0, -most, most));
}

Rgb read_emission(Reading& reading, Params& params) {
    const Rgb value = read_spectrum(reading, params, "Le", ColorUse::emission).value_or(Rgb(0));
    return {std::max(0.0F, value.x), std::max(0.0F, value.y), std::max(0.0F, value.z)};
}

Box3d read_box(Params& params) {
    const V3d a = params.point("p0", V3d(0)), b = params.point("p1", V3d(1));
    Box3d box;
    box.extendBy(a);
    box.extendBy(b);
    for (int k = 0; k < 3; ++k) {
        const double size = box.max[k] - box.min[k];
        if (!(size > 0 && std::isfinite(size))) {
            fail(params.place(), "{}: p0 ({:g} {:g} {:g}) and p1 ({:g} {:g} {:g}) do not span a box",
                 params.owner(), a.x, a.y, a.z, b.x, b.y, b.z);
        }
    }
    return box;
}

DensityGrid read_grid(Params& params, const Box3d& box, DensityGrid::Border border) {
    V3i size;
    double count = 1;
    for (int k = 0; k < 3; ++k) {
        constexpr std::string_view names[] = {"nx", "ny", "nz"};
        size[k] = params.integer(names[k], 1);
        if (size[k] < 1) {
            fail(params.place_of(names[k]), "\"{}\": {} is not accepted; expected 1 or more", names[k],
                 size[k]);
        }
        count *= size[k];
    }
    const Param* density = params.find("density", {Type::real});
    if (!density) fail(params.place(), "{} lacks \"float density\", its samples", params.owner());
    if (static_cast<double>(density->numbers.size()) != count) {
        fail(density->place, "\"density\" has {} values; expected nx·ny·nz = {:.0f}", density->numbers.size(),
             count);
    }
    std::vector<float> samples(density->numbers.size());
    bool said = false;  // reports once, as finding a place scans the text
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double value = density->numbers[i];
        const double held = std::clamp(value, 0.0, kLargestSigma);
        if (held != value && !std::exchange(said, true)) {
            params.warn_or_refuse(
                density->place_of(i),
                fmt::format("\"density\": {:g} is not accepted; expected 0 to {:g}", value, kLargestSigma),
                fmt::format("{:g} is used, and similarly for other values", held));
        }
        samples[i] = static_cast<float>(held);
    }
    return {size, std::move(samples), box, border};
}

ExponentialDensity read_exponential(Params& params, const Box3d& box) {
    ExponentialDensity density;
    density.a = params.real_within("a", 1, 0, kLargestSigma);
    density.b = params.real_within("b", 1, -kLargestSigma, kLargestSigma);
    const Param* up = params.find("updir", {Type::vector3, Type::point3, Type::normal3});
    if (up) {
        if (up->numbers.size() != 3) fail(up->place, "\"updir\" needs 3 numbers, not {}", up->numbers.size());
        density.up = V3d(up->numbers[0], up->numbers[1], up->numbers[2]);
        if (!(density.up.length2() > 0)) fail(up->place, "\"updir\" has no length");
    }
    density.up.normalize();
    density.base = box.min;
    // The density may grow downwards without bound, so it is checked at the corners.
    for (int corner = 0; corner < kBoxCorners; ++corner) {
        const V3d p = box_corner(box, corner);
        if (!(density_at(density, p) <= kLargestSigma)) {
            fail(params.place(), "{}: the density reaches {:g} within the box; expected {:g}", params.owner(),
                 density_at(density, p), kLargestSigma);
        }
    }
    return density;
}

// Returns the index of the medium of that name in the draft. A medium that is not made yet gets an empty
// entry.
std::int32_t index_of_medium(Reading& reading, const Place& at, const std::string& name) {
    if (name.empty()) return kNoMedium;
    const auto known = reading.media.find(name);
    if (known != reading.media.end()) return known->second;
    const auto index = static_cast<std::int32_t>(reading.draft.media.size());
    reading.draft.media.push_back({at, name, {}, {}});
    reading.media[name] = index;
    return index;
}

// Reads version 4's other media. A grid of colours gets the density of its sums and their mean colour; a
// cloud fills its box uniformly with its mean density.
void read_other_grid(const Reading& reading, const std::string& kind, Params& params, Medium& medium) {
    if (kind == "cloud") {
        constexpr double kFilled = 0.5;  // approximate mean of its noise
        const double density = kFilled * params.real_within("density", 1, 0, kLargestSigma);
        params.accept({"wispiness", "frequency"});
        params.warn_or_refuse(params.place_of("type"), "a medium of type \"cloud\" is not supported",
                              "its box is filled uniformly", "the cloud's shape");
        medium.density =
            DensityGrid(V3i(1), {static_cast<float>(density)}, *medium.box, DensityGrid::Border::zero);
        return;
    }
    V3i size(1);
    double count = 3;
    for (int k = 0; k < 3; ++k) {
        constexpr std::string_view names[] = {"nx", "ny", "nz"};
        size[k] = std::max(1, params.integer(names[k], 1));
        count *= size[k];
    }
    V3d sums[2] = {V3d(0), V3d(0)};
    std::vector<float> density;
    constexpr std::string_view names[] = {"sigma_a", "sigma_s"};
    for (int which = 0; which < 2; ++which) {
        const Param* grid = params.find(names[which], {Type::rgb});
        if (!grid) continue;
        if (static_cast<double>(grid->numbers.size()) != count) {
            fail(grid->place, "\"{}\" has {} numbers; expected 3·nx·ny·nz = {:.0f}", names[which],
                 grid->numbers.size(), count);
        }
        density.resize(grid->numbers.size() / 3, 0.0F);
        for (std::size_t i = 0; i < density.size(); ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
                const double value = std::clamp(grid->numbers[3 * i + k], 0.0, kLargestSigma);
                sums[which][static_cast<int>(k)] += value;
                density[i] += static_cast<float>(value);
            }
        }
        if (grid->space || !reading.colours().is_srgb())
            sums[which] =
                V3d(rgb_of_numbers(reading, params, *grid, sums[which] / count, ColorUse::ratio)) * count;
    }
    const double all = sums[0].x + sums[0].y + sums[0].z + sums[1].x + sums[1].y + sums[1].z;
    if (!(all > 0)) fail(params.place(), "{} is empty", params.owner());
    // The samples hold the sum of six numbers, so the coefficients that they multiply add up to 1.
    const auto scale = params.real_within("scale", 1, 0, kLargestSigma);
    medium.sigma_a = Rgb(sums[0] * (scale / all));
    medium.sigma_s = Rgb(sums[1] * (scale / all));
    params.warn_or_refuse(params.place_of("type"), "a medium of type \"rgbgrid\" is not supported",
                          "its density varies, its colour is the mean", "the variation of the colour");
    medium.density = DensityGrid(size, std::move(density), *medium.box, DensityGrid::Border::zero);
}

}  // namespace

void read_named_medium(Reading& reading, const std::string& name, Params& params) {
    const std::string kind = params.string("type", "");
    if (!params.has("type")) {
        fail(params.place(), "MakeNamedMedium \"{}\" lacks \"string type\", the kind of medium", shown(name));
    }
    const bool grid = kind == "uniformgrid" || kind == "heterogeneous";
    const bool other = kind == "cloud" || kind == "rgbgrid";
    if (!grid && !other && kind != "homogeneous") {
        refuse_kind(params.place_of("type"), "type of medium", kind,
                    {"homogeneous", "uniformgrid", "heterogeneous"}, {"nanovdb"});
    }
    Medium medium;
    medium.name = name;
    const double scale = params.real_within("scale", 1, 0, kLargestSigma);
    // Version 4's grids have coefficients of 1 by default.
    const bool ones = kind == "uniformgrid" || kind == "cloud";
    const MeasuredMedium& milk = *measured_medium("Wholemilk");  // pbrt's default
    const Rgb sigma_a = ones ? Rgb(1) : reading.colours().ratio(milk.sigma_a);
    const Rgb sigma_s = ones ? Rgb(1) : reading.colours().ratio(milk.sigma_s);
    const std::string preset = params.string("preset", "");
    const MeasuredMedium* found = measured_medium(preset);
    if (!preset.empty() && !found) {
        params.warn_or_refuse(
            params.place_of("preset"),
            fmt::format("preset \"{}\" is unknown; {}", shown(preset), accepted_measured_media(preset)),
            "the coefficients given, or whole milk's, are used");
    }
    if (kind == "rgbgrid") {
        // The coefficients come from the grids.
    } else if (found) {
        medium.sigma_a = reading.colours().ratio(found->sigma_a) * static_cast<float>(scale);
        medium.sigma_s = reading.colours().ratio(found->sigma_s) * static_cast<float>(scale);
    } else {
        medium.sigma_a = coefficient(reading, params, "sigma_a", sigma_a, scale);
        medium.sigma_s = coefficient(reading, params, "sigma_s", sigma_s, scale);
    }
    medium.g = read_g(params);
    for (const std::string_view heat : {"temperature", "temperaturescale", "temperatureoffset"}) {
        if (!params.find_any(heat)) continue;
        params.warn_or_refuse(params.place_of(heat), fmt::format("\"{}\" is not supported", heat),
                              "it is left out", "thermal emission");
    }
    const auto emission_scale = static_cast<float>(params.real_within("Lescale", 1, 0, 1e30));
    medium.emission = medium.sigma_a * read_emission(reading, params) * emission_scale;
    if (grid) {
        medium.box = read_box(params);
        medium.density = read_grid(params, *medium.box, DensityGrid::Border::zero);
    } else if (other) {
        medium.box = read_box(params);
        read_other_grid(reading, kind, params, medium);
    }
    if (medium.box) reading.note_transformation();
    if (!inverse(reading.state.ctm)) {
        fail(params.place(), "{}: its transformation is not invertible", params.owner());
    }
    const auto known = reading.media.find(name);
    if (known != reading.media.end() && reading.draft.media[static_cast<std::size_t>(known->second)].medium) {
        reading.warn(params.place(),
                     fmt::format("medium \"{}\" is defined again; the new definition applies from here on",
                                 shown(name)));
        reading.media.erase(known);
    }
    const auto index = static_cast<std::size_t>(index_of_medium(reading, params.place(), name));
    reading.draft.media[index] = {params.place(), name, std::move(medium), reading.state.ctm};
}

void read_volume(Reading& reading, const std::string& kind, Params& params) {
    if (kind != "homogeneous" && kind != "volumegrid" && kind != "exponential") {
        refuse_kind(params.place(), "Volume", kind, {"homogeneous", "volumegrid", "exponential"},
                    {"aggregate"});
    }
    Medium medium;
    medium.name = kind;
    medium.sigma_a = coefficient(reading, params, "sigma_a", Rgb(0), 1);
    medium.sigma_s = coefficient(reading, params, "sigma_s", Rgb(0), 1);
    medium.emission = read_emission(reading, params);
    medium.g = read_g(params);
    medium.box = read_box(params);
    if (kind == "volumegrid") {
        medium.density = read_grid(params, *medium.box, DensityGrid::Border::hold);
    } else if (kind == "exponential") {
        medium.density = read_exponential(params, *medium.box);
    }
    if (!inverse(reading.state.ctm)) {
        fail(params.place(), "{}: its transformation is not invertible", params.owner());
    }
    if (is_black(medium.sigma_t()) && !medium.emits()) {
        reading.warn(params.place(),
                     params.owner() + " neither absorbs, scatters nor emits and has no effect");
        return;
    }
    Draft& draft = reading.draft;
    draft.regions.push_back(static_cast<std::uint32_t>(draft.media.size()));
    draft.media.push_back({params.place(), kind, std::move(medium), reading.state.ctm});
    draft.uses_media = true;
}

MediumInterface read_medium_interface(Reading& reading, const Place& at, const std::string& inside,
                                      const std::string& outside) {
    MediumInterface media;
    media.inside = index_of_medium(reading, at, inside);
    media.outside = index_of_medium(reading, at, outside);
    media.is_interface = media.inside != media.outside;
    return media;
}

void settle_media(Reading& reading) {
    for (DraftMedium& medium : reading.draft.media) {
        if (medium.medium) continue;
        std::vector<std::string_view> names;
        for (const DraftMedium& other : reading.draft.media) {
            // Does not suggest names that cannot be printed on one line.
            if (other.medium && shown(other.name) == other.name) names.push_back(other.name);
        }
        reading.warn_or_refuse(medium.place,
                               fmt::format("there is no medium \"{}\"; {}{} are defined", shown(medium.name),
                                           did_you_mean(medium.name, names), names.size()),
                               "vacuum is used instead");
        medium.medium.emplace();
        medium.medium->name = medium.name;
    }
}

}  // namespace lucerna
