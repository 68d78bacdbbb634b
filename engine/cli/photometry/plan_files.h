// Plans of calculation surfaces, and the files that they are written to.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "engine/cli/command_files.h"
#include "engine/figures/figure.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {

// Of `values`, one for each point, u first; u to the right, v upwards, in metres from the surface's corner,
// with the luminaires above it.
PlanFigure plan_of(const CalculationSurface& surface, std::span<const double> values, const std::string& unit,
                   std::span<const LuminairePlace> lamps);

// "lux.exr" of the first surface, "lux-2.exr" of the second.
std::filesystem::path of_surface(const std::filesystem::path& file, std::size_t surface);
// Another map of the same surface: "lux.svg" -> "lux-error.svg".
std::filesystem::path of_map(const std::filesystem::path& file, std::string_view map);

// As an output of the command, by --plan. Throws InputError: neither .svg nor .png.
void declare_plan(const std::filesystem::path& file, CommandFiles& files);
void write_plan(const std::filesystem::path& file, const PlanFigure& plan);

}  // namespace lucerna
