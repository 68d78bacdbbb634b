#include "engine/photometry/ugr_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/photometry/position_table.h"

namespace lucerna {
namespace {

constexpr double kHeight = 2;     // m: H
constexpr double kLumens = 1000;  // lamp flux of the uncorrected table
// The steps of the integrals over directions. Intensities are read in the middle of each step.
constexpr int kPolarSteps = 1440;    // of 180 degrees
constexpr int kAzimuthSteps = 360;   // of 360 degrees
constexpr int kQuadrantSteps = 180;  // of 90 degrees

double middle(int step, int steps, double range) {
    return (step + 0.5) * range / steps;
}

// Returns the lamp's direction at γ and C [radians].
V3d direction(double gamma, double c) {
    return {sin(gamma) * cos(c), -sin(gamma) * sin(c), cos(gamma)};
}

// Flux of a luminaire by the angle from nadir, for a lamp flux of 1000 lm.
struct ZonalFlux {
    std::vector<double> zones;  // lm, kPolarSteps
    double downward = 0, upward = 0;
};

ZonalFlux zonal_flux(const UgrLuminaire& luminaire) {
    ZonalFlux flux;
    for (int i = 0; i < kPolarSteps; ++i) {
        const double gamma = middle(i, kPolarSteps, kPiD);
        double mean = 0;
        for (int j = 0; j < kAzimuthSteps; ++j)
            mean += luminaire.intensity(direction(gamma, middle(j, kAzimuthSteps, 2 * kPiD))) / kAzimuthSteps;
        const double solid_angle =
            2 * kPiD * (cos(kPiD * i / kPolarSteps) - cos(kPiD * (i + 1) / kPolarSteps));
        flux.zones.push_back(mean * solid_angle * kLumens / luminaire.lamp_flux);
        (2 * i < kPolarSteps ? flux.downward : flux.upward) += flux.zones.back();
    }
    return flux;
}

// Returns the share of `count` luminaires, evenly spaced along a wall of length count * spacing, whose light
// still falls inside the room when it travels `distance` along the wall, either way.
double share_inside(int count, double spacing, double distance) {
    const double inside = std::ceil(count - 0.5 - distance / spacing);
    return std::clamp(inside, 0.0, static_cast<double>(count)) / count;
}

// Returns the mean indirect illuminance of the walls for a lamp flux of 1000 lm, by reflectances [lx].
std::array<double, kUgrReflectances.size()> wall_illuminances(const ZonalFlux& flux, const UgrRoom& room,
                                                              int per_height) {
    double floor = 0;
    for (int i = 0; 2 * i < kPolarSteps; ++i)
        floor += flux.zones[static_cast<std::size_t>(i)] *
                 ugr_floor_share(room, per_height, middle(i, kPolarSteps, kPiD));
    const double luminaires = room.across * room.along * per_height * per_height;
    const double walls = 2 * sqr(kHeight) * (room.across + room.along);
    std::array<double, kUgrReflectances.size()> illuminances{};
    for (std::size_t i = 0; i < illuminances.size(); ++i) {
        const UgrTransfer transfer = ugr_transfer(room, kUgrReflectances[i]);
        illuminances[i] = luminaires / walls *
                          (floor * transfer.from_floor + (flux.downward - floor) * transfer.from_walls +
                           flux.upward * transfer.from_ceiling);
    }
    return illuminances;
}

// Returns Σ L² ω / p² over all luminaires in the room for a lamp flux of 1000 lm.
double glare_sum(const UgrLuminaire& luminaire, const UgrRoom& room, int per_height, double facing) {
    const int columns = room.across * per_height, rows = room.along * per_height;
    const double half_spacing = 0.5 * kHeight / per_height;
    double sum = 0;
    for (int column = 0; column < columns; ++column) {
        // Positions are whole numbers of half spacings, so that their ratios are exact at the table's limits.
        const int beside = 2 * column + 1 - columns;  // positive to the right
        for (int row = 0; row < rows; ++row) {
            const int ahead = 2 * row + 1;
            const std::optional<double> index = tabulated_position_index(
                std::fabs(static_cast<double>(beside)) / ahead, 2.0 * per_height / ahead);
            if (!index) continue;
            const double t = beside * half_spacing, r = ahead * half_spacing;
            // C grows counterclockwise as seen from above.
            const V3d w = direction(atan2(hypot(t, r), kHeight), facing * kRadiansPerDegree - atan2(t, r));
            const double intensity = luminaire.intensity(w) * kLumens / luminaire.lamp_flux;
            if (!(intensity > 0)) continue;
            sum += sqr(intensity) / luminaire.projected_area(w) /
                   ((sqr(t) + sqr(r) + sqr(kHeight)) * sqr(*index));
        }
    }
    return sum;
}

}  // namespace

double UgrTable::correction() const {
    return 8 * log10(lamp_flux / kLumens);
}

UgrLuminaire ugr_luminaire(const PhotometricWeb& web, bool axis_is_c90) {
    UgrLuminaire luminaire;
    luminaire.intensity = [&web](const V3d& w) { return web.intensity(w); };
    luminaire.projected_area = [&web](const V3d& w) { return web.info().opening.projected_area(w); };
    luminaire.lamp_flux = web.info().lamp_lumens > 0 ? web.info().lamp_lumens : web.flux();
    if (!axis_is_c90) luminaire.facing = {90, 0};
    return luminaire;
}

UgrTable ugr_table(const UgrLuminaire& luminaire, int per_height) {
    assert(per_height >= 1 && luminaire.lamp_flux > 0);
    UgrTable table;
    table.per_height = per_height;
    table.lamp_flux = luminaire.lamp_flux;
    const ZonalFlux flux = zonal_flux(luminaire);
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        const auto illuminances = wall_illuminances(flux, kUgrRooms[i], per_height);
        for (const std::size_t view : {kCrosswise, kEndwise}) {
            const double sum = glare_sum(luminaire, kUgrRooms[i], per_height, luminaire.facing[view]);
            for (std::size_t j = 0; j < illuminances.size(); ++j) {
                const double background = illuminances[j] / kPiD;
                table.uncorrected[i][view][j] = sum > 0 ? 8 * log10(0.25 / background * sum) : -INFINITY;
            }
        }
    }
    return table;
}

