// lucerna merge: combines separately rendered parts of an image.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/render/part_files.h"
#include "engine/denoise/denoise.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr const char* kMergeFooter =
    R"(PARTS are all images written by lucerna render --part, in any order: of one scene, with the same settings, seed and number
of samples, by the same version of the program. Parts that differ, are missing or are given twice are reported.

The image is the same, bit for bit, as that of a single render with --no-adaptive and the same options. Parts rendered
with --denoise or --layers are denoised together, as in a single render.

Examples:
  lucerna render room.pbrt --spp 256 --denoise --part 1/2 -o part1.exr
  lucerna render room.pbrt --spp 256 --denoise --part 2/2 -o part2.exr
  lucerna merge part1.exr part2.exr -o room.exr --png)";

struct MergeCommand {
    std::vector<std::string> parts;
    ImageOutput output;
    Workers workers;
};

// Tells whether a render without layers writes the channel; parts keep the others for the denoiser only.
bool is_of_the_image(const std::string& channel) {
    return channel == "R" || channel == "G" || channel == "B" || channel.starts_with("variance.");
}

void act(const MergeCommand& command, const CommandContext& context) {
    CommandFiles files;
    std::vector<std::filesystem::path> parts;
    for (const std::string& part : command.parts) {
        require_readable(part);
        files.reads(part);
        parts.emplace_back(part);
    }
    declare(command.output, files);

    MergedParts merged = merge_parts(parts);
    std::optional<Denoised> denoised;
    if (find_channel(merged.image, "first.R"))
        denoised = denoise(denoiser_input_of(merged.image, command.output.file), command.workers);
    Image image = merged.keeps_layers || !denoised ? std::move(merged.image)
                                                   : with_channels(merged.image, is_of_the_image);
    if (denoised) {
        add_channels(image, denoised->image, "denoised.");
        add_denoised_groups(image, merged.chosen, command.output.file, command.workers);
    }
    keep_layers(image, merged.chosen);
    std::string what = fmt::format("{} parts", parts.size());
    if (denoised)
        what += denoised->error_is_known ? ", denoised " + percent_text(denoised->relative_error)
                                         : ", too few samples or pixels to tell the denoised image's error";
    const Image& shown = denoised ? denoised->image : image;
    command.output.write(image, what, shown, shown, context);
}

}  // namespace

void add_merge_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<MergeCommand>();
    CLI::App& app = *program.add_subcommand("merge", "Merge separately rendered parts of a picture");
    app.footer(kMergeFooter);
    app.add_option("PARTS", command->parts, "OpenEXR images of all parts")->required()->type_name("PART.exr");
    add_image_output(app, command->output, "OpenEXR image of the whole picture");
    add_threads(app, command->workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
