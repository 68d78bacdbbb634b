// The report of a room: a table of its calculation surfaces, a plan of each, its luminaires, and the settings
// of the computation.
#pragma once

#include <optional>
#include <string>

#include "engine/figures/figure.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/measurement_uncertainty.h"
#include "engine/text/facts.h"

namespace lucerna {

// Returns a plan of a surface: u to the right, v upwards, in metres from its corner, with the luminaires
// above it.
PlanFigure plan_of(const SurfaceIlluminance& surface, const IlluminanceReport& report);

struct LuxPage {
    std::string scene;             // as the command line names it
    Facts facts;                   // program, files and settings, with hashes
    std::optional<Image> picture;  // display-referred
    std::uint64_t seed = 0;
    std::vector<PlanFigure> more_plans = {};
    MeasurementUncertainty uncertainty = {};
};
// Returns one self-contained HTML file without scripts.
std::string lux_page(const IlluminanceReport& report, const LuxPage& page);

}  // namespace lucerna
