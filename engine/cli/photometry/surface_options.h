// Calculation surfaces on the command line, for lucerna lux and for the eye grids of lucerna glare.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/cli/commands.h"
#include "engine/render/job.h"
#include "engine/scene/calculation_surface.h"

namespace lucerna {

// Parses "X,Y,Z" in metres, or each with a unit.
V3d parse_point(const Location& at, std::string_view word);
// Parses "X,Y,Z", not 0, and returns a unit vector.
V3d parse_direction(const Location& at, std::string_view word);

// Parses "NAME=…" with both parts not empty. `form` describes the accepted form in errors.
std::pair<std::string, std::string> parse_named(const Location& at, std::string_view word,
                                                std::string_view form);

struct SurfaceOptions {
    struct Named {
        std::string name;
        std::array<V3d, 3> corners;  // a corner, and the ends of its two sides
    };
    std::vector<Named> surfaces;
    std::vector<double> heights;  // of planes above the model's lowest point
    std::vector<double> floors;   // of planes above each floor
    double margin = 0;
    std::optional<int> up_axis;  // 0 to 2: x, y, z
    std::optional<double> spacing;
    ReceiverKind kind = ReceiverKind::planar;
    std::optional<V3d> facing;  // unit vector
    std::string shaped_by;      // a given option that shapes only these surfaces; empty: none

    // Returns the upward axis, the given one or the closest to the camera's.
    int up(const Job& job) const;
    // Throws InputError.
    std::vector<CalculationSurface> all(const Job& job) const;
};
// Returns a surface from a corner and the ends of its two sides, with the options' kind, facing and spacing.
// Throws InputError with location `at`.
CalculationSurface surface_at(const SurfaceOptions& options, std::string name,
                              const std::array<V3d, 3>& corners, const Location& at);
// Adds --height, --floors, --margin, --up and --spacing, the options of horizontal planes.
void add_height_options(CLI::App& app, SurfaceOptions& options);
// Adds these options, and --surface, --kind and --facing.
void add_surface_options(CLI::App& app, SurfaceOptions& options);

// Warns of points outside the bounds of the scene, from which only its outside is visible. `what` is like
// "surface desk".
void warn_outside(const Scene& scene, const std::string& what, std::span<const V3d> points, Monitor& monitor);

// Returns the axis of the world that is closest to upward in the image.
int up_axis_of(const Camera& camera);
// Tells whether the world is right-handed as its camera shows it.
bool is_right_handed(const Job& job);

}  // namespace lucerna
