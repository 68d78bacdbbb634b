// lucerna light project: computes the light that a lamp casts on a screen across its beam.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "engine/cli/command_files.h"
#include "engine/cli/light/light_commands.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/spectrum.h"
#include "engine/colour/tone.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/figures/figure.h"
#include "engine/image/image.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "lights/measurement/colour_over_angle.h"
#include "lights/measurement/join_sides.h"
#include "lights/measurement/plane_irradiance.h"

namespace lucerna {
namespace {

constexpr const char* kProjectFooter =
    R"(The screen is perpendicular to the lamp's axis. The image shows it from the front, as seen by an observer looking towards
the lamp: x to the right, y up. Its values are irradiance, W/m2, or lux for a lamp whose file is in lumens.

The distance of the screen is measured from the sampling plane S of a light field, from the middle of the box of a lamp of
several slabs, and from the origin of the frame of a ray file; with --height it is given in the frame of the lamp's
file. With --side the screen is on another side of the lamp than +z, perpendicular to that axis; all slabs that send
light there are included. x on the screen is then horizontal (+x of the frame for -y, -x for -z and +y, +y for +x, -y for
-x) and y is the frame's z (y for -z). Without --size each screen holds about 96 % of the
light in each direction. Several distances make a series: one image for each, and with --png one picture of all,
each with its own exposure and, below it, its distance (or height), the screen's width and height, the largest and the
mean irradiance, and a scale bar.

With --chromaticity a second image, NAME-chromaticity.exr, is written for each image: u' in its red channel, v' in
green, and in blue delta u'v', the distance from the colour of all the light on the screen; 0 where there is
less than a hundredth of the brightest light. With --png also a picture of that distance: pale at 0.05, black at 0.

Examples:
  lucerna light project lamp.exr --distance 1m -o wall.exr --png
  lucerna light project lamp.exr --distance 5mm,20mm,80mm,320mm -o beam.exr --png
  lucerna light project lamp.exr --distance 1m --reconstruction approximate -o approximate.exr
  lucerna light project bulb.exr --side=-x --distance 1m --size 2mx2m -o left.exr --png
  lucerna light project lamp.tm25ray --distance 1m --size 4mx4m --pixels 100x100 -o counted.exr)";

struct ProjectCommand {
    std::string lamp, output;
    SlabAxes side;                  // side of the lamp that faces the screen, whose axes are the screen's
    std::vector<double> distances;  // metres
    bool heights = false;           // distances are positions in the frame of the lamp's file
    std::optional<V2d> size, centre;
    V2i pixels{512, 512};
    Reconstruction reconstruction = Reconstruction::exact;
    bool has_pixels = false, png = false, chromaticity = false, quiet = false;
    Workers workers;
};

// Returns the origin of distances, along the side's axes in the frame of the lamp's file.
V3d origin_of(const ProjectCommand& command, const LampFile& lamp) {
    const auto* field = std::get_if<Lumigraph>(&lamp);
    if (!field) return V3d(0);
    return command.side.to_slab(field->simple() ? field->slabs()[0].field.rig().centre
                                                : field->box().center());
}

// Transforms rays to the side's axes; leaves them unchanged for +z.
LampFile seen_from(const SlabAxes& side, LampFile lamp) {
    auto* set = std::get_if<RaySet>(&lamp);
    if (!set || side.straight()) return lamp;
    for (LampRay& ray : set->rays) {
        ray.o = V3f(side.to_slab(V3d(ray.o)));
        ray.d = V3f(side.to_slab(V3d(ray.d)));
    }
    return lamp;
}

Rgb colour_of(const LampFile& lamp) {
    const auto* field = std::get_if<Lumigraph>(&lamp);
    return field ? field->colour() : std::get<RaySet>(lamp).colour();
}

std::string_view irradiance_unit(FluxUnit unit) {
    return unit == FluxUnit::lumen ? "lx" : "W/m2";
}

// Returns "beam-20mm.exr" for "beam.exr".
std::filesystem::path name_of(const ProjectCommand& command, double distance) {
    std::filesystem::path file = command.output;
    if (command.distances.size() == 1) return file;
    const std::filesystem::path extension = file.extension();
    return file.replace_filename(
        fmt::format("{}-{:g}mm{}", file.stem().string(), distance * 1e3, extension.string()));
}

std::filesystem::path sheet_of(const ProjectCommand& command) {
    return png_beside(command.output);
}

// Returns "beam-20mm-chromaticity.exr" for "beam-20mm.exr".
std::filesystem::path beside(const std::filesystem::path& file, std::string_view suffix) {
    std::filesystem::path other = file;
    return other.replace_filename(fmt::format("{}-chromaticity{}", file.stem().string(), suffix));
}

// Irradiance as luminance Y, and X and Z for a lamp of several colours.
struct ColouredPlane {
    PlaneIrradiance luminance;
    std::optional<PlaneIrradiance> x, z;
};

// Tells whether the lamp is a single light field along +z, in its own frame.
bool is_plain(const ProjectCommand& command, const Lumigraph& lamp) {
    return lamp.simple() && command.side.straight();
}

ColouredPlane project_channels(const ProjectCommand& command, const LampFile& lamp, const PlanePatch& patch,
                               Monitor& monitor) {
    const Workers& workers = command.workers;
    if (const auto* whole = std::get_if<Lumigraph>(&lamp)) {
        const auto at_side = [&](const Lumigraph& seen) {
            if (is_plain(command, seen))
                return project(seen.slabs()[0].field, patch, workers, monitor, command.reconstruction);
            // The plane is placed in the frame of the lamp's file.
            const V3d origin = origin_of(command, lamp);
            PlanePatch placed = patch;
            placed.distance += origin.z;
            placed.centre += V2d(origin.x, origin.y);
            PlaneIrradiance cast = project(seen, command.side, placed, workers, monitor);
            cast.patch = patch;
            return cast;
        };
        if (!whole->coloured()) return {at_side(*whole), {}, {}};
        return {at_side(whole->channel(1)), at_side(whole->channel(0)), at_side(whole->channel(2))};
    }
    const RaySet& set = std::get<RaySet>(lamp);
    if (!set.coloured()) return {project(set, patch), {}, {}};
    return {project(set.channel(1), patch), project(set.channel(0), patch), project(set.channel(2), patch)};
}

ColouredPlane project_at(const ProjectCommand& command, const LampFile& lamp, double distance,
                         Monitor& monitor) {
    constexpr double kSamePlane = 1e-9;  // metres, as a file may store the plane's height as a float
    const V3d origin = origin_of(command, lamp);
    // The height is along the side's normal, which may be opposite to the frame's axis.
    const double height = command.side.n.dot(V3d(1)) < 0 ? -distance : distance;
    double z = command.heights ? height - origin.z : distance;
    if (std::fabs(z) < kSamePlane) z = 0;
    const auto* whole = std::get_if<Lumigraph>(&lamp);
    const LightField* field = whole && is_plain(command, *whole) ? &whole->slabs()[0].field : nullptr;
    if (field && z < 0) {
        input_error({command.heights ? "--height" : "--distance"},
                    "{} is not accepted: it lies behind the lamp's sampling plane, at height {}",
                    length_text(distance), length_text(origin.z));
    }
    PlanePatch patch{z, {0, 0}, {1, 1}, command.pixels};
    if (!command.size) {
        if (field) {
            patch = frame_light(*field, z, command.pixels.x, command.workers, monitor);
        } else if (whole) {
            patch =
                frame_light(*whole, command.side, z + origin.z, command.pixels.x, command.workers, monitor);
            patch.distance = z;
            patch.centre -= V2d(origin.x, origin.y);
        } else {
            patch = frame_light(std::get<RaySet>(lamp), z, command.pixels.x);
        }
        patch.size.y = patch.size.x * command.pixels.y / command.pixels.x;
        patch.pixels = command.pixels;
    } else {
        patch.size = *command.size;
    }
    if (command.centre) patch.centre = *command.centre - V2d(origin.x, origin.y);
    return project_channels(command, lamp, patch, monitor);
}

// Returns the image with rows from the top. Negative values due to noise are kept.
Image image_of(const ColouredPlane& coloured, const LampFile& lamp) {
    const PlaneIrradiance& plane = coloured.luminance;
    Image image = Image::rgb(plane.patch.pixels.x, plane.patch.pixels.y);
    const Rgb colour = colour_of(lamp);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb rgb = coloured.x
                                ? xyz_to_rgb({coloured.x->at(x, y), plane.at(x, y), coloured.z->at(x, y)})
                                : static_cast<float>(plane.at(x, y)) * colour;
            image.set_rgb(x, image.height - 1 - y, rgb);
        }
    }
    image.attributes["lucerna.unit"] = irradiance_unit(unit_of(lamp));
    image.attributes["screen"] =
        fmt::format("{} x {}, {} from the sampling plane", length_text(plane.patch.size.x),
                    length_text(plane.patch.size.y), length_text(plane.patch.distance));
    return image;
}

