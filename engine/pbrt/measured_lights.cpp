// Lamps from files of their own: light fields and ray files, placed in the scene.
#include <fmt/format.h>

#include "engine/pbrt/light_params.h"
#include "lights/cell_table.h"

namespace lucerna {
namespace {

EmissionMode read_emission(Params& params) {
    const std::string name = params.string("emission", "exact");
    if (name == "constant") return EmissionMode::constant;
    if (name == "exact") return EmissionMode::exact;
    if (name == "weighted") return EmissionMode::weighted;
    fail(params.place_of("emission"), "emission \"{}\" is unknown; constant, exact and weighted are accepted",
         shown(name));
}

// What both kinds state alike: file, place, "scale" and "power".
template <typename Settings>
Settings read_lamp(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    Settings lamp;
    lamp.file = reading.resolve(params.string("filename", ""));
    lamp.world_from_light = reading.state.ctm;
    lamp.power_scale = static_cast<float>(params.real_within("scale", 1, 0, 1e30));
    lamp.power = static_cast<float>(positive_or_none(params, "power"));
    if (!uniform_scale(lamp.world_from_light)) {
        fail(params.place(),
             "{} is stretched or sheared by its transformation; rotation, translation and one scale "
             "for all directions are accepted",
             params.owner());
    }
    if (swaps_handedness(lamp.world_from_light)) {
        fail(params.place(), "{} is mirrored by its transformation; a measured lamp cannot be",
             params.owner());
    }
    return lamp;
}

}  // namespace

void read_light_field(Reading& reading, Params& params) {
    auto lamp = read_lamp<MeasuredSettings>(reading, params);
    lamp.mode = read_emission(params);
    reading.draft.caches.push_back(cell_table_file(lamp.file));
    reading.draft.lights.push_back({params.place(), MeasuredSpec{lamp}});
}

void read_ray_file(Reading& reading, Params& params) {
    reading.draft.lights.push_back(
        {params.place(), RayFileSpec{read_lamp<RayLightSettings>(reading, params)}});
}

}  // namespace lucerna
