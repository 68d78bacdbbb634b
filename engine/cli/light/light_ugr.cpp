// lucerna light ugr: computes the UGR table of a luminaire.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "engine/cli/command_files.h"
#include "engine/cli/light/light_commands.h"
#include "engine/photometry/ugr_table.h"
#include "engine/photometry/ugr_text.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

constexpr const char* kLightUgrFooter =
    R"(Computes the unified glare rating of a luminaire in the 19 standard rooms, for 5 combinations of reflectances, seen
crosswise and endwise: the UGR table of a data sheet, by the tabular method of CIE 117:1995 and CIE 190:2010. Rooms are X
across the line of sight times Y along it, in multiples of H, the height of the luminaires above the eye (2 m). The observer
sits at the middle of a wall and looks at the wall opposite.

UGR = 8 log10(0.25 / L_b sum L^2 w / p^2). A luminaire's luminance L is its intensity over the projected area of its luminous
opening, p is the position index of CIE 117's table. The background L_b follows from the indirect illuminance of the walls:
the share of light that falls on floor, walls and ceiling first, and the interreflection between the three, both computed
(CIE 190 has tables of approximations). Ratings are given for 1000 lm of the lamps, as in the standard, and for the flux
that the file states: more by 8 log10(flux / 1000 lm). --spacing is the spacing of the luminaires over H: 0.25, as data
sheets commonly have it, or 1, as in CIE 190. Tables for other positions of the observer are not computed.

The luminaire hangs with light leaving downwards: nadir of a photometric file, +z of a light field. Crosswise, its axis is
across the line of sight. The axis is C90 in EULUMDAT, TM-33 and GLDF, and C0 in IES files and for light fields, whose x
axis it is; --axis states another one. A light field or a ray file is rated by its far field, for which light at 60 to 85
degrees from nadir counts most; rays and files that state no luminous opening need --opening.

Examples:
  lucerna light ugr office.ldt
  lucerna light ugr lamp.exr -o ugr.csv
  lucerna light ugr lamp.tm25ray --opening 80mmx80mm
  lucerna light ugr office.ies --axis c90 --spacing 1)";

constexpr int kMostPerHeight = 16;  // luminaires per H along each side of the room

struct UgrCommand {
    std::string lamp, csv;
    int per_height = 4;
    std::optional<bool> axis_is_c90;    // none: as the file's format has it
    std::optional<Imath::V2d> opening;  // metres along C0 and C90
    double efficacy = 0;                // lm/W; 0: not given
    Workers workers;
    bool quiet = false;
};

struct RatedLamp {
    PhotometricWeb web;
    FluxUnit unit = FluxUnit::lumen;
    double lumens_per_watt = 0;  // of a lamp in W, according to its file; 0: not stated
};

RatedLamp read_rated_lamp(const UgrCommand& command, Monitor& monitor) {
    if (is_photometric(command.lamp)) return {read_photometric(command.lamp, monitor), FluxUnit::lumen};
    const LampFile file = read_lamp_file(command.lamp, monitor);
    if (const auto* lamp = std::get_if<Lumigraph>(&file))
        return {far_field(*lamp, {}, command.workers, monitor), lamp->unit(), lamp->lumens_per_watt()};
    const RaySet& rays = std::get<RaySet>(file);
    return {far_field(rays, {}), rays.unit, rays.lumens_per_watt};
}

// Returns the lamp in lm, with the opening that was asked for.
PhotometricWeb rated_web(const UgrCommand& command, Monitor& monitor) {
    RatedLamp lamp = read_rated_lamp(command, monitor);
    if (command.opening)
        lamp.web.set_opening({LuminousOpening::Shape::box, V3d(command.opening->x, command.opening->y, 0)});
    if (!(lamp.web.info().opening.faces().second > 0))
        throw InputError(
            "the file states no luminous opening, so that there is no luminance; give its size with "
            "--opening");
    if (!(lamp.web.flux() > 0)) throw InputError("the lamp is dark");
    if (lamp.unit == FluxUnit::lumen) return std::move(lamp.web);
    const double efficacy = command.efficacy > 0 ? command.efficacy : lamp.lumens_per_watt;
    if (!(efficacy > 0))
        throw InputError("the lamp is in W, but UGR needs lm; give the conversion with --efficacy LM_PER_W");
    return scaled(lamp.web, efficacy);
}