// Paints the image, display-referred, with its brightest pixels just below white.
void paint_exposed(const Image& image, Image& sheet, int left, int top) {
    std::vector<double> values;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) values.push_back(double{luminance(image.rgb_at(x, y))});
    }
    constexpr double kBrightest = 0.999, kShown = 0.75;
    const double bright = level(values, kBrightest);
    const float exposure = bright > 0 ? static_cast<float>(kShown / bright) : 0.0F;
    const Display display({.exposure = exposure}, image.space);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sheet.set_rgb(left + x, top + y, display(image.rgb_at(x, y)));
    }
}

// Returns u', v' and Δu'v' from the mean for an image of irradiance.
Image chromaticity_of(const Image& image) {
    constexpr float kLeast = 0.01F;  // of the brightest pixel
    V3d sum(0, 0, 0);
    float brightest = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            sum += rgb_to_xyz(image.rgb_at(x, y));
            brightest = std::max(brightest, luminance(image.rgb_at(x, y)));
        }
    }
    Image map = Image::rgb(image.width, image.height);
    map.attributes["lucerna.channels"] = "u', v' and delta u'v' of CIE 1976";
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb rgb = image.rgb_at(x, y);
            const V3d xyz = rgb_to_xyz(rgb);
            const bool seen = luminance(rgb) > kLeast * brightest && xyz.x + xyz.y + xyz.z > 0;
            if (!seen) {
                map.set_rgb(x, y, Rgb(0.0F));
                continue;
            }
            const Chromaticity at = chromaticity(xyz);
            const double off = sum.y > 0 ? delta_uv(xyz, sum) : 0;
            map.set_rgb(x, y,
                        Rgb(static_cast<float>(at.u), static_cast<float>(at.v), static_cast<float>(off)));
        }
    }
    return map;
}

