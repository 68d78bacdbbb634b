// lucerna light acquire: a lamp on the virtual measuring bench.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "engine/app/light_commands.h"
#include "engine/app/outputs.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "lights/acquire.h"

namespace lucerna {
namespace {

constexpr const char* kAcquireFooter =
    R"(A virtual measuring bench in front of a flat emitter whose intensity falls off as cos^N.

Examples:
  lucerna light acquire -o lamp.exr
  lucerna light acquire --radius 25mm --flux 1500 --unit lm -o lamp.exr
  lucerna light acquire --emitter rectangle --size 20mmx10mm --exponent 8 --flux 3 --pixels 96x96 -o lamp.exr)";

struct AcquireCommand {
    std::string emitter = "disc";
    double radius = 0.025;  // metres
    V2d size{0.02, 0.01};   // metres
    bool has_radius = false, has_size = false;
    double exponent = 1, flux = 1000;  // flux in `unit`
    std::string unit = "lm";
    Rgb colour{1.0F};    // luminance 1
    double setback = 0;  // metres
    V2i views{9, 9}, pixels{128, 128};
    double distance = 0;  // metres; 0: chosen
    double capture = 0.98;
    LampOutput lamp;
};

// The planes in front of an emitter of half size `half`, as choose_rig lays them for rays: one filter beyond
// the edge on every side, M at five times the size and as wide as holds the share of the flux [Ashdown 1995].
Rig lay_planes(const AcquireCommand& command, const V2d& half) {
    Rig rig;
    rig.views = command.views;
    rig.pixels = command.pixels;
    rig.distance = command.distance > 0 ? command.distance : 10 * std::max(half.x, half.y);
    // A cos^N lobe holds 1 - cos^(N+1) θ of its flux within θ. The share 1 would be the whole plane; 0.9999
    // is 89° from the axis for N = 1.
    const double share = std::min(command.capture, 0.9999);
    const double cos_edge = std::pow(1 - share, 1 / (command.exponent + 1));
    const double tan_edge = std::sqrt(1 - cos_edge * cos_edge) / cos_edge;  // share < 1, so the cosine is > 0
    for (int axis = 0; axis < 2; ++axis) {
        // Behind S the emitter's light has spread when it gets there.
        const double covered = half[axis] + command.setback * tan_edge;
        // Filters stand at ±(covered + Δ): (views - 1) Δ = 2 covered + 2 Δ; views >= 4 was checked.
        rig.spacing[axis] = 2 * covered / (rig.views[axis] - 3);
        const double m_half = half[axis] + (rig.distance + command.setback) * tan_edge;
        rig.pixel[axis] = 2 * m_half / rig.pixels[axis];
    }
    return rig;
}

void check(const AcquireCommand& command) {
    const bool disc = command.emitter == "disc";
    if (!disc && command.emitter != "rectangle") {
        input_error({"--emitter"}, "\"{}\" is not accepted; disc or rectangle is", command.emitter);
    }
    if (command.unit != "lm" && command.unit != "W") {
        input_error({"--unit"}, "\"{}\" is not accepted; lm or W is", command.unit);
    }
    if (disc && command.has_size)
        throw InputError({"--size"}, "a disc has a --radius; --size is for a rectangle");
    if (!disc && command.has_radius)
        throw InputError({"--radius"}, "a rectangle has a --size; --radius is for a disc");
    if (std::min(command.views.x, command.views.y) < 4) {
        input_error(
            {"--views"},
            "\"{}x{}\" is not accepted; at least 4 on a side are, as one filter stands beyond each edge",
            command.views.x, command.views.y);
    }
}

void act_acquire(const AcquireCommand& command, const CommandContext& context) {
    check(command);
    require_writable(command.lamp.file, ".exr");
    ConsoleMonitor monitor(context.out, context.err, console_settings(command.lamp, context));
    const bool disc = command.emitter == "disc";
    const V2d half = disc ? V2d(command.radius, command.radius) : command.size * 0.5;
    EmitterModel emitter =
        cosine_emitter(disc ? EmitterModel::Outline::disc : EmitterModel::Outline::rectangle, half,
                       command.flux, command.exponent);
    emitter.setback = command.setback;
    emitter.info.colour = command.colour;
    emitter.info.unit = command.unit == "lm" ? FluxUnit::lumen : FluxUnit::watt;
    emitter.info.provenance =
        disc ? fmt::format("virtual acquisition of a disc of radius {}", length_text(command.radius))
             : fmt::format("virtual acquisition of a rectangle of {} x {}", length_text(command.size.x),
                           length_text(command.size.y));
    emitter.info.provenance += fmt::format(", cos^{:g}, {:g} {}; lucerna {}", command.exponent, command.flux,
                                           command.unit, program_version());
    const LightField field = acquire(emitter, lay_planes(command, half), command.lamp.workers, monitor);
    finish_lamp(field, command.lamp, monitor, context);
}

void add_emitter(CLI::App& app, AcquireCommand& command) {
    app.add_option("--emitter", command.emitter, "disc (default) or rectangle")->type_name("SHAPE");
    add_word(app, "--radius", "LENGTH", "of the disc (default 25mm)", [&command](const std::string& word) {
        command.radius = parse_length({"--radius"}, word);
        command.has_radius = true;
    });
    add_word(app, "--size", "LENGTHxLENGTH", "of the rectangle (default 20mmx10mm)",
             [&command](const std::string& word) {
                 command.size = parse_length_pair({"--size"}, word);
                 command.has_size = true;
             });
    add_word(app, "--exponent", "N", "intensity falls off as cos^N; 1 (default) is a matt emitter",
             [&command](const std::string& word) {
                 command.exponent = parse_number({"--exponent"}, word, 1, 1000);
             });
    add_word(
        app, "--flux", "NUMBER", "of the whole lamp (default 1000)",
        [&command](const std::string& word) { command.flux = parse_number({"--flux"}, word, 1e-9, 1e12); });
    app.add_option("--unit", command.unit, "of the flux: lm (default) or W")->type_name("UNIT");
    add_word(app, "--colour", "R,G,B", "of the light, linear sRGB; the flux stays (default 1,1,1)",
             [&command](const std::string& word) { command.colour = parse_colour({"--colour"}, word); });
    add_word(app, "--setback", "LENGTH", "of the emitter behind the sampling plane (default 0)",
             [&command](const std::string& word) {
                 command.setback = parse_place({"--setback"}, word);
                 if (command.setback < 0)
                     throw InputError({"--setback"}, "the emitter cannot stand before the plane");
             });
}

}  // namespace

void add_light_acquire(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<AcquireCommand>();
    CLI::App& app = *light.add_subcommand("acquire", "Make a light field of a lamp that has a formula");
    app.footer(kAcquireFooter);
    add_emitter(app, *command);
    add_planes(app, command->views, command->pixels, command->distance);
    add_word(app, "--capture", "SHARE", "of the light that the planes should catch (default 98%)",
             [command](const std::string& word) { command->capture = parse_share({"--capture"}, word); });
    add_lamp_output(app, command->lamp);
    app.callback([command, &context] { act_acquire(*command, context); });
}

}  // namespace lucerna
