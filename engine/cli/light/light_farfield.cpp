// lucerna light farfield: computes a lamp's far field, as a polar diagram or a photometric file.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/cli/command_files.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/light/light_commands.h"
#include "engine/colour/chromaticity.h"
#include "engine/system/files.h"
#include "lights/measurement/colour_over_angle.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

// Draws the luminous intensity distribution as a polar diagram of two planes, in SVG.

using Imath::V2d;

constexpr double kRadius = 250, kMargin = 50, kHead = 64, kFoot = 44;  // pixels
constexpr double kWidth = 2 * (kRadius + kMargin);
constexpr double kFaint = 0.02;  // of the peak: smaller intensities above the horizon are not drawn
constexpr double kStep = 0.5;    // degrees between the points of a curve

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '&') {
            result += "&amp;";
        } else if (c == '<') {
            result += "&lt;";
        } else if (c == '>') {
            result += "&gt;";
        } else {
            result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        }
    }
    return result;
}

// Returns 1, 2 or 5 times a power of ten that divides `peak` > 0 into four to ten steps.
double nice_step(double peak) {
    const double rough = peak / 4;
    const double power = pow(10, std::floor(log10(rough)));
    for (const double factor : {5.0, 2.0}) {
        if (factor * power <= rough) return factor * power;
    }
    return power;
}

struct Plot {
    const PhotometricWeb& web;
    bool up, down;      // half planes that are drawn
    double step, most;  // intensity between rings, and of the largest ring
    V2d centre;         // pixels

    double height() const { return kHead + kFoot + (up ? kRadius + 20 : 14) + (down ? kRadius + 20 : 14); }
    // Returns the point at γ in degrees, to the right for `side` 1 and to the left for -1.
    V2d at(double gamma, double side, double share) const {
        const double angle = gamma * M_PI / 180;
        return centre + share * kRadius * V2d(side * sin(angle), cos(angle));
    }
};

Plot plan(const PhotometricWeb& web) {
    double above = 0, below = 0;
    for (double c = 0; c < 360; c += 15) {
        for (double gamma = 0; gamma <= 180; gamma += 1) {
            const double value = web.intensity(web.direction(gamma, c));
            (gamma > 90 ? above : below) = std::max(gamma > 90 ? above : below, value);
        }
    }
    const double peak = std::max({above, below, 1e-12});
    Plot plot{web, above > kFaint * peak, below > kFaint * peak, nice_step(peak), 0, {0, 0}};
    plot.most = std::ceil(peak / plot.step - 1e-9) * plot.step;
    plot.centre = V2d(kWidth / 2, kHead + (plot.up ? kRadius + 20 : 14));
    return plot;
}

// Returns the angles at which the drawn half planes begin and end.
std::pair<double, double> drawn_angles(const Plot& plot) {
    return {plot.down ? 0 : 90, plot.up ? 180 : 90};
}

void append_grid(std::string& svg, const Plot& plot, std::string_view unit) {
    const auto [first, last] = drawn_angles(plot);
    const int rings = static_cast<int>(std::lround(plot.most / plot.step));
    svg += "<g fill=\"none\" stroke=\"#c4c4c4\" stroke-width=\"1\">\n";
    for (int ring = 1; ring <= rings; ++ring) {
        const double share = static_cast<double>(ring) / rings;
        for (const double side : {-1.0, 1.0}) {
            const V2d from = plot.at(first, side, share), to = plot.at(last, side, share);
            // From nadir to zenith the right half is counterclockwise on the page.
            svg += fmt::format("<path d=\"M{:.2f} {:.2f}A{:.2f} {:.2f} 0 0 {} {:.2f} {:.2f}\"/>\n", from.x,
                               from.y, share * kRadius, share * kRadius, side > 0 ? 0 : 1, to.x, to.y);
        }
    }
    for (double gamma = first; gamma <= last; gamma += 15) {
        for (const double side : {-1.0, 1.0}) {
            const V2d end = plot.at(gamma, side, 1);
            svg += fmt::format("<path d=\"M{:.2f} {:.2f}L{:.2f} {:.2f}\"/>\n", plot.centre.x, plot.centre.y,
                               end.x, end.y);
        }
    }
    svg += "</g>\n<g font-size=\"11\" fill=\"#555\" text-anchor=\"middle\">\n";
    for (double gamma = first; gamma <= last; gamma += 30) {
        for (const double side : {-1.0, 1.0}) {
            if (side < 0 && (gamma == 0 || gamma == 180)) continue;
            const V2d place = plot.at(gamma, side, 1.06);
            svg += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\">{:g}°</text>\n", place.x, place.y + 4, gamma);
        }
    }
    svg += "</g>\n<g font-size=\"10\" fill=\"#555\">\n";
    for (int ring = 1; ring <= rings; ++ring) {
        const V2d place = plot.at(plot.down ? 7.5 : 172.5, 1, static_cast<double>(ring) / rings);
        svg += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\">{:g}{}{}</text>\n", place.x + 2, place.y - 2,
                           ring * plot.step, ring == rings ? " " : "", ring == rings ? unit : "");
    }
    svg += "</g>\n";
}

