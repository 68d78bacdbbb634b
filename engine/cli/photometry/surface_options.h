// Calculation surfaces on the command line: of lucerna lux, and the grids of eyes of lucerna glare.
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

// "X,Y,Z" in metres, or each with a unit.
V3d parse_point(const Location& at, std::string_view word);
// "X,Y,Z", not 0; unit.
V3d parse_direction(const Location& at, std::string_view word);

// "NAME=…", neither part empty. `form`: what is accepted, where it is not that.
std::pair<std::string, std::string> parse_named(const Location& at, std::string_view word,
                                                std::string_view form);

struct SurfaceOptions {
    struct Named {
        std::string name;
        std::array<V3d, 3> corners;  // a corner, and the ends of the two sides from there
    };
    std::vector<Named> surfaces;
    std::vector<double> heights;  // of planes above the model's lowest point
    std::vector<double> floors;   // of planes above each floor
    double margin = 0;
    std::optional<int> up_axis;  // 0 to 2: x, y, z
    std::optional<double> spacing;
    ReceiverKind kind = ReceiverKind::planar;
    std::optional<V3d> facing;  // unit
    std::string shaped_by;      // an option that was given and shapes only these surfaces; or empty

    // Throws InputError.
    std::vector<CalculationSurface> all(const Job& job) const;
};
// A surface by a corner and the ends of the two sides from there, with the options' kind, facing and spacing.
// Throws InputError, placed at `at`.
CalculationSurface surface_at(const SurfaceOptions& options, std::string name,
                              const std::array<V3d, 3>& corners, const Location& at);
// --height, --floors, --margin, --up, --spacing; where such planes are wanted.
void add_height_options(CLI::App& app, SurfaceOptions& options);
// These, and --surface, --kind, --facing.
void add_surface_options(CLI::App& app, SurfaceOptions& options);

// Warns where some of the points lie outside the bounds of the scene, of which nothing is seen from there but
// the outside. `what`: "surface desk".
void warn_outside(const Scene& scene, const std::string& what, std::span<const V3d> points, Monitor& monitor);

// The axis of the world that is most nearly upward in the picture.
int up_axis_of(const Camera& camera);

}  // namespace lucerna
