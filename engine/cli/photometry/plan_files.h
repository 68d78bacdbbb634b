// Plans of calculation surfaces, and their files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/cli/command_files.h"
#include "engine/figures/figure.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/room.h"

namespace lucerna {

// Returns the surface with its sides exchanged or turned so that, with u to the right and v upwards, it is as
// one sees it from its lit side, or a level one from above, in a world whose handedness is that of the
// images. `values`, one per point, u first, are put in order, too.
CalculationSurface as_seen(const CalculationSurface& surface, int up_axis, bool right_handed,
                           std::vector<double>* values = nullptr);

// Returns a plan of `values`, one per point, u first; u to the right, v upwards, in metres from the surface's
// corner, with the luminaires in it.
PlanFigure plan_of(const CalculationSurface& surface, std::span<const double> values, const std::string& unit,
                   std::span<const LuminairePlace> lamps);

// Returns the lines of the model in the plan of a level surface: furniture, cut 3 to 23 cm below the surface,
// and walls, cut 75 cm above it: those of the room that holds the surface, or, where it is small or in no
// room, of 60 cm around it. Other surfaces have none.
std::vector<PlanDrawing> model_lines(const Scene& scene, const CalculationSurface& surface, int up_axis,
                                     std::span<const Room> rooms = {});

// Returns "lux.exr" for the first surface and "lux-2.exr" for the second.
std::filesystem::path of_surface(const std::filesystem::path& file, std::size_t surface);
// Returns the file of another map of the same surface: "lux.svg" -> "lux-error.svg".
std::filesystem::path of_map(const std::filesystem::path& file, std::string_view map);

// Declares an output of --plan. Throws InputError if it is neither .svg nor .png.
void declare_plan(const std::filesystem::path& file, CommandFiles& files);
void write_plan(const std::filesystem::path& file, const PlanFigure& plan);

}  // namespace lucerna