// Draws a plane as one line, with its half at `right` on the right and the other one on the left.
void append_curve(std::string& svg, const Plot& plot, double right, std::string_view style) {
    const double first = plot.down ? 0 : 90, last = plot.up ? 180 : 90;
    svg += "<path fill=\"none\" ";
    svg += style;
    svg += " d=\"";
    char command = 'M';
    const auto append = [&](double gamma, double side) {
        const double c = side > 0 ? right : right + 180;
        const V2d p = plot.at(gamma, side, plot.web.intensity(plot.web.direction(gamma, c)) / plot.most);
        svg += fmt::format("{}{:.2f} {:.2f}", command, p.x, p.y);
        command = 'L';
    };
    const int count = static_cast<int>((last - first) / kStep);
    for (int i = count; i >= 0; --i) append(first + i * kStep, -1);
    for (int i = 0; i <= count; ++i) append(first + i * kStep, 1);
    svg += plot.up && plot.down ? "Z\"/>\n" : "\"/>\n";
}

// Returns the diagram with nadir down, the plane C0-C180 solid and C90-C270 dashed; a half plane without
// light is omitted. `unit` is that of the intensities, "cd" or "W/sr", and `flux_unit` that of the flux.
std::string polar_plot_svg(const PhotometricWeb& given, std::string_view title, std::string_view unit,
                           std::string_view flux_unit) {
    // The diagram shows C planes.
    const PhotometricWeb web = given.grid().planes == PhotometricPlanes::c ? given : resampled({given}, 1, 5);
    const Plot plot = plan(web);
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
        "height=\"{1:g}\" font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"white\"/>\n",
        kWidth, plot.height());
    svg += fmt::format("<text x=\"20\" y=\"26\" font-size=\"15\">{}</text>\n", escaped(title));
    svg += fmt::format(
        "<text x=\"20\" y=\"46\" font-size=\"12\" fill=\"#555\">flux {:.5g} {}, peak {:.5g} "
        "{}</text>\n",
        web.flux(), flux_unit, web.peak(), unit);
    append_grid(svg, plot, unit);
    constexpr std::string_view kSolid = "stroke=\"#c0392b\" stroke-width=\"2\"";
    constexpr std::string_view kDashed = "stroke=\"#1f5fa8\" stroke-width=\"2\" stroke-dasharray=\"7 4\"";
    append_curve(svg, plot, 90, kDashed);
    append_curve(svg, plot, 0, kSolid);
    const double y = plot.height() - 20;
    const auto legend = [&](double x, std::string_view style, std::string_view text) {
        svg += fmt::format(
            "<path {} d=\"M{:g} {:g}h36\"/><text x=\"{:g}\" y=\"{:g}\" font-size=\"12\">{}"
            "</text>\n",
            style, x, y - 4, x + 44, y, text);
    };
    legend(20, kSolid, "C180 (left) - C0 (right)");
    legend(300, kDashed, "C270 (left) - C90 (right)");
    return svg + "</svg>\n";
}

