// The UGR table of a luminaire: its unified glare rating in the 19 standard rooms with regular rows of it, by
// the tabular method of CIE 117:1995 as CIE 190:2010 lays it down.
//
// All lengths are in H = 2 m, the height of the luminaires above the eye. A room has the width X across the
// line of sight and the depth Y along it. Luminaires hang on a square grid of the spacing S, the outer
// ones S/2 from the walls. The observer's eye is at the middle of a wall of width X and looks horizontally at
// the wall opposite. Below the luminaires is a cavity of height H, bounded by their plane, the walls and the
// plane of the eye.
//
//     UGR = 8 log10(0.25 / L_b Σ L² ω / p²),     L = I / A,   ω = A / D²,   L_b = E_w / π
//
// with the intensity I towards the eye, the projected area A of the luminous opening, the distance D, and the
// position index p of CIE 117's table (position_table.h); luminaires beyond the table do not count. E_w is
// the mean indirect illuminance of the walls, from the shares of the luminaires' flux that first fall on the
// floor of the cavity, on its walls and on its ceiling:
//
//     E_w = N Φ / A_w (F_floor T_floor + F_walls T_walls + F_ceiling T_ceiling)
//
// The transfer factors T are those of uniformly lit diffuse surfaces, computed exactly; CIE 190 tabulates
// them with three digits. F_floor is integrated over the intensities, as the mean over azimuth, for
// the spacing in question; CIE 190 approximates it by zonal multipliers for S = H.
#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include "engine/base/vec.h"
#include "lights/photometric.h"

namespace lucerna {

struct UgrRoom {
    int across, along;  // X and Y, in H
};
// clang-format off
inline constexpr std::array<UgrRoom, 19> kUgrRooms{{
    {2, 2}, {2, 3}, {2, 4}, {2, 6}, {2, 8}, {2, 12}, {4, 2}, {4, 3}, {4, 4}, {4, 6}, {4, 8}, {4, 12},
    {8, 4}, {8, 6}, {8, 8}, {8, 12}, {12, 4}, {12, 6}, {12, 8}}};
// clang-format on

struct UgrReflectances {
    double ceiling, walls, floor;
};
inline constexpr std::array<UgrReflectances, 5> kUgrReflectances{
    {{0.7, 0.5, 0.2}, {0.7, 0.3, 0.2}, {0.5, 0.5, 0.2}, {0.5, 0.3, 0.2}, {0.3, 0.3, 0.2}}};

// Crosswise, the axis of a long luminaire is across the line of sight; endwise, it is along the line of
// sight.
inline constexpr std::size_t kCrosswise = 0, kEndwise = 1;

// The light of one luminaire. Directions w are unit vectors in the lamp's own frame, in which
// nadir is +z, the plane C0 holds +x and C90 holds -y (lights/photometric.h).
struct UgrLuminaire {
    // Returns the intensity [cd], >= 0.
    std::function<double(const V3d& w)> intensity;
    // Returns the projected area of the luminous opening [m²], > 0 where there is light.
    std::function<double(const V3d& w)> projected_area;
    double lamp_flux = 1000;  // lm, of the lamps in the luminaire, > 0
    // C of the half plane that faces an observer who has the luminaire straight ahead, crosswise and endwise
    // [degrees].
    std::array<double, 2> facing{0, 90};
};

// Returns the luminaire of a web with a luminous opening and light; `web` must outlive it. `axis_is_c90`: the
// axis of a long luminaire lies along C90, not along C0.
UgrLuminaire ugr_luminaire(const PhotometricWeb& web, bool axis_is_c90);

struct UgrTable {
    // Returns what is added to a rating for 1000 lm to get that of the luminaire's own lamps, 8 log10(Φ /
    // 1000 lm).
    double correction() const;

    int per_height = 0;    // luminaires per H along each side of the room: H/S
    double lamp_flux = 0;  // lm
    // UGR for a lamp flux of 1000 lm ("uncorrected") by room, view and reflectances; -infinity where no
    // luminaire shines at the eye.
    std::array<std::array<std::array<double, kUgrReflectances.size()>, 2>, kUgrRooms.size()> uncorrected{};
};

// Computes the table with `per_height` luminaires per H along each side of the room, >= 1.
UgrTable ugr_table(const UgrLuminaire& luminaire, int per_height);

// These parts of the method can be checked by themselves.

// Returns the form factor between parallel, directly opposed rectangles of sides x and y at distance 1.
double opposed_form_factor(double x, double y);

// The flux that falls indirectly on the walls, per flux that falls first on the floor, walls or ceiling.
struct UgrTransfer {
    double from_floor, from_walls, from_ceiling;
};
UgrTransfer ugr_transfer(const UgrRoom& room, const UgrReflectances& reflectances);

// Returns the share of the light emitted by all luminaires at the angle γ from nadir [radians, < π/2] that
// falls on the floor, averaged over azimuth.
double ugr_floor_share(const UgrRoom& room, int per_height, double gamma);

}  // namespace lucerna