void write_chromaticity(const std::filesystem::path& file, const Image& image, bool picture) {
    const Image map = chromaticity_of(image);
    write_exr(beside(file, ".exr"), map);
    if (!picture) return;
    constexpr double kPale = 0.05;  // Δu'v'
    Image off(map.width, map.height, {"Y"});
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) off.value(x, y, 0) = map.rgb_at(x, y).z;
    write_png_display(beside(file, ".png"), magma_picture(off, kPale));
}

// One screen of the series' picture.
struct ShownScreen {
    Image image;
    std::vector<std::string> lines;  // of its caption
    double width;                    // of the screen, metres
};

ShownScreen shown_of(const ProjectCommand& command, double distance, const PlaneIrradiance& plane,
                     Image image) {
    const V2d& size = plane.patch.size;
    const std::string unit = unit_as_written(image.attributes.at("lucerna.unit"));
    return {std::move(image),
            {fmt::format("{} {}", command.heights ? "height" : "distance", length_text(distance)),
             fmt::format("{} × {}", length_text(size.x), length_text(size.y)),
             fmt::format("peak {} {}", value_text(plane.peak()), unit),
             fmt::format("mean {} {}", value_text(plane.flux() / (size.x * size.y)), unit)},
            size.x};
}

void write_series_picture(const ProjectCommand& command, const std::vector<ShownScreen>& screens) {
    constexpr int kWidest = 2400, kPerRow = 3, kGap = 4;
    constexpr double kBarShare = 0.2;  // least length of the bar, of the screen's width
    const std::filesystem::path file = sheet_of(command);
    const int count = static_cast<int>(screens.size());
    const int columns = std::min(count, kPerRow);
    const int factor = (columns * command.pixels.x + kWidest - 1) / kWidest;
    std::vector<Image> small;
    std::vector<Caption> captions;
    int width = 0;
    for (const ShownScreen& shown : screens) {
        small.push_back(shrunk(shown.image, factor));
        const double bar = round_step_from(kBarShare * shown.width).value();
        const double pixels = bar / shown.width * command.pixels.x / factor;
        captions.push_back({shown.lines, pixels, length_text(bar)});
        width = std::max({width, small.back().width, caption_width(captions.back())});
    }
    std::vector<Image> below;
    for (const Caption& caption : captions) below.push_back(drawn(caption_svg(caption, width), file));
    const int height = small[0].height;
    const Image sheet =
        contact_sheet(count, columns, {width, height + below[0].height}, kGap,
                      [&](int i, Image& target, int left, int top) {
                          const auto n = static_cast<std::size_t>(i);
                          for (int y = 0; y < height; ++y) {
                              for (int x = small[n].width; x < width; ++x)
                                  target.set_rgb(left + x, top + y, Rgb(1));
                          }
                          paint_exposed(small[n], target, left, top);
                          for (int y = 0; y < below[n].height; ++y) {
                              for (int x = 0; x < width; ++x)
                                  target.set_rgb(left + x, top + height + y, below[n].rgb_at(x, y));
                          }
                      });
    write_png_display(file, sheet);
}

