// lucerna render: a scene file into an image.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "engine/app/commands.h"
#include "engine/app/console.h"
#include "engine/app/options.h"
#include "engine/app/outputs.h"
#include "engine/app/run_report.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/base/stopwatch.h"
#include "engine/pbrt/read_scene.h"

namespace lucerna {
namespace {

constexpr const char* kFooter = R"(Integrators and their parameters: lucerna info --integrators
Ctrl-C ends a render early and keeps what is there; a second one ends at once.

Examples:
  lucerna render room.pbrt -o out/room.exr --png
  lucerna render room.pbrt --integrator photonmap --set photons=2000000 --set k=200 --spp 32
  lucerna render room.pbrt --set quantity=illuminance -o lux.exr
  lucerna render room.pbrt --integrator path --spp 1024 --seed 7 -o reference.exr --stats reference.json
  lucerna render room.pbrt --resolution 160x120 --spp 4 --png --exposure -2)";

struct RenderCommand {
    std::string scene;
    std::string output;
    bool png = false;
    std::optional<double> exposure;  // stops; none: chosen from the image
    SceneOverrides overrides;
    RenderOptions options;
    std::string stats;
    bool quiet = false;
};

// The scene's own name for the image, in the current folder: a scene file does not choose where we write.
std::filesystem::path default_output(const FilmSettings& film) {
    return film.filename.filename().replace_extension(".exr");
}

std::filesystem::path png_beside(std::filesystem::path image) {
    return image.replace_extension(".png");
}

// Everything that will be written can be.
void check_outputs(const RenderCommand& command, const std::filesystem::path& image) {
    require_writable(image, ".exr");
    if (command.png) require_writable(png_beside(image), ".png");
    if (!command.stats.empty()) require_writable(command.stats, "");
}

// Stopped before any tile was done: an empty image must not replace an earlier one.
bool has_light_or_is_whole(const RenderResult& result) {
    return result.report.complete || result.report.samples_done > 0 ||
           std::any_of(result.image.data.begin(), result.image.data.end(), [](float v) { return v != 0; });
}

std::string write_picture(const RenderCommand& command, const std::filesystem::path& file,
                          const Image& image) {
    const float factor =
        command.exposure ? static_cast<float>(std::exp2(*command.exposure)) : auto_exposure(image);
    write_png(file, image, factor);
    // auto_exposure() > 0: the quotient of two positive numbers, or 1.
    return fmt::format("picture  {} (exposure {:+.2f} stops)", file.string(), std::log2(factor));
}

void act(const RenderCommand& command, const CommandContext& context) {
    require_readable(command.scene);
    if (!command.output.empty()) check_outputs(command, command.output);

    ConsoleMonitor monitor(context.out, context.err,
                           {context.around.terminal, command.quiet, context.around.stop, {}});
    RunFacts facts{command.scene, command.options.seed, command.options.workers.threads, 0, 0, 0};
    const Stopwatch reading;
    const Job job = read_scene(command.scene, command.overrides, command.options.workers, monitor);
    facts.read_seconds = reading.seconds();

    const std::filesystem::path output =
        command.output.empty() ? default_output(job.film) : std::filesystem::path(command.output);
    if (command.output.empty()) check_outputs(command, output);

    const Stopwatch rendering;
    RenderResult result = render(job, command.options, monitor);
    facts.render_seconds = rendering.seconds();
    facts.warnings = monitor.warnings();

    const RenderReport& report = result.report;
    const bool keep = has_light_or_is_whole(result);
    std::vector<std::string> said;
    if (!report.complete) {
        said.push_back(
            fmt::format("stopped: {} of {} samples per pixel were done", report.samples_done, job.spp));
    }
    if (keep) {
        result.image.attributes.merge(header_attributes(facts, job, report));
        write_exr(output, result.image);
        said.push_back(fmt::format("image    {} ({} x {}, {}, {} spp, {})", output.string(),
                                   result.image.width, result.image.height, report.notes.at("unit"),
                                   report.samples_done, duration_text(facts.render_seconds)));
        if (command.png) said.push_back(write_picture(command, png_beside(output), result.image));
    } else {
        said.push_back("no image written: there is nothing in it yet");
    }
    if (!command.stats.empty()) {
        write_text(command.stats, statistics_json(facts, job, report, keep ? output : ""));
        said.push_back(fmt::format("numbers  {}", command.stats));
    }
    for (const std::string& line : said) monitor.info(line);
}

void add_image_options(CLI::App& app, RenderCommand& command) {
    app.add_option("SCENE", command.scene, "scene file in pbrt's text format")->required();
    app.add_option("-o,--output", command.output,
                   "OpenEXR image (default: the scene's name for it, in this folder)")
        ->type_name("FILE.exr");
    app.add_flag("--png", command.png, "also write a tone-mapped picture beside the image");
    add_word(app, "--exposure", "STOPS",
             "the picture's exposure, 0 for radiance 1 as white (default: automatic)",
             [&command](const std::string& word) {
                 command.exposure = parse_number({"--exposure"}, word, -60, 60);
             });
    add_word(app, "--resolution", "WxH", "pixels, in the place of the scene's",
             [&command](const std::string& word) {
                 command.overrides.resolution = parse_size({"--resolution"}, word, 65536);
             });
    app.add_flag("--skip-missing", command.overrides.skip_missing,
                 "leave out meshes and textures whose file does not exist, with a warning");
    app.add_option("--stats", command.stats, "write times, counts and settings as JSON")
        ->type_name("FILE.json");
    app.add_flag("--quiet", command.quiet, "say nothing but warnings and errors");
}

void add_method_options(CLI::App& app, RenderCommand& command) {
    app.add_option("--integrator", command.overrides.integrator, "path, direct, photonmap or igi")
        ->type_name("NAME");
    app.add_option_function<std::vector<std::string>>(
           "--set",
           [&command](const std::vector<std::string>& words) {
               for (const std::string& word : words) {
                   command.overrides.set.push_back(parse_assignment({"--set"}, word));
               }
           },
           "set a parameter of the integrator; may be repeated")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--spp", "N", "samples per pixel, in the place of the scene's",
             [&command](const std::string& word) {
                 command.overrides.spp = static_cast<int>(parse_whole({"--spp"}, word, 1, 1 << 24));
             });
    add_word(app, "--seed", "N", "starts the random numbers (default 0); the same seed gives the same image",
             [&command](const std::string& word) { command.options.seed = parse_seed({"--seed"}, word); });
    add_threads(app, command.options.workers);
}

}  // namespace

void add_render_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<RenderCommand>();
    CLI::App& app = *program.add_subcommand("render", "Render a scene file into an OpenEXR image");
    app.footer(kFooter);
    add_image_options(app, *command);
    add_method_options(app, *command);
    app.callback([command, &context] {
        command->overrides.output = command->output;
        act(*command, context);
    });
}

}  // namespace lucerna
