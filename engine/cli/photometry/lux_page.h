// The report of a room: a table of its calculation surfaces, a plan of each, its luminaires, and the settings
// of the computation.
#pragma once

#include <optional>
#include <string>

#include "engine/cli/photometry/luminaire_types.h"
#include "engine/cli/photometry/lux_runs.h"
#include "engine/figures/figure.h"
#include "engine/text/facts.h"

namespace lucerna {

// A room as a report describes it.
struct RoomText {
    V3d size;  // length, width and clear height [m]
    std::size_t walls = 0;
    bool is_open_sided = false;
    Room::Reflectances reflectances;
    double area = 0;                 // of the floor [m²]
    std::vector<std::size_t> tasks;  // indices of the task areas in it
    std::size_t luminaires = 0;
    double watts = 0;  // of all of them, as their files state; 0: not known of each
};

struct LuxPage {
    std::string scene;             // its name
    Facts facts;                   // program, files and settings, with hashes
    std::optional<Image> picture;  // display-referred
    std::uint64_t seed = 0;
    std::vector<PlanFigure> more_plans = {};
    MaintenanceFactors maintenance = {};
    std::vector<std::pair<std::string, std::string>> about = {};  // lines of the heading: project, author
    std::vector<RoomText> rooms = {};
    Luminaires luminaires = {};            // those in the rooms, where there are rooms
    std::size_t lights_outside = 0;        // of the rooms
    std::vector<std::string> groups = {};  // the light group of each luminaire; empty: the scene has none
    double floor = 0;                      // height of the lowest room's floor; NaN if there is no room
    double hours = 0;                      // of use in a year; 0: not given
    double margin = 0;                     // m, between planes across rooms and their sides
    bool has_daylight = false;
    std::string task = {};                                // what is required, by the name of a table's row
    std::vector<std::vector<PlanDrawing>> model = {};     // of each surface
    std::vector<std::pair<V3d, std::string>> walls = {};  // middles of their lower edges, and names
    int up_axis = 1;
    bool right_handed = false;  // the world, as images of it show it
    std::size_t tasks = 0;      // how many of the surfaces, the first, are task areas
};
// Returns a plan of values at the points of a surface: u to the right, v upwards, in metres from its corner.
// That of a level surface has the luminaires above it and the lines of the model.
PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, std::vector<double> values,
                   const LuxPage& page);
// Returns the plan of illuminance.
PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, const LuxPage& page);
// Returns one self-contained HTML file without scripts.
std::string lux_page(const LuxResults& results, const LuxPage& page);

}  // namespace lucerna
