// lucerna compare: compares images with their reference, in numbers, pictures and a page.
#include <cmath>
#include <memory>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/page_parts.h"
#include "engine/evaluation/comparison.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr const char* kCompareFooter =
    R"(Numbers, over all pixels and colour channels, with t the image and r the reference:
  MSE           mean of (t - r)^2
  relative MSE  mean of (t - r)^2 / (r^2 + 0.0001)
  MAPE          mean of |t - r| / (|r| + 0.01)
  FLIP          visible difference when alternating between the two pictures, 0 to 1 (Andersson et al. 2020), at one
                exposure and with the tone curve of render --png
  HDR-FLIP      the maximum of FLIP over a range of exposures given by the reference's brightest and median pixels (2021)
  mean ratio    mean t / mean r, per channel
Layers other than R, G and B (features, halves of the samples, the denoised light) are not compared.
Pixels with NaN or infinity are counted and left out. Visible lamps are a few bright pixels that dominate every mean:
leave them out with --mask.

If both images have variances, as all images rendered by lucerna do, the difference of each pixel is tested against its
noise (z-test); the test calls equal images different in at most 1 % of cases. It assumes normally distributed noise: with
fewer than some hundred samples per pixel this does not hold, and equal images are rejected too often; use --cells 8 then to
test cells of 8 x 8 pixels instead.

Several images that differ only in their seed separate bias, which more samples do not reduce, from noise, which they do;
the noise of their mean is subtracted from the bias. Three or more seeds give a standard error for both.

Examples:
  lucerna compare room.exr reference.exr
  lucerna compare room.exr reference.exr --html room.html
  lucerna compare room.exr reference.exr --json numbers.json --signed error.png --flip flip.png
  lucerna compare quick.exr reference.exr --cells 8
  lucerna compare seed0.exr seed1.exr seed2.exr seed3.exr reference.exr --html bias.html
  lucerna compare room.exr reference.exr --json -
  lucerna compare cornell.exr reference.exr --mask 4)";

struct CompareCommand {
    std::vector<std::string> files;  // the last is the reference
    std::string json;                // "-": print to standard output instead of the text
    std::string html, signed_error, flip;
    std::optional<double> error_range;
    bool without_flip = false;
    ComparisonSettings settings;
};

bool is_exr(const std::string& file) {
    return suffix_of(file) == ".exr";
}

// Declares a map's file, which contains either colours or values.
void declare_map(const std::string& file, std::string_view option, CommandFiles& files) {
    if (file.empty()) return;
    if (!is_exr(file) && suffix_of(file) != ".png") {
        input_error({file}, "the map's name must end in .png (colours) or .exr (values)");
    }
    files.writes(file, "", option);
}

void declare_files(const CompareCommand& command) {
    CommandFiles files;
    for (const std::string& image : command.files) files.reads(image);
    if (!command.json.empty() && command.json != "-") files.writes(command.json, "", "--json");
    if (!command.html.empty()) files.writes(command.html, ".html", "--html");
    declare_map(command.signed_error, "--signed", files);
    declare_map(command.flip, "--flip", files);
    if (!command.flip.empty() && command.without_flip)
        throw InputError("--flip: cannot be combined with --no-flip");
}

void write_signed(const CompareCommand& command, const ComparisonReport& report, double range) {
    if (!is_exr(command.signed_error)) {
        write_png_display(command.signed_error, diverging_picture(report.pictures.error, range));
        return;
    }
    // The difference t - r is in the image's own unit.
    Image difference = report.pictures.mean;
    for (std::size_t i = 0; i < difference.data.size(); ++i)
        difference.data[i] -= report.pictures.reference.data[i];
    difference.attributes["lucerna.shows"] = "image - reference";
    if (!report.unit.empty()) difference.attributes["lucerna.unit"] = report.unit;
    write_exr(command.signed_error, difference);
}

// Writes the channel "flip", and "hdr_flip" if available.
void write_flip(const CompareCommand& command, const ComparisonReport& report) {
    const FlipNumbers& best = report.hdr_flip ? *report.hdr_flip : *report.flip;
    if (!is_exr(command.flip)) {
        write_png_display(command.flip, magma_picture(best.map, 1));
        return;
    }
    Image both(
        best.map.width, best.map.height,
        report.hdr_flip ? std::vector<std::string>{"flip", "hdr_flip"} : std::vector<std::string>{"flip"});
    for (std::size_t i = 0; i < best.map.data.size(); ++i) {
        both.data[i * both.channels.size()] = report.flip->map.data[i];
        if (report.hdr_flip) both.data[2 * i + 1] = report.hdr_flip->map.data[i];
    }
    write_exr(command.flip, both);
}

