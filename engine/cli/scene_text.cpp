#include "engine/cli/scene_text.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <map>

#include "engine/base/error.h"
#include "engine/base/units.h"
#include "engine/integrators/integrator.h"
#include "engine/render/job.h"

namespace lucerna {
namespace {

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

void print_lights(std::ostream& out, const Scene& scene) {
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
    fmt::print(out, "unit         {}\n", unit_text(Quantity::radiance, common_unit(scene.lights())));
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

void print_surfaces(std::ostream& out, const Scene& scene) {
    const Scene::Counts counts = scene.counts();
    std::vector<std::string> parts = {fmt::format("{} triangles", counts.triangles),
                                      fmt::format("{} quadrics", counts.quadrics)};
    if (counts.patches > 0) parts.push_back(fmt::format("{} patches", counts.patches));
    if (counts.curves > 0) parts.push_back(fmt::format("{} curve segments", counts.curves));
    fmt::print(out, "surfaces     {}", fmt::join(parts, ", "));
    if (counts.degenerate_triangles > 0) {
        fmt::print(out, "; {} triangles without area left out", counts.degenerate_triangles);
    }
    fmt::print(out, "\n");
    if (counts.instances > 0) {
        fmt::print(out, "instances    {} of {} objects: {} triangles as seen\n", counts.instances,
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

// What each method would make of the scene before its first ray.
void print_descriptions(std::ostream& out, const Job& job) {
    fmt::print(out, "integrator   {}", integrator_name(job.integrator));
    for (const auto& [name, value] : describe(job.integrator)) fmt::print(out, " {}={}", name, value);
    fmt::print(out, "\nbefore its first ray each integrator would build\n");
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

}  // namespace

void print_scene(std::ostream& out, const Job& job, const std::vector<std::string>& ignored) {
    print_surfaces(out, job.scene);
    print_lights(out, job.scene);
    print_materials(out, job.scene);
    print_camera(out, job);
    print_descriptions(out, job);
    fmt::print(out, "ignored      {}\n", ignored.empty() ? "nothing" : std::to_string(ignored.size()));
    for (const std::string& line : ignored) fmt::print(out, "  {}\n", line);
}

}  // namespace lucerna
