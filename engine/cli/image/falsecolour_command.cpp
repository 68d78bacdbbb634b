// lucerna falsecolour: shows an image's illuminance or luminance in colours, with a legend and isolines.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/colour/working_space.h"
#include "engine/figures/figure.h"
#include "engine/image/image.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

constexpr const char* kFalsecolourFooter =
    R"(IMAGE is an image written by lucerna render. Its unit, which is shown in the legend, follows from the lights: lx or cd/m^2
if all lights are in lm (photometric files, measured lamps in lm), W/m^2 or W/(m^2 sr) if all are in W. An image with both
kinds has no unit and is an error.

Values are the luminance of R, G and B in the image's colour space. Without --range the scale begins at 0 and ends at a
round number above 99 % of the pixels, so that visible lamps do not determine it; with --scale log it begins and ends at 1,
2 or 5 times a power of ten, over four decades at most. Pixels outside the range have separate colours, which are shown in
the legend.

Isolines (isolux lines, if the image shows lx) join pixels of equal value. Because of noise in the image, each pixel is
averaged with its neighbours for the isolines (not for the colours), weighted by a Gaussian with standard deviation
--smooth, in pixels of the image. For this average, values are clamped between half of the lowest level and twice the
highest one, and closed lines smaller than four standard deviations are left out. Isolines also follow the edges of
objects, where the value changes abruptly. To reduce noise, use lucerna denoise or more samples.

Maps: viridis, from dark blue to yellow, and magma, from black to pale yellow, are perceptually uniform: equal steps of
value are seen as equal steps. diverging, from blue over white to red, shows signed values, such as those of compare
--signed.

Examples:
  lucerna render room.pbrt --set quantity=illuminance -o lux.exr
  lucerna falsecolour lux.exr -o lux.png --isolines
  lucerna falsecolour lux.exr -o lux.svg --levels 100,200,300,500
  lucerna falsecolour room.exr -o luminance.png --scale log --range 1,10000
  lucerna falsecolour room.exr -o direct.png --layer direct --map magma
  lucerna falsecolour error.exr -o error.png --map diverging)";

constexpr double kShownShare = 0.99;  // of an image's pixels that an automatic range covers

struct FalsecolourCommand {
    std::string image, output, layer;
    ScaleSettings scale;
    bool isolines = false, quiet = false;
    std::vector<double> levels;
    std::optional<double> smoothing;
    int width = 0;
};

// --- options ---

std::vector<double> parse_numbers(const char* option, const std::string& words) {
    std::vector<double> numbers;
    for (std::size_t from = 0; from <= words.size();) {
        const std::size_t comma = std::min(words.find(',', from), words.size());
        numbers.push_back(parse_number({option}, words.substr(from, comma - from), -1e30, 1e30));
        from = comma + 1;
    }
    return numbers;
}

ScaleRange parse_range(const std::string& word) {
    const std::vector<double> ends = parse_numbers("--range", word);
    if (ends.size() != 2 || !(ends[0] < ends[1]))
        input_error({"--range"},
                    "\"{}\" is not accepted; expected LOW,HIGH with the lower value first, for example 0,500",
                    word);
    return {ends[0], ends[1]};
}

Scaling parse_scaling(const std::string& word) {
    if (word == "linear") return Scaling::linear;
    if (word == "log") return Scaling::logarithmic;
    input_error({"--scale"}, "\"{}\" is unknown; expected linear or log", one_line(word));
}

ColourMap parse_map(const std::string& word) {
    const auto map = colour_map_named(word);
    if (!map) {
        input_error({"--map"}, "\"{}\" is unknown; {}known are {}", one_line(word),
                    did_you_mean(word, colour_map_names()), fmt::join(colour_map_names(), ", "));
    }
    return *map;
}

void check(const FalsecolourCommand& command) {
    const ScaleSettings& scale = command.scale;
    if (scale.scaling == Scaling::linear) return;
    if (scale.map == ColourMap::diverging)
        throw InputError("--map: diverging shows signed values and cannot be combined with --scale log");
    if (scale.range && !(scale.range->low > 0))
        input_error({"--range"}, "a logarithmic scale cannot begin at {:g}; expected a value above 0",
                    scale.range->low);
}

// --- values ---

