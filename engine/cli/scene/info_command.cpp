// lucerna info: prints the contents of a scene, an image, a lamp or a file of photon maps, and lists
// integrators.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/integrators_text.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/scene/map_text.h"
#include "engine/image/image.h"
#include "engine/integrators/integrator.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/job.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"
#include "photon/build_maps.h"

namespace lucerna {
namespace {

// Functions that print scenes.

constexpr std::size_t kMostListed = 20;  // lights, materials

std::string_view model_name(const Material& material) {
    constexpr std::string_view names[] = {"diffuse",
                                          "mirror",
                                          "conductor",
                                          "dielectric",
                                          "thin dielectric",
                                          "diffuse transmission",
                                          "coated diffuse",
                                          "coated conductor",
                                          "uber",
                                          "substrate",
                                          "translucent",
                                          "shiny metal",
                                          "mix",
                                          "interface"};
    static_assert(std::variant_size_v<MaterialModel> == std::size(names));
    return names[material.model.index()];
}

void print_lights(std::ostream& out, const Scene& scene, const WorkingSpace& colours) {
    struct Kind {
        std::uint64_t count = 0;
        double power = 0;
    };
    std::map<std::pair<std::string_view, FluxUnit>, Kind> kinds;
    for (const auto& light : scene.lights()) {
        Kind& kind = kinds[{light->kind(), light->unit()}];
        ++kind.count;
        kind.power += light->power();
    }
    if (kinds.empty()) fmt::print(out, "lights       none\n");
    for (const auto& [name, kind] : kinds) {
        fmt::print(out, "lights       {} {}, {:.6g} {} in all (luminance)\n", kind.count, name.first,
                   kind.power, flux_unit_name(name.second));
    }
    fmt::print(out, "unit         {}{}\n", unit_text(Quantity::radiance, scene_unit(scene)),
               scene.stated_unit() ? ", as stated" : "");
    if (scene.lights().size() < 2) return;
    for (std::size_t i = 0; i < std::min(scene.lights().size(), kMostListed); ++i) {
        const Rgb flux = colours.light_to_rgb(scene.lights()[i]->flux());
        fmt::print(out, "  light {:<4} {:<11} {:.6g} ({:.4g} {:.4g} {:.4g})\n", i, scene.lights()[i]->kind(),
                   scene.lights()[i]->power(), flux.x, flux.y, flux.z);
    }
    if (scene.lights().size() > kMostListed)
        fmt::print(out, "  and {} more\n", scene.lights().size() - kMostListed);
}

void print_materials(std::ostream& out, const Scene& scene) {
    const auto materials = scene.materials();
    fmt::print(out, "materials    {}\n", materials.size());
    for (std::size_t i = 0; i < std::min(materials.size(), kMostListed); ++i) {
        fmt::print(out, "  {:<20} {}\n", materials[i].name.empty() ? "(unnamed)" : materials[i].name,
                   model_name(materials[i]));
    }
    if (materials.size() > kMostListed) fmt::print(out, "  and {} more\n", materials.size() - kMostListed);
}

void print_camera(std::ostream& out, const Job& job) {
    const Camera::Settings& camera = job.camera.settings();
    using Kind = Camera::Settings::Kind;
    if (camera.kind == Kind::perspective) {
        fmt::print(out, "camera       perspective, {:g} degrees", camera.fov_degrees);
    } else {
        fmt::print(out, "camera       {}", camera.kind == Kind::spherical ? "spherical" : "orthographic");
    }
    if (camera.lens_radius > 0) {
        fmt::print(out, ", lens radius {:g}, focus at {:g}", camera.lens_radius, camera.focal_distance);
    }
    const V3d eye =
        V3d(camera.world_from_camera[3][0], camera.world_from_camera[3][1], camera.world_from_camera[3][2]) +
        job.scene.origin();
    fmt::print(out, ", at ({:g}, {:g}, {:g})\n", eye.x, eye.y, eye.z);
    fmt::print(out, "film         {} x {}, {} samples per pixel, \"{}\"\n", job.film.width, job.film.height,
               job.spp, job.film.filename.string());
}

void print_surfaces(std::ostream& out, const Scene& scene) {
    const Scene::Counts counts = scene.counts();
    std::vector<std::string> parts = {fmt::format("{} triangles", counts.triangles),
                                      fmt::format("{} quadrics", counts.quadrics)};
    if (counts.patches > 0) parts.push_back(fmt::format("{} patches", counts.patches));
    if (counts.curves > 0) parts.push_back(fmt::format("{} curve segments", counts.curves));
    fmt::print(out, "surfaces     {}", fmt::join(parts, ", "));
    if (counts.degenerate_triangles > 0) {
        fmt::print(out, "; {} degenerate triangles left out", counts.degenerate_triangles);
    }
    fmt::print(out, "\n");
    if (counts.instances > 0) {
        fmt::print(out, "instances    {} of {} objects: {} triangles including instances\n", counts.instances,
                   counts.prototypes, counts.triangles_seen);
    }
    fmt::print(out, "memory       {:.1f} MB of geometry\n", static_cast<double>(counts.geometry_bytes) / 1e6);
    const V3d origin = scene.origin();
    const Box3f& box = scene.bounds();
    if (!box.isEmpty()) {
        const V3d low = V3d(box.min) + origin;
        const V3d high = V3d(box.max) + origin;
        fmt::print(out, "bounds       ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})\n", low.x, low.y, low.z,
                   high.x, high.y, high.z);
    }
    fmt::print(out, "origin       ({:g}, {:g}, {:g})\n", origin.x, origin.y, origin.z);
}

// Prints the preparation of each method for the scene before its first ray.
void print_descriptions(std::ostream& out, const Job& job) {
    fmt::print(out, "integrator   {}", integrator_name(job.integrator));
    for (const auto& [name, value] : describe(job.integrator)) fmt::print(out, " {}={}", name, value);
    fmt::print(out, "\npreparation by each integrator before rendering\n");
    for (const std::string_view name : integrator_names()) {
        const bool chosen = integrator_name(job.integrator) == name;
        const IntegratorSettings settings = chosen ? job.integrator : make_settings(name, {});
        const auto lines = make_integrator(settings)->describe(job.scene);
        if (lines.empty()) fmt::print(out, "  {:<11} nothing\n", name);
        for (std::size_t i = 0; i < lines.size(); ++i) {
            fmt::print(out, "  {:<11} {}\n", i == 0 ? name : "", lines[i]);
        }
    }
}

// `ignored` are the warnings from reading the scene.
void print_scene(std::ostream& out, const Job& job, const std::vector<std::string>& ignored) {
    print_surfaces(out, job.scene);
    print_lights(out, job.scene, job.film.colours);
    print_materials(out, job.scene);
    print_camera(out, job);
    print_descriptions(out, job);
    fmt::print(out, "ignored      {}\n", ignored.empty() ? "nothing" : std::to_string(ignored.size()));
    for (const std::string& line : ignored) fmt::print(out, "  {}\n", line);
}

constexpr const char* kInfoFooter = R"(Examples:
  lucerna info room.pbrt
  lucerna info room.exr
  lucerna info lamp.tm25ray
  lucerna info room.photons
  lucerna info --integrators)";

struct InfoOptions {
    std::string file;
    bool integrators = false;
    bool skip_missing = false;
    bool strict = false;
    std::optional<FluxUnit> unit;
};

// --- scenes ---

// Collects the reader's warnings, to be printed with the rest.
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
    ConsoleMonitor console(context.out, context.err, {false, true, context.process.stop, {}});
    NotingMonitor monitor(console);
    SceneOverrides overrides;
    overrides.skip_missing = options.skip_missing;
    overrides.strict = options.strict;
    overrides.unit = options.unit;
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
        return print_lumigraph(out, read_lumigraph(file), {});
    }
    fmt::print(out, "size         {} x {}\n", image.width, image.height);
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const ChannelSummary s = summary(image, c);
        if (s.finite == 0) {
            fmt::print(out, "{:<12} no finite values", image.channels[c]);
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
    if (options.integrators) context.out << integrators_text();
    if (options.file.empty()) {
        if (!options.integrators)
            throw InputError("info: a file or --integrators is needed; see lucerna info --help");
        return;
    }
    require_readable(photometric_file(options.file));
    const std::string suffix = suffix_of(options.file);
    if (suffix == ".exr") return print_image(context.out, options.file);
    if (is_photometric(options.file)) {
        ConsoleMonitor monitor(context.out, context.err, {false, true, context.process.stop, {}});
        return print_photometric(context.out, read_photometric(options.file, monitor), FluxUnit::lumen);
    }
    if (suffix == ".tm25ray" || suffix == ".dat" || suffix == ".sdf" || suffix == ".ray" ||
        is_ray_file(options.file)) {
        ConsoleMonitor monitor(context.out, context.err, {false, true, context.process.stop, {}});
        return print_ray_set(context.out, read_rays(options.file, monitor));
    }
    if (suffix == kMapsSuffix) return print_maps(context.out, read_maps(options.file));
    print_scene_file(options, context);
}

}  // namespace

void add_info_command(CLI::App& program, const CommandContext& context) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App& app = *program.add_subcommand(
        "info", "Describe a scene, an image, a lamp or saved photon maps; list the integrators");
    app.footer(kInfoFooter);
    app.add_option("FILE", options->file,
                   "scene (.pbrt), image (.exr), light field (.exr), rays (.tm25ray), photometric file "
                   "(.ies, .ldt, .xml, .gldf), "
                   "photon maps (.photons)")
        ->type_name("FILE");
    app.add_flag("--skip-missing", options->skip_missing,
                 "leave out meshes and textures whose file does not exist, with a warning");
    app.add_flag(
        "--strict", options->strict,
        "stop with an error, instead of a warning, if part of the scene cannot be rendered as specified");
    add_unit_option(app, options->unit);
    app.add_flag("--integrators", options->integrators, "list all integrators and their parameters");
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