double opposed_form_factor(double x, double y) {
    const double a = std::sqrt(1 + sqr(x)), b = std::sqrt(1 + sqr(y));
    return 2 / (kPiD * x * y) *
           (log(a * b / std::sqrt(1 + sqr(x) + sqr(y))) + x * b * atan(x / b) + y * a * atan(y / a) -
            x * atan(x) - y * atan(y));
}

UgrTransfer ugr_transfer(const UgrRoom& room, const UgrReflectances& reflectances) {
    const double area = room.across * room.along, wall_area = 2 * (room.across + room.along);
    // The first index of a form factor is the surface that the light leaves; the ceiling is like the floor.
    const double opposed = opposed_form_factor(room.across, room.along), to_walls = 1 - opposed;
    const double from_walls = to_walls * area / wall_area, among_walls = 1 - 2 * from_walls;
    const auto [ceiling, walls, floor] = reflectances;
    // The fluxes φ that fall on ceiling, walls and floor solve (1 - M) φ = first fluxes.
    const Imath::M33d balance(1, -walls * from_walls, -floor * opposed,                         //
                              -ceiling * to_walls, 1 - walls * among_walls, -floor * to_walls,  //
                              -ceiling * opposed, -walls * from_walls, 1);
    const Imath::M33d solution = balance.inverse();
    return {solution[1][2], solution[1][1] - 1, solution[1][0]};
}

double ugr_floor_share(const UgrRoom& room, int per_height, double gamma) {
    const double reach = tan(gamma), spacing = 1.0 / per_height;
    double share = 0;
    for (int i = 0; i < kQuadrantSteps; ++i) {
        const double azimuth = middle(i, kQuadrantSteps, kPiD / 2);
        share += share_inside(room.across * per_height, spacing, reach * cos(azimuth)) *
                 share_inside(room.along * per_height, spacing, reach * sin(azimuth));
    }
    return share / kQuadrantSteps;
}

}  // namespace lucerna