constexpr const char* kLightFarfieldFooter =
    R"(The far field describes a lamp by direction alone, valid at distances of more than about five times its size (measured in
docs/explanation/near-and-far.md). -o NAME.svg draws the polar diagram of the planes C0-C180 and C90-C270;
-o NAME.ies writes IES LM-63-2002, absolute, with the part of the lamp that shines as its luminous opening; -o NAME.csv
writes the colour over angle: for each direction the chromaticity, its distance from that of the axis and of all light
(delta u'v'), the colour temperature and Duv. -o may be repeated.
Intensities of rays are means over caps around each direction, whose radius is the smallest of 0.1 to 10 degrees that holds
400 rays at the peak.
A photometric file is in lm. A lamp in W is converted by the efficacy that its file states, or by --efficacy.

Examples:
  lucerna light farfield lamp.exr -o lamp.svg
  lucerna light farfield lamp.tm25ray -o lamp.ies -o lamp.svg --step 2.5
  lucerna light farfield white-led.exr -o colour.csv --plane-step 90
  lucerna light farfield street.ldt -o street.ies
  lucerna light farfield lamp-in-watts.exr -o lamp.ies --efficacy 320)";

bool is_colour_table(const std::string& output) {
    return suffix_of(output) == ".csv";
}

struct FarFieldOptions {
    std::string lamp;
    std::vector<std::string> outputs;
    FarFieldGrid grid;
    double efficacy = 0;  // lm/W; 0: not given
    Workers workers;
    bool quiet = false;
};

struct Lamp {
    PhotometricWeb web;
    FluxUnit unit;
    std::optional<AngularColours> colours;  // if there are several, or a file of them is requested
    double lumens_per_watt = 0;             // of a lamp in W, according to its file; 0: not stated
};

Lamp read_lamp(const FarFieldOptions& options, Monitor& monitor) {
    const bool wanted = std::any_of(options.outputs.begin(), options.outputs.end(), is_colour_table);
    if (is_photometric(options.lamp)) {
        if (wanted)
            throw InputError({options.lamp},
                             "a photometric file has no colours; a .csv needs a light field or rays");
        return {read_photometric(options.lamp, monitor), FluxUnit::lumen, {}};
    }
    std::optional<AngularColours> colours;
    if (suffix_of(options.lamp) == ".exr") {
        const Lumigraph lamp = read_lumigraph(options.lamp);
        if (wanted || lamp.coloured())
            colours = colours_over_angle(lamp, options.grid, options.workers, monitor);
        return {far_field(lamp, options.grid, options.workers, monitor), lamp.unit(), colours,
                lamp.lumens_per_watt()};
    }
    const RaySet rays = read_rays(options.lamp, monitor);
    if (wanted || rays.coloured()) colours = colours_over_angle(rays, options.grid);
    return {far_field(rays, options.grid), rays.unit, colours, rays.lumens_per_watt};
}

// Prints rings of directions every ten degrees where there is significant light.
void print_colours(std::ostream& out, const AngularColours& colours) {
    constexpr double kShown = 0.01, kStated = 0.1;  // of the peak
    fmt::print(out,
               "colour over angle    largest delta u'v' {:.4f} from the mean of all light, over directions "
               "with at least a tenth of the peak\n",
               colours.largest_delta(kStated));
    fmt::print(out, "  angle  of the peak  from axis  from mean    CCT      Duv\n");
    const double peak = colours.peak();
    double next = 0;
    for (std::size_t i = 0; i < colours.polar.size(); ++i) {
        if (colours.polar[i] < next - 1e-6) continue;
        next = colours.polar[i] + 10;
        const V3d xyz = colours.over_planes(i);
        if (!(xyz.y > kShown * peak)) continue;
        const auto temperature = colour_temperature(xyz);
        fmt::print(out, "  {:>5g}  {:>10.3f}   {:>8.4f}  {:>9.4f}  {}\n", colours.polar[i], xyz.y / peak,
                   colours.on_axis().y > 0 ? delta_uv(xyz, colours.on_axis()) : NAN,
                   delta_uv(xyz, colours.mean),
                   temperature ? fmt::format("{:>6.0f} {:>8.4f}", temperature->kelvin, temperature->duv)
                               : std::string("  none"));
    }
}

