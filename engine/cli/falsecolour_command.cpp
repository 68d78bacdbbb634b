// lucerna falsecolour: an image's luminance or illuminance as colours with a scale, and isolines.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/figures/false_colour.h"

namespace lucerna {
namespace {

constexpr const char* kFalsecolourFooter = R"(Examples:
  lucerna falsecolour lux.exr -o lux.png
  lucerna falsecolour lux.exr -o lux.png --scale log)";

struct FalsecolourCommand {
    std::string image, output;
    ScaleSettings scale;
};

void act(const FalsecolourCommand& command, const CommandContext& context) {
    require_readable(command.image);
    CommandFiles files;
    files.reads(command.image);
    files.writes(command.output, "", "-o");
    const Image image = read_exr(command.image);
    std::vector<double> values;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) values.push_back(double{luminance(image.rgb_at(x, y))});
    }
    const FalseColour colour(command.scale, values);
    Image picture = Image::rgb(image.width, image.height);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const int x = static_cast<int>(i) % image.width, y = static_cast<int>(i) / image.width;
        picture.set_rgb(x, y, colour(values[i]));
    }
    write_png_display(command.output, picture);
    fmt::print(context.out, "picture  {} ({:g} to {:g})\n", command.output, colour.range().low,
               colour.range().high);
}

}  // namespace

void add_falsecolour_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<FalsecolourCommand>();
    command->scale.inside = 0.99;
    CLI::App& app = *program.add_subcommand("falsecolour", "Show an image's lx or cd/m^2 in colours");
    app.footer(kFalsecolourFooter);
    app.add_option("IMAGE", command->image, "OpenEXR image")->required();
    app.add_option("-o,--output", command->output, "the picture")->required()->type_name("FILE.png");
    add_word(app, "--scale", "linear|log", "the scale of the colours", [command](const std::string& word) {
        command->scale.scaling = word == "log" ? Scaling::logarithmic : Scaling::linear;
    });
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
