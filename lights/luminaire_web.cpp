#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "lights/photometric.h"

namespace lucerna {
namespace {

constexpr double kSameTurn = 1e-6;
constexpr double kEdge = 2e-4;  // degrees, within which a web that ends falls to 0

bool is_upright(const LuminaireEmitter& emitter) {
    return emitter.axes[2].z > 1 - 1e-12 && emitter.axes[0].cross(emitter.axes[1]).z > 0;
}
bool is_unturned(const LuminaireEmitter& emitter) {
    return is_upright(emitter) && emitter.axes[0].x > 1 - 1e-12;
}

// Returns the angle by which the emitter's C planes are turned, counterclockwise as seen from above.
double turn_of(const LuminaireEmitter& emitter) {
    return atan2(-emitter.axes[0].y, emitter.axes[0].x) / kRadiansPerDegree;
}

// Returns the web, whose C planes go all around, with each plane at a C that is larger by `turn` [degrees].
PhotometricWeb turned_planes(const PhotometricWeb& web, double turn) {
    const PhotometricGrid& given = web.grid();
    std::vector<std::pair<double, std::size_t>> planes;
    for (std::size_t i = 0; i + 1 < given.azimuth.size(); ++i) {
        const double c = given.azimuth[i] + turn;
        planes.emplace_back(c - 360 * std::floor(c / 360), i);
    }
    std::sort(planes.begin(), planes.end());
    if (planes.size() == 1) planes.front().first = 0;  // rotational symmetry
    planes.emplace_back(planes.front().first + 360, planes.front().second);
    PhotometricGrid grid{PhotometricPlanes::c, given.polar, {}, {}};
    for (const auto& [c, i] : planes) {
        grid.azimuth.push_back(c);
        const auto row = given.candela.begin() + static_cast<std::ptrdiff_t>(i * given.polar.size());
        grid.candela.insert(grid.candela.end(), row, row + static_cast<std::ptrdiff_t>(given.polar.size()));
    }
    return PhotometricWeb(std::move(grid), web.info());
}

// Returns the emitter's web in the luminaire's frame, as C planes all around. Its opening is not turned.
PhotometricWeb turned(const LuminaireEmitter& emitter) {
    const PhotometricGrid& given = emitter.web.grid();
    const bool all_around = given.azimuth.back() - given.azimuth.front() > 360 - kSameTurn;
    if (is_upright(emitter) && given.planes == PhotometricPlanes::c && all_around)
        return turned_planes(emitter.web, turn_of(emitter));
    const PhotometricWeb sampled = resampled(emitter, 1, 1);
    return sampled.flux() > 0 ? scaled(sampled, emitter.web.flux() / sampled.flux()) : sampled;
}

void sort_unique(std::vector<double>& angles) {
    std::sort(angles.begin(), angles.end());
    angles.erase(
        std::unique(angles.begin(), angles.end(), [](double a, double b) { return b - a < 0.5 * kEdge; }),
        angles.end());
}

// Adds webs of C planes all around on the grid of all their angles.
PhotometricWeb sum_of(const std::vector<PhotometricWeb>& webs) {
    PhotometricGrid grid{PhotometricPlanes::c, {0, 180}, {0, 360}, {}};
    for (const PhotometricWeb& web : webs) {
        const PhotometricGrid& one = web.grid();
        grid.polar.insert(grid.polar.end(), one.polar.begin(), one.polar.end());
        if (one.polar.front() > kEdge) grid.polar.push_back(one.polar.front() - kEdge);
        if (one.polar.back() < 180 - kEdge) grid.polar.push_back(one.polar.back() + kEdge);
        for (const double c : one.azimuth) grid.azimuth.push_back(c - 360 * std::floor(c / 360));
    }
    sort_unique(grid.polar);
    sort_unique(grid.azimuth);
    constexpr std::size_t kMostPoints = 50'000'000;
    if (grid.polar.size() * grid.azimuth.size() > kMostPoints) {
        throw InputError(fmt::format("the emitters' angles make a sum of {} x {} points; expected at most {}",
                                     grid.azimuth.size(), grid.polar.size(), kMostPoints));
    }
    for (const double c : grid.azimuth) {
        for (const double gamma : grid.polar) {
            double candela = 0;
            for (const PhotometricWeb& web : webs) candela += web.intensity(web.direction(gamma, c));
            grid.candela.push_back(static_cast<float>(candela));
        }
    }
    PhotometricInfo info = webs.front().info();
    info.output_ratio = 0;
    info.lamp_lumens = info.watts = 0;
    for (const PhotometricWeb& web : webs) {
        info.lamp_lumens += web.info().lamp_lumens;
        info.watts += web.info().watts;
    }
    return PhotometricWeb(std::move(grid), std::move(info));
}

// Returns half of the sizes of the box around the emitter's opening along the luminaire's axes.
V3d half_sizes(const LuminaireEmitter& emitter) {
    const V3d half = 0.5 * emitter.web.info().opening.size;
    V3d sizes(0, 0, 0);
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < 3; ++i) sizes[axis] += std::fabs(emitter.axes[i][axis]) * half[i];
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (sizes[axis] < 1e-9) sizes[axis] = 0;  // rounding of a turn
    }
    return sizes;
}

LuminousOpening opening_of(const std::vector<LuminaireEmitter>& emitters) {
    const LuminousOpening& first = emitters.front().web.info().opening;
    const bool is_disc = first.shape == LuminousOpening::Shape::cylinder_upright &&
                         std::fabs(first.size.x - first.size.y) < 1e-9;
    if (emitters.size() == 1 && (is_unturned(emitters.front()) || (is_disc && is_upright(emitters.front()))))
        return first;
    V3d low(1e30), high(-1e30);
    for (const LuminaireEmitter& emitter : emitters) {
        if (!(emitter.web.info().opening.faces().second > 0)) continue;
        const V3d half = half_sizes(emitter);
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], emitter.position[axis] - half[axis]);
            high[axis] = std::max(high[axis], emitter.position[axis] + half[axis]);
        }
    }
    if (!(high.x >= low.x)) return {};
    return {LuminousOpening::Shape::box, high - low};
}

}  // namespace

PhotometricWeb luminaire_web(const std::vector<LuminaireEmitter>& emitters) {
    assert(!emitters.empty());
    if (emitters.size() == 1 && is_unturned(emitters.front())) return emitters.front().web;
    std::vector<PhotometricWeb> webs;
    for (const LuminaireEmitter& emitter : emitters) webs.push_back(turned(emitter));
    PhotometricWeb web = webs.size() == 1 ? std::move(webs.front()) : sum_of(webs);
    web.set_opening(opening_of(emitters));
    return web;
}

}  // namespace lucerna