// The values of an image that are shown.
struct ShownValues {
    ValueGrid values;  // NaN where the image is not finite
    std::string unit;
    std::size_t not_finite = 0;
};

std::string without_end(const std::string& text, std::string_view end) {
    return text.ends_with(end) && text.size() > end.size() ? text.substr(0, text.size() - end.size()) : "";
}

std::vector<std::string> layers_of_colours(const Image& image) {
    std::set<std::string> layers;
    for (const std::string& channel : image.channels) {
        const std::string layer = without_end(channel, ".R");
        if (!layer.empty()) layers.insert(layer);
    }
    return {layers.begin(), layers.end()};
}

// Tells whether a channel is R, G or B of the image or of a light layer (docs/reference/layers.md).
bool is_light(const std::string& channel) {
    const bool colour = channel == "R" || channel == "G" || channel == "B" || channel.ends_with(".R") ||
                        channel.ends_with(".G") || channel.ends_with(".B");
    return colour && !channel.starts_with("albedo.") && channel.find("variance.") == std::string::npos;
}

std::string unit_of(const Image& image, const std::string& channel, const std::string& file) {
    if (!is_light(channel)) return channel == "Z" || channel.starts_with("P.") ? "scene units" : "";
    const auto found = image.attributes.find("lucerna.unit");
    if (found == image.attributes.end()) return "";
    if (found->second.starts_with("mixed")) {
        input_error({file},
                    "some of its lights are in W and some in lm, so its values have no unit; render with "
                    "lights of one kind only");
    }
    return found->second;
}

// The one or three channels of a layer, with their weights.
struct WeightedChannels {
    std::vector<std::size_t> channels;
    std::vector<double> weights;
};

WeightedChannels channels_of(const Image& image, const std::string& layer, const std::string& file) {
    const std::string prefix = layer.empty() ? "" : layer + ".";
    const auto red = find_channel(image, prefix + "R"), green = find_channel(image, prefix + "G"),
               blue = find_channel(image, prefix + "B");
    if (red && green && blue) {
        const ColourSpace* const stated = layer.empty() ? image.space : space_of_layers(image);
        const auto& primaries = (stated ? *stated : colour_spaces().front()).primaries;
        return {{*red, *green, *blue}, {primaries[0].y, primaries[1].y, primaries[2].y}};
    }
    if (const auto one = find_channel(image, layer)) return {{*one}, {1}};
    if (layer.empty()) input_error({file}, "has no channels R, G and B; choose a layer with --layer");
    const std::vector<std::string> known = layers_of_colours(image);
    const std::vector<std::string_view> names(known.begin(), known.end());
    input_error({"--layer"}, "{} has no layer or channel \"{}\"; {}its layers are {}", file, layer,
                did_you_mean(layer, names),
                known.empty() ? "none (lucerna render --layers writes layers)"
                              : fmt::format("{}", fmt::join(known, ", ")));
}

ShownValues values_of(const Image& image, const FalsecolourCommand& command) {
    const WeightedChannels of = channels_of(image, command.layer, command.image);
    ShownValues shown{{image.width, image.height, {}},
                      unit_of(image, image.channels[of.channels[0]], command.image)};
    for (std::size_t first = 0; first < image.data.size(); first += image.channels.size()) {
        double value = 0;
        for (std::size_t c = 0; c < of.channels.size(); ++c)
            value += of.weights[c] * double{image.data[first + of.channels[c]]};
        if (!std::isfinite(value)) {
            ++shown.not_finite;
            value = NAN;
        }
        shown.values.values.push_back(value);
    }
    return shown;
}

// --- picture ---

double automatic_smoothing(int width) {
    return std::max(1.0, width / 250.0);
}

std::string text_of(const FalsecolourCommand& command, const PictureFigure& figure) {
    const FalseColour colour(figure.scale, figure.values.values);
    const auto [low, high] = colour.range();
    const auto share = [&](auto&& is_there) {
        const auto count = std::count_if(figure.values.values.begin(), figure.values.values.end(), is_there);
        return 100 * static_cast<double>(count) / static_cast<double>(figure.values.values.size());
    };
    std::string text = fmt::format("picture  {} ({:g} to {:g} {}{}", command.output, low, high,
                                   figure.unit.empty() ? "without a unit" : figure.unit,
                                   colour.scaling() == Scaling::logarithmic ? ", logarithmic" : "");
    if (const double below = share([low = low](double v) { return v < low; }); below > 0)
        text += fmt::format(", {:.2g} % of the pixels below", below);
    if (const double above = share([high = high](double v) { return v > high; }); above > 0)
        text += fmt::format(", {:.2g} % of the pixels above", above);
    return text + ")";
}

