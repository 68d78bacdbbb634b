#include "engine/cli/light/quick_lamp.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/cli/light/light_commands.h"

namespace lucerna {
namespace {

// Lays the planes in front of the emitter like choose_rig does for rays: S extends one filter beyond the edge
// on every side; M is five emitter sizes away and wide enough for the share of the flux [Ashdown 1995].
Rig lay_planes(const QuickLamp& lamp, const V2d& half) {
    Rig rig;
    rig.views = lamp.views;
    rig.pixels = lamp.pixels;
    rig.distance = lamp.distance > 0 ? lamp.distance : 10 * std::max(half.x, half.y);
    rig.centre.z = lamp.setback;
    // A cos^N lobe has 1 - cos^(N+1) θ of its flux within θ. The share 1 would need the whole plane; 0.9999
    // is 89° from the axis for N = 1.
    const double share = std::min(lamp.capture, 0.9999);
    const double cos_edge = pow(1 - share, 1 / (lamp.exponent + 1));
    const double tan_edge = std::sqrt(1 - cos_edge * cos_edge) / cos_edge;  // share < 1, so the cosine is > 0
    for (int axis = 0; axis < 2; ++axis) {
        // An emitter behind S illuminates a larger area of S.
        const double covered = half[axis] + lamp.setback * tan_edge;
        // Filters stand at ±(covered + Δ): (views - 1) Δ = 2 covered + 2 Δ; views >= 4 is checked.
        rig.spacing[axis] = 2 * covered / (rig.views[axis] - 3);
        const double m_half = half[axis] + (rig.distance + lamp.setback) * tan_edge;
        rig.pixel[axis] = 2 * m_half / rig.pixels[axis];
    }
    return rig;
}

void check(const QuickLamp& lamp) {
    const bool disc = lamp.emitter == "disc";
    if (!disc && lamp.emitter != "rectangle")
        input_error({"--emitter"}, "\"{}\" is not accepted; expected disc or rectangle", lamp.emitter);
    if (lamp.unit != "lm" && lamp.unit != "W")
        input_error({"--unit"}, "\"{}\" is not accepted; expected lm or W", lamp.unit);
    if (disc && lamp.has_size)
        throw InputError({"--size"}, "--size is for a rectangle; use --radius for a disc");
    if (!disc && lamp.has_radius)
        throw InputError({"--radius"}, "--radius is for a disc; use --size for a rectangle");
    if (std::min(lamp.views.x, lamp.views.y) < 4) {
        input_error({"--views"},
                    "\"{}x{}\" is not accepted; expected at least 4 on a side, as one filter is placed "
                    "beyond each edge",
                    lamp.views.x, lamp.views.y);
    }
}

}  // namespace

RigDescription describe(const QuickLamp& lamp) {
    check(lamp);
    RigDescription description;
    EmitterDescription& emitter = description.emitter;
    const bool disc = lamp.emitter == "disc";
    emitter.kind = disc ? EmitterDescription::Kind::disc : EmitterDescription::Kind::rectangle;
    emitter.half_size = disc ? V2d(lamp.radius, lamp.radius) : lamp.size * 0.5;
    emitter.exponent = lamp.exponent;
    emitter.flux = lamp.flux;
    emitter.unit = lamp.unit == "lm" ? FluxUnit::lumen : FluxUnit::watt;
    emitter.colour = lamp.colour;
    emitter.setback = lamp.setback;
    description.rig = lay_planes(lamp, emitter.half_size);
    return description;
}

void add_quick_lamp(CLI::App& app, QuickLamp& lamp) {
    app.add_option("--emitter", lamp.emitter, "disc (default) or rectangle")->type_name("SHAPE");
    add_word(app, "--radius", "LENGTH", "radius of the disc (default 25mm)",
             [&lamp](const std::string& word) {
                 lamp.radius = parse_length({"--radius"}, word);
                 lamp.has_radius = true;
             });
    add_word(app, "--size", "LENGTHxLENGTH", "size of the rectangle (default 20mmx10mm)",
             [&lamp](const std::string& word) {
                 lamp.size = parse_length_pair({"--size"}, word);
                 lamp.has_size = true;
             });
    add_word(
        app, "--exponent", "N", "intensity falls off as cos^N; 1 (default) is a Lambertian emitter",
        [&lamp](const std::string& word) { lamp.exponent = parse_number({"--exponent"}, word, 1, 1000); });
    add_word(app, "--flux", "NUMBER", "flux of the lamp (default 1000)",
             [&lamp](const std::string& word) { lamp.flux = parse_number({"--flux"}, word, 1e-9, 1e12); });
    app.add_option("--unit", lamp.unit, "unit of the flux: lm (default) or W")->type_name("UNIT");
    add_word(app, "--colour", "R,G,B",
             "colour of the light, linear sRGB; does not change the flux (default 1,1,1)",
             [&lamp](const std::string& word) { lamp.colour = parse_colour({"--colour"}, word); });
    add_word(app, "--setback", "LENGTH", "distance of the emitter behind the sampling plane (default 0)",
             [&lamp](const std::string& word) {
                 lamp.setback = parse_place({"--setback"}, word);
                 if (lamp.setback < 0)
                     throw InputError({"--setback"}, "the emitter cannot be in front of the plane");
             });
}

}  // namespace lucerna
