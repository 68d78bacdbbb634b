// The lighting requirements of EN 12464-1:2021 (Light and lighting - Lighting of work places - Part 1: Indoor
// work places) for a task area and the room around it: the surfaces on which they are calculated, and whether
// the calculated values meet them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/photometry/glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/light_colour.h"
#include "engine/photometry/room.h"

namespace lucerna {

// The number of the requirements' names below is the same.
enum class Requirement : std::uint8_t {
    em,
    u0,
    ra,
    surround,
    background,
    walls,
    ceiling,
    ez,
    modelling,
    ugr
};

struct RequirementName {
    const char *name, *what;
};
inline constexpr std::array<RequirementName, 10> kRequirements{{
    {"Em", "mean illuminance of each task area [lx], at least"},
    {"U0", "uniformity of each task area, at least"},
    {"Ra", "colour rendering index of the mean light of each task area, at least; the lamps need spectra"},
    {"surround",
     "mean illuminance of the band of 0.5 m around each task area [lx], at least; uniformity at "
     "least 0.40"},
    {"background",
     "mean illuminance of the floor within 3 m around that [lx], at least; uniformity at least "
     "0.10"},
    {"walls", "mean illuminance of each wall [lx], at least; uniformity at least 0.10"},
    {"ceiling", "mean illuminance of the ceiling [lx], at least; uniformity at least 0.10"},
    {"Ez", "mean cylindrical illuminance at the height of eyes [lx], at least; uniformity at least 0.10"},
    {"modelling",
     "cylindrical over horizontal illuminance at the height of eyes, from-to, for example "
     "0.3-0.6"},
    {"UGR", "glare rating at the middle of each side of the room, looking across it, at most"},
}};

struct RequiredRange {
    double low = 0, high = 0;  // high is 0 where there is none, and so is low for UGR
};
using Requirements = std::array<std::optional<RequiredRange>, kRequirements.size()>;

// Parses "Em=500,U0=0.6,UGR=19". Throws InputError.
Requirements parse_requirements(const Location& at, std::string_view word);
// Returns the required illuminance of the surround for that of the task area [EN 12464-1:2021, table 1].
double surround_of(double task);

inline const std::optional<RequiredRange>& required(const Requirements& all, Requirement one) {
    return all[static_cast<std::size_t>(one)];
}

enum class Area : std::uint8_t { task, surround, background, wall, ceiling, cylindrical, horizontal };

// The task areas, and the surfaces which the requirements need in the rooms around them.
struct RoomSurfaces {
    std::vector<CalculationSurface> surfaces;  // the task areas first
    std::vector<Area> areas;                   // of each surface
    std::vector<Observer> observers;           // for UGR
    std::vector<Room> rooms;                   // around the task areas, where there are any
};

// Throws InputError where a requirement needs a room and there is none around a task area. `eye_height` is
// above the floor [m]: 1.2 for people who sit, 1.6 for people who stand.
RoomSurfaces room_surfaces(const Scene& scene, std::span<const CalculationSurface> tasks,
                           const Requirements& requirements, double eye_height, int up_axis,
                           bool right_handed);

enum class Verdict : std::uint8_t { met, missed, undecided };
inline constexpr std::string_view kVerdicts[] = {"met", "missed", "not decided at this precision"};

struct Judgement {
    std::string requirement, of;  // "Em", and the name of the surface or observer
    std::string unit;             // "lx" or empty
    Reading95 value;
    RequiredRange limits;
    Verdict verdict = Verdict::undecided;
};

// Compares the interval of a value with its limits. A value is undecided whose interval holds a limit.
Verdict verdict_of(const Reading95& value, const RequiredRange& limits);

// `surfaces` and `colour` are those of reports on room_surfaces(), `glare` the reports of its observers. The
// colour rendering index is undecided if `colour` was not computed.
std::vector<Judgement> judge(const RoomSurfaces& room, std::span<const SurfaceIlluminance> surfaces,
                             std::span<const GlareReport> glare, const ColourReport& colour,
                             const Requirements& requirements);

}  // namespace lucerna