void declare_files(const FarFieldOptions& options) {
    CommandFiles files;
    files.reads(options.lamp);
    for (const std::string& output : options.outputs) {
        const std::string suffix = suffix_of(output);
        if (suffix != ".svg" && suffix != ".ies" && suffix != ".csv")
            throw InputError({output},
                             fmt::format("\"{}\" cannot be written; expected .svg, .ies or .csv", suffix));
        files.writes(output, suffix, "-o");
    }
}

Lamp in_lumens(Lamp lamp, double efficacy) {
    if (lamp.colours) {
        for (V3d& xyz : lamp.colours->xyz) xyz *= efficacy;
        lamp.colours->mean *= efficacy;
    }
    return {scaled(lamp.web, efficacy), FluxUnit::lumen, std::move(lamp.colours)};
}

void act(const FarFieldOptions& options, const CommandContext& context) {
    require_readable(photometric_file(options.lamp));
    declare_files(options);
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, options.quiet, context.process.stop, {}});
    Lamp lamp = naming(options.lamp, [&] { return read_lamp(options, monitor); });
    const auto is_file = [](const std::string& output) { return suffix_of(output) == ".ies"; };
    const bool to_file = std::any_of(options.outputs.begin(), options.outputs.end(), is_file);
    const double efficacy = options.efficacy > 0 ? options.efficacy : to_file ? lamp.lumens_per_watt : 0;
    if (lamp.unit == FluxUnit::watt && efficacy > 0) lamp = in_lumens(std::move(lamp), efficacy);
    const bool photometric = lamp.unit == FluxUnit::lumen;
    if (!photometric && to_file) {
        throw InputError(
            {options.lamp},
            "the lamp is in W, but an .ies file is in lm; give the conversion with --efficacy LM_PER_W");
    }
    const std::string title = std::filesystem::path(options.lamp).stem().string();
    for (const std::string& output : options.outputs) {
        if (is_colour_table(output)) {
            write_text(output, colours_csv(*lamp.colours, title, photometric ? "cd" : "w_per_sr"));
        } else if (suffix_of(output) == ".svg") {
            write_text(output, polar_plot_svg(lamp.web, title, photometric ? "cd" : "W/sr",
                                              flux_unit_name(lamp.unit)));
        } else {
            write_ies(output, lamp.web, title);
        }
    }
    if (options.quiet) return;
    print_photometric(context.out, lamp.web, lamp.unit);
    if (lamp.colours) print_colours(context.out, *lamp.colours);
}

}  // namespace

void add_light_farfield(CLI::App& light, const CommandContext& context) {
    const auto options = std::make_shared<FarFieldOptions>();
    CLI::App& app =
        *light.add_subcommand("farfield", "Compute a lamp's far field: polar diagram, photometric file");
    app.footer(kLightFarfieldFooter);
    app.add_option(
           "LAMP", options->lamp,
           "light field (.exr), rays (.tm25ray, .dat, .ray) or photometric file (.ies, .ldt, .xml, .gldf)")
        ->type_name("FILE")
        ->required();
    app.add_option("-o,--output", options->outputs,
                   "polar diagram (.svg), photometric file (.ies) or colours (.csv); may be repeated")
        ->type_name("FILE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--step", "DEGREES", "step of the angle from nadir, a divisor of 90 (default 1)",
             [options](const std::string& word) {
                 options->grid.polar_step = parse_number({"--step"}, word, 0.05, 45);
             });
    add_word(app, "--plane-step", "DEGREES", "step between C planes, a divisor of 360 (default 5)",
             [options](const std::string& word) {
                 options->grid.azimuth_step = parse_number({"--plane-step"}, word, 0.05, 90);
             });
    add_efficacy(app, options->efficacy);
    add_threads(app, options->workers);
    app.add_flag("--quiet", options->quiet, "print warnings and errors only");
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
