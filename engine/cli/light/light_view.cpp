// lucerna light view: shows all views of a light field on one sheet.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "engine/cli/command_files.h"
#include "engine/cli/light/light_commands.h"
#include "engine/colour/spectrum.h"
#include "engine/colour/tone.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/image/image.h"
#include "engine/system/files.h"
#include "lights/measurement/join_sides.h"

namespace lucerna {
namespace {

constexpr const char* kViewFooter =
    R"(Shows one small image per filter position, arranged like the filter positions, as seen by an observer looking towards the
lamp: u and s to the right, v and t up. Light has the lamp's colour; negative coefficients, which are caused by edges and
noise, are blue. All views share one exposure, so that bright ones are brighter.

Examples:
  lucerna light view lamp.exr -o views.png
  lucerna light view bulb.exr --slab=-x -o left.png
  lucerna light view lamp.exr -o middle.png --views 5x5 --exposure 2)";

constexpr double kBrightest = 0.999;  // share of the coefficients that are shown unclipped

struct ViewCommand {
    std::string lamp, output;
    V2i views{0, 0};               // the central ones; 0: all
    std::optional<SlabAxes> slab;  // for a lamp of several slabs; none: the only one
    double exposure = 1;
    int side = 2048;  // maximum, pixels
};

// The range of views shown along one axis.
struct Shown {
    int first, count;
};

Shown shown_views(int wanted, int all) {
    const int count = wanted > 0 ? std::min(wanted, all) : all;
    return {(all - count) / 2, count};
}

Image sheet_of(const LightField& field, const ViewCommand& command) {
    const Rig& rig = field.rig();
    const Shown across = shown_views(command.views.x, rig.views.x);
    const Shown up = shown_views(command.views.y, rig.views.y);
    std::vector<double> values;
    for (const float e : field.coefficients()) {
        if (e > 0) values.push_back(double{e});
    }
    const double bright = level(std::move(values), kBrightest);
    const double gain = bright > 0 ? 0.75 * command.exposure / bright : 0.0;
    const Rgb colour = colour_of_luminance_one(field.info().colour);
    const Rgb negative(0.1F, 0.3F, 1.0F);
    const auto view = [&](int m, int n) {
        Image image = Image::rgb(rig.pixels.x, rig.pixels.y);
        for (int k = 0; k < rig.pixels.x; ++k) {
            for (int l = 0; l < rig.pixels.y; ++l) {
                const float shown = static_cast<float>(gain * double{field.coefficient(m, n, k, l)});
                image.set_rgb(k, rig.pixels.y - 1 - l, shown >= 0 ? shown * colour : -shown * negative);
            }
        }
        return image;
    };
    // Shrinks each view separately, as a whole sheet of a large field would not fit into memory.
    const int longest = std::max(across.count * rig.pixels.x, up.count * rig.pixels.y);
    const int factor = (longest + command.side - 1) / command.side;
    const V2i size((rig.pixels.x + factor - 1) / factor, (rig.pixels.y + factor - 1) / factor);
    constexpr int kGap = 1;
    return contact_sheet(
        across.count * up.count, across.count, size, kGap, [&](int i, Image& sheet, int left, int top) {
            const Image small = shrunk(
                view(across.first + i % across.count, up.first + up.count - 1 - i / across.count), factor);
            for (int y = 0; y < size.y; ++y) {
                for (int x = 0; x < size.x; ++x) sheet.set_rgb(left + x, top + y, small.rgb_at(x, y));
            }
        });
}

// Returns the only slab, or the requested one.
const LightField& field_shown(const Lumigraph& lamp, const ViewCommand& command) {
    std::string sides;
    for (const Slab& slab : lamp.slabs()) {
        if (command.slab ? slab.axes.n == command.slab->n : lamp.slabs().size() == 1) return slab.field;
        sides += (sides.empty() ? "" : ", ") + slab.axes.name();
    }
    if (command.slab) {
        input_error({command.lamp}, "no light field for the side {}; expected --slab {}",
                    command.slab->name(), sides);
    }
    input_error({command.lamp},
                "has light fields of several sides, and a sheet shows one; choose one with --slab: {}",
                sides);
}

void act_view(const ViewCommand& command, const CommandContext& context) {
    require_readable(command.lamp);
    CommandFiles files;
    files.reads(command.lamp);
    files.writes(command.output, ".png", "-o");
    const Lumigraph lamp = read_lumigraph(command.lamp);
    const Image sheet = sheet_of(field_shown(lamp, command), command);
    write_png(command.output, sheet, {});
    fmt::print(context.out, "{}: {} x {} pixels\n", command.output, sheet.width, sheet.height);
}

}  // namespace

void add_light_view(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<ViewCommand>();
    CLI::App& app = *light.add_subcommand("view", "Show all views of a light field on one sheet");
    app.footer(kViewFooter);
    app.add_option("LAMP", command->lamp, "light field (.exr)")->required()->type_name("LAMP.exr");
    app.add_option("-o,--output", command->output, "the picture")->type_name("SHEET.png")->required();
    add_word(app, "--views", "WxH", "show only this many views, around the middle (default: all)",
             [command](const std::string& word) { command->views = parse_size({"--views"}, word, 65534); });
    add_word(app, "--slab", "AXIS", "slab of a lamp with several slabs, for example -x",
             [command](const std::string& word) { command->slab = parse_side("--slab", word); });
    add_word(app, "--exposure", "FACTOR", "factor on the automatic exposure (default 1)",
             [command](const std::string& word) {
                 command->exposure = parse_number({"--exposure"}, word, 1e-6, 1e6);
             });
    add_word(app, "--side", "PIXELS", "longest side of the sheet; larger ones are scaled down (default 2048)",
             [command](const std::string& word) {
                 command->side = static_cast<int>(parse_whole({"--side"}, word, 64, 16384));
             });
    app.callback([command, &context] { act_view(*command, context); });
}

}  // namespace lucerna