void print_plane(std::ostream& out, const ProjectCommand& command, double distance,
                 const PlaneIrradiance& plane, const LampFile& lamp) {
    const FluxUnit unit = unit_of(lamp);
    V2d moment(0, 0);
    double flux = 0;
    for (int y = 0; y < plane.patch.pixels.y; ++y) {
        for (int x = 0; x < plane.patch.pixels.x; ++x) {
            const V2d at = plane.patch.centre + V2d((x + 0.5) / plane.patch.pixels.x - 0.5,
                                                    (y + 0.5) / plane.patch.pixels.y - 0.5) *
                                                    plane.patch.size;
            flux += plane.at(x, y);
            moment += at * plane.at(x, y);
        }
    }
    const V3d origin = origin_of(command, lamp);
    if (flux > 0) moment = moment / flux + V2d(origin.x, origin.y);
    fmt::print(out, "{:<10} {} x {}: flux {:.5g} {}, peak {:.5g} {}, centroid ({}, {})  {}\n",
               length_text(distance), length_text(plane.patch.size.x), length_text(plane.patch.size.y),
               plane.flux(), flux_unit_name(unit), plane.peak(), irradiance_unit(unit), length_text(moment.x),
               length_text(moment.y), name_of(command, distance).string());
}

void act_project(const ProjectCommand& command, const CommandContext& context) {
    if (command.distances.empty())
        throw InputError({"--distance"}, "is missing; give for example --distance 1m (or --height)");
    require_readable(command.lamp);
    CommandFiles files;
    files.reads(command.lamp);
    for (const double distance : command.distances) {
        files.writes(name_of(command, distance), ".exr", "-o");
        if (!command.chromaticity) continue;
        files.writes(beside(name_of(command, distance), ".exr"), ".exr", "--chromaticity");
        if (command.png) files.writes(beside(name_of(command, distance), ".png"), ".png", "--chromaticity");
    }
    if (command.png) {
        files.writes(sheet_of(command), ".png", "--png");
        pictures(sheet_of(command));  // the library that draws its captions must be available
    }
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, true, context.process.stop, {}});
    const LampFile lamp = seen_from(command.side, read_lamp_file(command.lamp, monitor));
    const auto* light_field = std::get_if<Lumigraph>(&lamp);
    if (command.reconstruction != Reconstruction::exact &&
        !(light_field && is_plain(command, *light_field))) {
        throw InputError(
            {"--reconstruction"},
            "approximate works for a single light field towards +z only; rays are counted directly");
    }
    std::vector<ShownScreen> screens;
    for (const double distance : command.distances) {
        const ColouredPlane plane =
            naming(command.lamp, [&] { return project_at(command, lamp, distance, monitor); });
        screens.push_back(shown_of(command, distance, plane.luminance, image_of(plane, lamp)));
        const Image& image = screens.back().image;
        write_exr(name_of(command, distance), image);
        if (command.chromaticity) write_chromaticity(name_of(command, distance), image, command.png);
        if (!command.quiet) print_plane(context.out, command, distance, plane.luminance, lamp);
    }
    if (command.png) write_series_picture(command, screens);
}

}  // namespace

