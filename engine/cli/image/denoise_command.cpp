// lucerna denoise: turns an image's layers into a denoised image with an estimated error.
#include "engine/base/elementary.h"
#include "engine/denoise/denoise.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr const char* kDenoiseFooter =
    R"(IMAGE is an image written by lucerna render --layers: in addition to the light it holds both halves of the samples, and
albedo, normal and position of the visible surfaces. The denoised image has the denoised light as R, G and B.

Each half is filtered separately and compared with the other, which gives the remaining error, including bias due to
filtering, and the blur of photon density estimates, which the render has measured. Where filtering would increase the
error, the measured light is kept. Other errors that are common to all samples, such as the noise of loaded maps, cannot
be seen in the halves: they are neither removed nor included in the error.

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
    const DenoiserInput layers = denoiser_input_of(image, command.image);
    const Stopwatch clock;
    Denoised denoised = denoise(layers, command.workers);
    const double seconds = clock.seconds();
    describe_alike(denoised.image, image);
    denoised.image.attributes.erase("lucerna.broughtfrom");
    // Adds the blur of photons, which the render has measured.
    double blur = 0;
    if (const auto told = image.attributes.find("lucerna.blur"); told != image.attributes.end())
        std::from_chars(told->second.data(), told->second.data() + told->second.size(), blur);
    const double error = hypot(denoised.relative_error, blur);
    denoised.image.attributes["lucerna.denoised"] =
        denoised.error_is_known ? fmt::format("{:.3g}", error) : "unknown";
    command.output.write(denoised.image,
                         fmt::format("{}, {}",
                                     denoised.error_is_known ? "error " + percent_text(error)
                                                             : "too few samples or pixels to tell its error",
                                     duration_text(seconds)),
                         denoised.image, denoised.image, context);
}

}  // namespace

void add_denoise_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<DenoiseCommand>();
    CLI::App& app = *program.add_subcommand("denoise", "Denoise an image and estimate the remaining error");
    app.footer(kDenoiseFooter);
    app.add_option("IMAGE", command->image, "OpenEXR image with layers")->required()->type_name("IMAGE.exr");
    add_image_output(app, command->output, "the denoised OpenEXR image");
    add_threads(app, command->workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