void act(const FalsecolourCommand& command, const CommandContext& context) {
    check(command);
    require_readable(command.image);
    const std::string suffix = suffix_of(command.output);
    if (suffix != ".png" && suffix != ".svg")
        input_error({command.output}, "the picture's name must end in .png or .svg");
    CommandFiles files;
    files.reads(command.image);
    files.writes(command.output, "", "-o");
    if (suffix == ".png") pictures(command.output);  // the library that draws it must be available

    const Image image = read_exr(command.image);
    ShownValues shown = values_of(image, command);
    if (shown.not_finite > 0) {
        ConsoleMonitor(context.out, context.err, {false, true, nullptr, {}})
            .warn(fmt::format("{}: {} of {} pixels are not finite and are shown grey", command.image,
                              shown.not_finite, shown.values.values.size()));
    }
    PictureFigure figure;
    figure.values = std::move(shown.values);
    figure.unit = shown.unit;
    figure.scale = command.scale;
    figure.isolines = {command.isolines, command.levels};
    figure.smoothing = command.smoothing.value_or(automatic_smoothing(image.width));
    figure.width = command.width;
    const std::string svg = picture_svg(figure);
    if (suffix == ".svg")
        write_text(command.output, svg);
    else
        write_png_display(command.output, drawn(svg, command.output));
    if (!command.quiet) fmt::print(context.out, "{}\n", text_of(command, figure));
}

void add_options(CLI::App& app, const std::shared_ptr<FalsecolourCommand>& command) {
    add_word(app, "--scale", "linear|log", "mapping from values to colours (default: linear)",
             [command](const std::string& word) { command->scale.scaling = parse_scaling(word); });
    add_word(app, "--range", "LOW,HIGH",
             "lowest and highest value of the scale, in the image's unit (default: from the image)",
             [command](const std::string& word) { command->scale.range = parse_range(word); });
    add_word(app, "--map", "NAME", "colour map: viridis, magma or diverging (default: viridis)",
             [command](const std::string& word) { command->scale.map = parse_map(word); });
    app.add_flag("--isolines", command->isolines, "draw lines of equal value at round levels, with labels");
    add_word(app, "--levels", "A,B,...", "draw isolines at these values, in the image's unit",
             [command](const std::string& word) {
                 command->levels = parse_numbers("--levels", word);
                 std::sort(command->levels.begin(), command->levels.end());
                 command->levels.erase(std::unique(command->levels.begin(), command->levels.end()),
                                       command->levels.end());
                 command->isolines = true;
             });
    add_word(app, "--smooth", "PIXELS",
             "standard deviation of the smoothing for isolines, 0 for none (default: 1/250 of the image's "
             "width, at least 1)",
             [command](const std::string& word) {
                 command->smoothing = parse_number({"--smooth"}, word, 0, 100);
             });
    add_word(app, "--layer", "NAME",
             "show a layer of the image, for example direct or lightgroup.stage, or a single channel, for "
             "example Z (default: R, G and B)",
             [command](const std::string& word) { command->layer = word; });
    add_word(app, "--size", "PIXELS", "width of the image in the picture (default: as in the file)",
             [command](const std::string& word) {
                 command->width = static_cast<int>(parse_whole({"--size"}, word, 16, 16384));
             });
    app.add_flag("--quiet", command->quiet, "print errors only");
}

}  // namespace

void add_falsecolour_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<FalsecolourCommand>();
    command->scale.inside = kShownShare;
    CLI::App& app = *program.add_subcommand(
        "falsecolour", "Show an image's illuminance or luminance in colours, with a legend and isolines");
    app.footer(kFalsecolourFooter);
    app.add_option("IMAGE", command->image, "OpenEXR image")->required()->type_name("IMAGE.exr");
    app.add_option("-o,--output", command->output, "the picture")->required()->type_name("FILE.png|FILE.svg");
    add_options(app, command);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
