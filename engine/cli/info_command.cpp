// lucerna info: what a scene, an image or a lamp holds; which integrators there are.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/lamp_text.h"
#include "engine/cli/options.h"
#include "engine/cli/photometric_text.h"
#include "engine/cli/scene_text.h"
#include "engine/pbrt/read_scene.h"
#include "lights/ldt.h"

namespace lucerna {
namespace {

constexpr const char* kInfoFooter = R"(Examples:
  lucerna info room.pbrt
  lucerna info room.exr
  lucerna info lamp.tm25ray
  lucerna info --integrators)";

struct InfoOptions {
    std::string file;
    bool integrators = false;
    bool skip_missing = false;
    bool strict = false;
};

// --- integrators ---

std::string accepted(const Field& field) {
    if (!field.choices.empty()) return fmt::format("{}", fmt::join(field.choices, " | "));
    if (std::holds_alternative<bool*>(field.target)) return "true | false";
    return fmt::format("{} >= {:g}", field.whole ? "whole" : "number", field.least);
}

void print_parameters(std::ostream& out, IntegratorSettings settings) {
    for (const Field& field : fields(settings)) {
        fmt::print(out, "  {:<17} {:<12} {}  [{}]\n", field.name, field.text(), field.help, accepted(field));
    }
}

std::string_view purpose(std::string_view integrator) {
    if (integrator == "path") return "unbiased reference: slow, and noisy where light is focused";
    if (integrator == "direct") return "direct light only, through mirrors and glass";
    if (integrator == "photonmap") return "photon maps with projected density estimation and final gather";
    if (integrator == "progressive") return "photon maps in passes, with a radius that shrinks: consistent";
    return "instant global illumination: virtual point lights; smooth; caustics by photons; all light with "
           "compensate";
}

void print_integrators(std::ostream& out) {
    fmt::print(out, "Set by the scene's Integrator line, or by --integrator NAME and --set KEY=VALUE.\n");
    fmt::print(out, "Each line: parameter, default, meaning, [what is accepted].\n");
    for (const std::string_view name : integrator_names()) {
        fmt::print(out, "\n{}: {}\n", name, purpose(name));
        print_parameters(out, make_settings(name, {}));
    }
}

// --- scenes ---

// Keeps what the reader warns of, to be said with the rest.
class NotingMonitor final : public Monitor {
  public:
    explicit NotingMonitor(Monitor& console) : console_(console) {}
    void begin(std::string_view phase, std::uint64_t total) override { console_.begin(phase, total); }
    void advance(std::uint64_t units) override { console_.advance(units); }
    void end() override { console_.end(); }
    void info(std::string_view line) override { console_.info(line); }
    void warn(std::string_view line) override { warnings.emplace_back(line); }
    bool stopped() const override { return console_.stopped(); }

    std::vector<std::string> warnings;

  private:
    Monitor& console_;
};

void print_scene_file(const InfoOptions& options, const CommandContext& context) {
    ConsoleMonitor console(context.out, context.err, {false, true, context.around.stop, {}});
    NotingMonitor monitor(console);
    SceneOverrides overrides;
    overrides.skip_missing = options.skip_missing;
    overrides.strict = options.strict;
    const Workers workers;
    SceneFrames frames(options.file, overrides, workers, monitor);
    for (int frame = 1; frame == 1 || frames.more(); ++frame) {
        const std::optional<Job> job = frames.next();
        if (!job) return;
        if (frame > 1 || frames.more()) fmt::print(context.out, "frame        {}\n", frame);
        print_scene(context.out, *job, monitor.warnings);
        monitor.warnings.clear();
    }
}

// --- images ---

struct ChannelSummary {
    double sum = 0;
    float least = INFINITY, most = -INFINITY;
    std::uint64_t finite = 0, bad = 0;
};

ChannelSummary summary(const Image& image, std::size_t channel) {
    ChannelSummary s;
    for (std::size_t i = channel; i < image.data.size(); i += image.channels.size()) {
        const float value = image.data[i];
        if (!std::isfinite(value)) {
            ++s.bad;
            continue;
        }
        ++s.finite;
        s.sum += double{value};
        s.least = std::min(s.least, value);
        s.most = std::max(s.most, value);
    }
    return s;
}

void print_image(std::ostream& out, const std::string& file) {
    const Image image = read_exr(file);
    if (image.attributes.contains("lightfieldBasis")) {
        fmt::print(out, "a light field: {}\n", file);
        return print_light_field(out, read_light_field(file), {});
    }
    fmt::print(out, "size         {} x {}\n", image.width, image.height);
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const ChannelSummary s = summary(image, c);
        if (s.finite == 0) {
            fmt::print(out, "{:<12} nothing finite", image.channels[c]);
        } else {
            fmt::print(out, "{:<12} mean {:.6g}, {:.6g} to {:.6g}", image.channels[c],
                       s.sum / static_cast<double>(s.finite), s.least, s.most);
        }
        if (s.bad > 0) fmt::print(out, "; NOT FINITE: {} pixels", s.bad);
        fmt::print(out, "\n");
    }
    for (const auto& [name, text] : image.attributes) fmt::print(out, "{:<28} {}\n", name, one_line(text));
}

void act(const InfoOptions& options, const CommandContext& context) {
    if (options.integrators) print_integrators(context.out);
    if (options.file.empty()) {
        if (!options.integrators)
            throw InputError("info: a file or --integrators is needed; see lucerna info --help");
        return;
    }
    require_readable(options.file);
    const std::string suffix = suffix_of(options.file);
    if (suffix == ".exr") return print_image(context.out, options.file);
    if (is_photometric(options.file)) {
        ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
        return print_photometric(context.out, read_photometric(options.file, monitor), FluxUnit::lumen);
    }
    if (suffix == ".tm25ray" || suffix == ".dat" || suffix == ".ray") {
        ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
        return print_ray_set(context.out, read_rays(options.file, monitor));
    }
    print_scene_file(options, context);
}

}  // namespace

void add_info_command(CLI::App& program, const CommandContext& context) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App& app =
        *program.add_subcommand("info", "What a scene, an image or a lamp holds; the integrators");
    app.footer(kInfoFooter);
    app.add_option(
        "FILE", options->file,
        "scene (.pbrt), image (.exr), light field (.exr), rays (.tm25ray), photometric file (.ies, .ldt)");
    app.add_flag("--skip-missing", options->skip_missing,
                 "leave out what lies in files that are not there, with a warning");
    app.add_flag("--strict", options->strict, "refuse a scene that is not rendered as it says");
    app.add_flag("--integrators", options->integrators, "all integrators and their parameters");
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