void add_light_project(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<ProjectCommand>();
    CLI::App& app = *light.add_subcommand("project", "Compute irradiance on a screen across a lamp's beam");
    app.footer(kProjectFooter);
    app.add_option("LAMP", command->lamp, "light field (.exr) or rays")->required()->type_name("FILE");
    app.add_option("-o,--output", command->output, "irradiance image; one for each distance")
        ->type_name("IMAGE.exr")
        ->required();
    CLI::Option* distance =
        add_word(app, "--distance", "LENGTH,...", "distance of the screen; several values make a series",
                 [command](const std::string& word) {
                     command->distances = parse_list(
                         word, [](std::string_view part) { return parse_place({"--distance"}, part); });
                 });
    add_word(app, "--height", "PLACE,...",
             "height of the screen in the frame of the lamp's file; several values make a series",
             [command](const std::string& word) {
                 command->heights = true;
                 command->distances =
                     parse_list(word, [](std::string_view part) { return parse_place({"--height"}, part); });
             })
        ->excludes(distance);
    add_word(app, "--side", "AXIS",
             "side of the lamp that the screen is on: +z (default), -z, +x, -x, +y or -y",
             [command](const std::string& word) { command->side = parse_side("--side", word); });
    add_word(app, "--size", "LENGTHxLENGTH", "size of the screen (default: from the extent of the light)",
             [command](const std::string& word) { command->size = parse_length_pair({"--size"}, word); });
    add_word(app, "--centre", "PLACE,PLACE", "centre of the screen, in the frame of the lamp's file",
             [command](const std::string& word) {
                 const auto both =
                     parse_list(word, [](std::string_view part) { return parse_place({"--centre"}, part); });
                 if (both.size() != 2)
                     throw InputError({"--centre"}, "expected two positions, for example 0,1.5mm");
                 command->centre = V2d(both[0], both[1]);
             });
    add_word(app, "--pixels", "WxH", "size of the image (default 512x512)",
             [command](const std::string& word) { command->pixels = parse_size({"--pixels"}, word, 16384); });
    add_word(app, "--reconstruction", "KIND",
             "exact (default), or approximate: the geometric term is evaluated once per filter and pixel",
             [command](const std::string& word) {
                 if (word != "exact" && word != "approximate")
                     input_error({"--reconstruction"},
                                 "\"{}\" is not accepted; expected exact or approximate", word);
                 command->reconstruction =
                     word == "exact" ? Reconstruction::exact : Reconstruction::approximate;
             });
    app.add_flag("--chromaticity", command->chromaticity,
                 "also write an image of u', v' and delta u'v' for each image, NAME-chromaticity.exr");
    app.add_flag("--png", command->png, "also write a picture, one for the whole series");
    add_threads(app, command->workers);
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    app.callback([command, &context] { act_project(*command, context); });
}

}  // namespace lucerna
