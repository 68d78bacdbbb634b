// lucerna info: what a scene, an image or a lamp holds; which integrators there are.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "engine/app/commands.h"
#include "engine/app/console.h"
#include "engine/app/lamp_text.h"
#include "engine/app/options.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/pbrt/read_scene.h"

namespace lucerna {
namespace {

constexpr const char* kFooter = R"(Examples:
  lucerna info room.pbrt
  lucerna info room.exr
  lucerna info lamp.tm25ray
  lucerna info --integrators)";

constexpr std::size_t kMostListed = 20;  // lights, materials

struct InfoOptions {
    std::string file;
    bool integrators = false;
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
    return "instant global illumination: virtual lights; smooth, without caustics";
}

void print_integrators(std::ostream& out) {
    fmt::print(out, "Set by the scene's Integrator line, or by --integrator NAME and --set KEY=VALUE.\n");
    fmt::print(out, "Each line: parameter, default, meaning, [what is accepted].\n");
    for (const char* name : {"path", "direct", "photonmap", "igi"}) {
        fmt::print(out, "\n{}: {}\n", name, purpose(name));
        print_parameters(out, make_settings(name, {}));
    }
}

// --- scenes ---

std::string_view model_name(const Material& material) {
    constexpr std::string_view names[] = {"diffuse", "mirror", "conductor", "dielectric", "interface"};
    static_assert(std::variant_size_v<MaterialModel> == std::size(names));
    return names[material.model.index()];
}

void print_lights(std::ostream& out, const Scene& scene) {
    struct Kind {
        std::uint64_t count = 0;
        double power = 0;
    };
    std::map<std::string_view, Kind> kinds;
    for (const auto& light : scene.lights()) {
        Kind& kind = kinds[light->kind()];
        ++kind.count;
        kind.power += light->power();
    }
    if (kinds.empty()) fmt::print(out, "lights       none\n");
    for (const auto& [name, kind] : kinds) {
        fmt::print(out, "lights       {} {}, {:.6g} in all (luminance; W, or lm for photometric lamps)\n",
                   kind.count, name, kind.power);
    }
    if (scene.lights().size() < 2) return;
    for (std::size_t i = 0; i < std::min(scene.lights().size(), kMostListed); ++i) {
        const Rgb flux = scene.lights()[i]->flux();
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

void print_scene(const std::string& file, const CommandContext& context) {
    ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
    const Job job = read_scene(file, {}, {}, monitor);
    std::ostream& out = context.out;
    const Scene::Counts counts = job.scene.counts();
    fmt::print(out, "surfaces     {} triangles, {} spheres and disks", counts.triangles, counts.quadrics);
    if (counts.degenerate_triangles > 0) {
        fmt::print(out, "; {} triangles without area left out", counts.degenerate_triangles);
    }
    fmt::print(out, "\n");
    const V3d origin = job.scene.origin();
    const Box3f& box = job.scene.bounds();
    if (!box.isEmpty()) {
        const V3d low = V3d(box.min) + origin;
        const V3d high = V3d(box.max) + origin;
        fmt::print(out, "bounds       ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})\n", low.x, low.y, low.z,
                   high.x, high.y, high.z);
    }
    fmt::print(out, "origin       ({:g}, {:g}, {:g})\n", origin.x, origin.y, origin.z);
    print_lights(out, job.scene);
    print_materials(out, job.scene);
    print_camera(out, job);
    fmt::print(out, "integrator   {}\n", integrator_name(job.integrator));
    print_parameters(out, job.integrator);
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
    const std::string suffix = std::filesystem::path(options.file).extension().string();
    if (suffix == ".exr") return print_image(context.out, options.file);
    if (suffix == ".tm25ray") {
        ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
        return print_ray_set(context.out, read_tm25(options.file, monitor));
    }
    print_scene(options.file, context);
}

}  // namespace

void add_info_command(CLI::App& program, const CommandContext& context) {
    const auto options = std::make_shared<InfoOptions>();
    CLI::App& app =
        *program.add_subcommand("info", "What a scene, an image or a lamp holds; the integrators");
    app.footer(kFooter);
    app.add_option("FILE", options->file,
                   "scene (.pbrt), image (.exr), light field (.exr) or rays (.tm25ray)");
    app.add_flag("--integrators", options->integrators, "all integrators and their parameters");
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
