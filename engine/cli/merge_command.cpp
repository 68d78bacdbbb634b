// lucerna merge: parts of a picture, rendered one by one, into the picture.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/part_files.h"
#include "engine/denoise/denoise.h"

namespace lucerna {
namespace {

constexpr const char* kMergeFooter =
    R"(PARTS are what lucerna render --part wrote, all of them, in any order: of one scene, with the same settings, seed and
number of samples, by one version of the program. What differs, is missing or is there twice is named.

The image is, bit for bit, the one that a single render makes with --no-adaptive and the same options. Parts rendered with
--denoise or --layers are denoised together, as that render would be.

Examples:
  lucerna render room.pbrt --spp 256 --denoise --part 1/2 -o part1.exr
  lucerna render room.pbrt --spp 256 --denoise --part 2/2 -o part2.exr
  lucerna merge part1.exr part2.exr -o room.exr --png)";

struct MergeCommand {
    std::vector<std::string> parts;
    std::string output;
    bool png = false, quiet = false;
    PictureOptions picture;
    Workers workers;
};

// Of what a render without layers writes; the rest its parts kept for a denoiser alone.
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
    files.writes(command.output, ".exr", "-o");
    const std::filesystem::path picture = png_beside(command.output);
    if (command.png) files.writes(picture, ".png", "--png");

    MergedParts merged = merge_parts(parts);
    std::optional<Denoised> denoised;
    if (find_channel(merged.image, "first.R"))
        denoised = denoise(layers_of(merged.image, command.output), command.workers);
    Image image = merged.keeps_layers || !denoised ? std::move(merged.image)
                                                   : with_channels(merged.image, is_of_the_image);
    if (denoised) {
        denoised->image.space = image.space;
        add_channels(image, denoised->image, "denoised.");
    }
    write_exr(command.output, image);
    if (!command.quiet) {
        fmt::print(context.out, "image    {} ({} x {}, {} parts{})\n", command.output, image.width,
                   image.height, parts.size(),
                   denoised ? fmt::format(", denoised {:.2g} %", 100 * denoised->relative_error) : "");
    }
    if (!command.png) return;
    const Image& shown = denoised ? denoised->image : image;
    const PictureLook look = command.picture.look(shown);
    write_png(picture, shown, look);
    if (!command.quiet) fmt::print(context.out, "{}\n", picture_text(picture, look));
}

}  // namespace

void add_merge_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<MergeCommand>();
    CLI::App& app =
        *program.add_subcommand("merge", "Put a picture together from parts that were rendered one by one");
    app.footer(kMergeFooter);
    app.add_option("PARTS", command->parts, "OpenEXR images of all parts")->required();
    app.add_option("-o,--output", command->output, "the OpenEXR image of the picture")
        ->required()
        ->type_name("FILE.exr");
    app.add_flag("--png", command->png, "also write a tone-mapped picture beside the image");
    add_picture_options(app, command->picture);
    add_threads(app, command->workers);
    app.add_flag("--quiet", command->quiet, "say nothing but errors");
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
