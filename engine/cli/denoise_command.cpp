// lucerna denoise: an image's layers into a clean image whose error is known.
#include "engine/denoise/denoise.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"

namespace lucerna {
namespace {

constexpr const char* kDenoiseFooter =
    R"(IMAGE is what lucerna render --layers wrote: beside the light it holds both halves of the samples, and albedo, normal
and place of what is seen. The image that is made of it has the denoised light as R, G and B.

Every half is filtered by itself, and compared with the other one: so the error that is left is known, what filtering
blurs included. Where filtering would harm, the measured light stands. What all samples share, as the blur of photons
or maps that were loaded, neither half tells of: its error is not removed, and not counted.

lucerna render does the same at its end with --denoise, and with --png, --time and --error unless --no-denoise is given.

Examples:
  lucerna render room.pbrt --spp 64 --layers -o room.exr
  lucerna denoise room.exr -o clean.exr --png
  lucerna compare clean.exr reference.exr)";

struct DenoiseCommand {
    std::string image;
    ImageOutput output;
    Workers workers;
};

void act(const DenoiseCommand& command, const CommandContext& context) {
    require_readable(command.image);
    CommandFiles files;
    files.reads(command.image);
    declare(command.output, files);

    const Image image = read_exr(command.image);
    const Layers layers = layers_of(image, command.image);
    const Stopwatch clock;
    Denoised denoised = denoise(layers, command.workers);
    const double seconds = clock.seconds();
    describe_alike(denoised.image, image);
    denoised.image.attributes.erase("lucerna.broughtfrom");
    denoised.image.attributes["lucerna.denoised"] = fmt::format("{:.3g}", denoised.relative_error);
    command.output.write(
        denoised.image,
        fmt::format("error {:.2g} %, {}", 100 * denoised.relative_error, duration_text(seconds)),
        denoised.image, denoised.image, context);
}

}  // namespace

void add_denoise_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<DenoiseCommand>();
    CLI::App& app =
        *program.add_subcommand("denoise", "Denoise an image, and estimate the error that is left");
    app.footer(kDenoiseFooter);
    app.add_option("IMAGE", command->image, "OpenEXR image with layers")->required();
    add_image_output(app, command->output, "the denoised OpenEXR image");
    add_threads(app, command->workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