// Warns if the luminaire is so asymmetric that its rating depends on which of two opposite sides the observer
// sees.
void warn_of_asymmetry(const UgrLuminaire& luminaire, const UgrTable& table, Monitor& monitor) {
    UgrLuminaire turned = luminaire;
    for (double& c : turned.facing) c += 180;
    const UgrTable other = ugr_table(turned, table.per_height);
    double most = 0;
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        for (const std::size_t view : {kCrosswise, kEndwise}) {
            const double here = table.uncorrected[i][view][0], there = other.uncorrected[i][view][0];
            if (here != there) most = std::fmax(most, std::fabs(here - there));
        }
    }
    if (most > 0.1) {
        monitor.warn(fmt::format(
            "the luminaire is not symmetric: seen from the opposite sides (C{:g} crosswise, C{:g} "
            "endwise) its ratings differ from these by up to {:.1f}",
            turned.facing[kCrosswise], turned.facing[kEndwise], most));
    }
}

void act(const UgrCommand& command, const CommandContext& context) {
    require_readable(photometric_file(command.lamp));
    CommandFiles files;
    files.reads(command.lamp);
    if (!command.csv.empty()) files.writes(command.csv, ".csv", "-o");
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, command.quiet, context.process.stop, {}});
    const PhotometricWeb web = naming(command.lamp, [&] { return rated_web(command, monitor); });
    const bool axis_is_c90 = command.axis_is_c90.value_or(web.info().axis_along_c90);
    const UgrLuminaire luminaire = ugr_luminaire(web, axis_is_c90);
    const UgrTable table = ugr_table(luminaire, command.per_height);
    warn_of_asymmetry(luminaire, table, monitor);
    if (!command.csv.empty()) write_text(command.csv, ugr_csv(table));
    if (command.quiet) return;
    fmt::print(context.out, "{}", ugr_text(table));
    fmt::print(context.out,
               "flux                 {:.6g} lm, of {:.6g} lm of the lamps\n"
               "correction           {:+.2f} = 8 log10({:.6g} lm / 1000 lm), from 1000 lm to the lamps\n"
               "axis                 {}; the observer sees C{:g} crosswise, C{:g} endwise\n",
               web.flux(), table.lamp_flux, table.correction(), table.lamp_flux, axis_is_c90 ? "C90" : "C0",
               luminaire.facing[kCrosswise], luminaire.facing[kEndwise]);
}

int parse_spacing(const std::string& word) {
    const double spacing = parse_number({"--spacing"}, word, 1.0 / kMostPerHeight, 1);
    const double per_height = std::round(1 / spacing);
    if (std::fabs(spacing * per_height - 1) > 1e-3)
        input_error({"--spacing"},
                    "{} does not divide the sides of the rooms; expected 1, 0.5, 0.25, 0.2 or another 1/N",
                    word);
    return static_cast<int>(per_height);
}

bool parse_axis(const std::string& word) {
    if (word != "c0" && word != "c90")
        input_error({"--axis"}, "\"{}\" is unknown; expected c0 or c90", one_line(word));
    return word == "c90";
}

}  // namespace

void add_light_ugr(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<UgrCommand>();
    CLI::App& app = *light.add_subcommand("ugr", "Compute the UGR table of a luminaire (CIE 190)");
    app.footer(kLightUgrFooter);
    app.add_option(
           "LAMP", command->lamp,
           "light field (.exr), rays (.tm25ray, .dat, .ray) or photometric file (.ies, .ldt, .xml, .gldf)")
        ->type_name("FILE")
        ->required();
    app.add_option("-o,--output", command->csv, "the ratings, one a line, each with the method's name")
        ->type_name("FILE.csv");
    add_word(app, "--spacing", "RATIO",
             "spacing of the luminaires over their height above the eye, 1/N (default 0.25)",
             [command](const std::string& word) { command->per_height = parse_spacing(word); });
    add_word(app, "--axis", "PLANE",
             "c0 or c90: the plane that holds the luminaire's axis (default: c90 of EULUMDAT, TM-33 and "
             "GLDF, c0 of others)",
             [command](const std::string& word) { command->axis_is_c90 = parse_axis(word); });
    add_word(
        app, "--opening", "SIZE",
        "luminous opening, a rectangle: its lengths along C0 and C90, for example 1200mmx100mm "
        "(default: as the file states)",
        [command](const std::string& word) { command->opening = parse_length_pair({"--opening"}, word); });
    add_efficacy(app, command->efficacy);
    add_threads(app, command->workers);
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