void act(const CompareCommand& command, const CommandContext& context) {
    if (command.files.size() < 2)
        throw InputError(
            "REFERENCE is required: lucerna compare IMAGE ... REFERENCE; see lucerna compare --help");
    declare_files(command);
    // Shows progress only where it can be redrawn, because the output is for the numbers.
    ConsoleMonitor monitor(context.err, context.err,
                           {context.process.terminal, !context.process.terminal, context.process.stop, {}});
    std::vector<NamedImage> images;
    for (const std::string& file : command.files) images.push_back({file, read_exr(file)});
    const NamedImage reference = std::move(images.back());
    images.pop_back();
    ComparisonSettings settings = command.settings;
    settings.flip = !command.without_flip;
    const ComparisonReport report = compare_images(images, reference, settings, monitor);
    if (report.numbers.pixels == 0)
        monitor.warn(reference.name + ": no pixel can be compared: all are masked or not finite");

    const double range = command.error_range ? *command.error_range : error_scale(report.pictures.error);
    if (!command.signed_error.empty()) write_signed(command, report, range);
    if (!command.flip.empty() && report.flip) write_flip(command, report);
    if (!command.html.empty()) write_text(command.html, comparison_page(report, images, reference, range));
    if (command.json == "-") {
        context.out << comparison_json(report);
        return;
    }
    if (!command.json.empty()) write_text(command.json, comparison_json(report));
    context.out << comparison_text(report);
    if (!command.signed_error.empty() && !is_exr(command.signed_error))
        context.out << fmt::format("signed         {}: full colour at {:g} of the reference's luminance\n",
                                   command.signed_error, range);
}

void add_outputs(CLI::App& app, const std::shared_ptr<CompareCommand>& command) {
    app.add_option("--json", command->json, "write the numbers as JSON; - for standard output")
        ->type_name("FILE");
    app.add_option("--html", command->html, "write a self-contained page with images, maps and numbers")
        ->type_name("FILE");
    app.add_option("--signed", command->signed_error,
                   "write the signed error: .png in colours (red too bright, blue too dark), .exr as t - r")
        ->type_name("FILE");
    app.add_option("--flip", command->flip,
                   "write the FLIP map: .png HDR-FLIP in its colours, .exr the values of both")
        ->type_name("FILE");
}

void add_settings(CLI::App& app, const std::shared_ptr<CompareCommand>& command) {
    ComparisonSettings& settings = command->settings;
    add_word(app, "--mask", "VALUE",
             "leave out pixels where the reference is above this value, in its own unit",
             [&settings](const std::string& word) {
                 settings.mask_above = parse_number({"--mask"}, word, 0, 1e30);
             });
    add_word(
        app, "--cells", "N",
        "test the means of cells of N x N pixels against their noise, for renders with few samples per pixel",
        [&settings](const std::string& word) {
            settings.z_cell = static_cast<int>(parse_whole({"--cells"}, word, 1, 4096));
        });
    add_word(app, "--exposure", "STOPS",
             "exposure for FLIP and initial exposure of the page; 0 shows radiance 1 as white (default: from "
             "the reference)",
             [&settings](const std::string& word) {
                 settings.exposure = parse_number({"--exposure"}, word, -60, 60);
             });
    add_word(app, "--ppd", "N",
             "pixels per degree of visual angle, which depends on FLIP's viewing distance (default: 67, at "
             "0.7 m from a screen 0.7 m and 3840 pixels wide)",
             [&settings](const std::string& word) {
                 settings.pixels_per_degree = parse_number({"--ppd"}, word, 1, 1000);
             });
    add_word(app, "--range", "SHARE",
             "relative error that is shown in full colour in the signed error (default: from the image)",
             [command](const std::string& word) {
                 command->error_range = parse_number({"--range"}, word, 1e-9, 1e9);
             });
    app.add_flag("--no-flip", command->without_flip, "do not compute FLIP, which takes most of the time");
    add_threads(app, settings.workers);
}

}  // namespace

void add_compare_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<CompareCommand>();
    CLI::App& app =
        *program.add_subcommand("compare", "Compare images with a reference: errors, bias and noise");
    app.footer(kCompareFooter);
    // Uses one list, as CLI11 accepts no list before a separate last word.
    app.add_option(
           "IMAGE", command->files,
           "one or more OpenEXR images of the same render with different seeds, and then their REFERENCE")
        ->required()
        ->type_name("... REFERENCE");
    add_outputs(app, command);
    add_settings(app, command);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
