// Finds area lights that lie on the same surface and merges them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/pbrt/draft.h"
#include "engine/pbrt/transforms.h"
#include "engine/scene/scene.h"

namespace lucerna {
namespace {

// Points closer than this share of the surface's extent count as equal. It leaves room for the rounding of
// transformations in double precision and is well below the precision of float32.
constexpr double kTolerance = 1e-8;

// The corners of a triangle, sorted so that the order in the text does not matter.
struct Corners {
    std::array<V3d, 3> p;
    bool turned = false;  // the sorted order has the opposite orientation to the emitting side
};

bool comes_before(const V3d& a, const V3d& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

// Describes the surface of an area light so that equal surfaces give equal numbers up to rounding: by the
// corners of triangles, or by the centre and rim of a sphere or disk.
struct Emitter {
    std::size_t light;
    std::vector<Corners> triangles;
    std::optional<Quadric::Kind> kind;
    V3d centre{0, 0, 0}, n{0, 0, 0};
    double radius = 0, inner_radius = 0, extent = 0, key = 0;
};

// Rounds coordinates to a grid, so that those that differ by rounding alone sort alike.
Corners corners_of(const DraftMesh& mesh, const V3i& triangle, double extent) {
    Corners made{{mesh.p[triangle.x], mesh.p[triangle.y], mesh.p[triangle.z]}};
    const double cell = extent * kTolerance * 16;
    for (V3d& p : made.p) {
        for (int k = 0; k < 3; ++k) p[k] = std::nearbyint(p[k] / cell) * cell;
    }
    bool odd = mesh.traits.reverse_orientation;
    for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)}) {
        if (!comes_before(made.p[b], made.p[a])) continue;
        std::swap(made.p[a], made.p[b]);
        odd = !odd;
    }
    made.turned = odd;
    return made;
}

Emitter emitter_of(const Draft& draft, std::size_t light, const AreaSpec& area) {
    Emitter made;
    made.light = light;
    if (area.surface == AreaSpec::Surface::quadric) {
        const Quadric& quadric = draft.quadrics[area.index];
        const M44d& m = quadric.world_from_object;
        const double scale = uniform_scale(m).value();  // the reader ensures a uniform scale
        const double height = quadric.kind == Quadric::Kind::disk ? static_cast<double>(quadric.height) : 0;
        const double side = quadric.traits.reverse_orientation ? -1 : 1;
        made.kind = quadric.kind;
        made.centre = transform_point(m, V3d(0, 0, height));
        made.radius = static_cast<double>(quadric.radius) * scale;
        made.inner_radius = static_cast<double>(quadric.inner_radius) * scale;
        // The sides of a sphere are inside and outside, so its axis does not matter.
        made.n = side * (quadric.kind == Quadric::Kind::disk
                             ? transform_normal(inverse(m).value(), V3d(0, 0, 1)).normalized()
                             : V3d(0, 0, 1));
        made.extent = 2 * made.radius;
    } else {
        const DraftMesh& mesh = draft.meshes[area.index];
        Box3d box;
        for (const V3i& t : mesh.triangles) {
            for (const int vertex : {t.x, t.y, t.z}) box.extendBy(mesh.p[vertex]);
        }
        made.extent = box.isEmpty() ? 0 : box.size().length();
        made.centre = box.isEmpty() ? V3d(0) : box.center();
        if (!(made.extent > 0 && std::isfinite(made.extent))) return made;
        for (const V3i& t : mesh.triangles) made.triangles.push_back(corners_of(mesh, t, made.extent));
        std::ranges::sort(made.triangles, [](const Corners& a, const Corners& b) {
            return std::ranges::lexicographical_compare(a.p, b.p, comes_before);
        });
    }
    made.key = made.centre.dot(V3d(0.5377, 0.6143, 0.5777));  // rows of lamps seldom lie along it
    return made;
}

// Returns nothing unless b lies on a, and otherwise whether their emitting sides are opposite.
std::optional<bool> turned_on(const Emitter& a, const Emitter& b) {
    const double near = kTolerance * a.extent;
    const auto alike = [near](double x, double y) { return std::fabs(x - y) <= near; };
    if (!(a.extent > 0) || a.kind != b.kind || !alike(a.extent, b.extent)) return std::nullopt;
    if (!((a.centre - b.centre).length() <= near)) return std::nullopt;
    if (a.kind) {
        if (!alike(a.inner_radius, b.inner_radius)) return std::nullopt;
        if (!(a.n.cross(b.n).length() <= kTolerance)) return std::nullopt;
        return a.n.dot(b.n) < 0;
    }
    if (a.triangles.size() != b.triangles.size()) return std::nullopt;
    const bool turned = a.triangles.front().turned != b.triangles.front().turned;
    const double corner_near = 64 * near;  // more than a cell of the grid
    for (std::size_t i = 0; i < a.triangles.size(); ++i) {
        if ((a.triangles[i].turned != b.triangles[i].turned) != turned) return std::nullopt;
        for (std::size_t k = 0; k < 3; ++k) {
            if (!((a.triangles[i].p[k] - b.triangles[i].p[k]).length() <= corner_near)) return std::nullopt;
        }
    }
    return turned;
}

const SurfaceTraits& traits_of(const Draft& draft, const AreaSpec& area) {
    return area.surface == AreaSpec::Surface::quadric ? draft.quadrics[area.index].traits
                                                      : draft.meshes[area.index].traits;
}

// Tells whether rays and media treat both surfaces alike.
bool is_same_kind(const Draft& draft, const AreaSpec& a, const AreaSpec& b) {
    const SurfaceTraits &s = traits_of(draft, a), &t = traits_of(draft, b);
    return a.unseen == b.unseen && (a.unseen || (!s.alpha && !t.alpha)) && !s.shadow_alpha &&
           !t.shadow_alpha && s.media.is_interface == t.media.is_interface &&
           s.media.inside == t.media.inside && s.media.outside == t.media.outside;
}

// Removes the lights and their surfaces.
void remove(Draft& draft, const std::vector<bool>& gone) {
    std::vector<std::int32_t> light_now(gone.size(), kNoLight);
    std::vector<bool> no_quadric(draft.quadrics.size());
    std::int32_t next = 0;
    for (std::size_t i = 0; i < gone.size(); ++i) {
        if (!gone[i]) {
            light_now[i] = next++;
            continue;
        }
        const auto& area = std::get<AreaSpec>(draft.lights[i].spec);
        if (area.surface == AreaSpec::Surface::quadric) {
            no_quadric[area.index] = true;
        } else {
            DraftMesh nothing;
            nothing.traits = draft.meshes[area.index].traits;
            draft.meshes[area.index] = std::move(nothing);
        }
    }
    std::vector<std::size_t> quadric_now(draft.quadrics.size());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < draft.quadrics.size(); ++i) {
        quadric_now[i] = kept;
        if (!no_quadric[i]) draft.quadrics[kept++] = draft.quadrics[i];
    }
    draft.quadrics.resize(kept);
    const auto renumber = [&light_now](auto& shapes) {
        for (auto& shape : shapes) {
            if (shape.traits.light != kNoLight)
                shape.traits.light = light_now[static_cast<std::size_t>(shape.traits.light)];
        }
    };
    renumber(draft.meshes);
    renumber(draft.quadrics);
    std::vector<DraftLight> lights;
    for (std::size_t i = 0; i < gone.size(); ++i) {
        if (gone[i]) continue;
        if (auto* area = std::get_if<AreaSpec>(&draft.lights[i].spec);
            area && area->surface == AreaSpec::Surface::quadric)
            area->index = quadric_now[area->index];
        lights.push_back(std::move(draft.lights[i]));
    }
    draft.lights = std::move(lights);
}

// Merges `other` into `light`, which lies on the same surface.
void add_to(DraftLight& light, const DraftLight& other, bool turned, Monitor& monitor) {
    auto& area = std::get<AreaSpec>(light.spec);
    const auto& added = std::get<AreaSpec>(other.spec);
    if (area.coincident.empty()) {  // the light itself becomes the first of its parts
        area.coincident.push_back({area.radiance, area.two_sided, false, light.power});
        area.radiance = Rgb(0.0F);
        area.two_sided = false;
        light.power = 0;
    }
    area.coincident.push_back({added.radiance, added.two_sided, turned, other.power});
    const std::string group =
        light.group == other.group
            ? std::string()
            : fmt::format(", in light group \"{}\"", light.group.empty() ? "default" : light.group);
    monitor.warn(fmt::format(
        "{}: this area light shines from the very surface of the one at {}; both count, as one light "
        "of the sum of their radiance{}",
        to_string(other.place.location()), to_string(light.place.location()), group));
}

}  // namespace

void merge_coincident_lights(Draft& draft, Monitor& monitor) {
    std::vector<Emitter> emitters;
    for (std::size_t i = 0; i < draft.lights.size(); ++i) {
        const auto* area = std::get_if<AreaSpec>(&draft.lights[i].spec);
        if (area && !area->lamp) emitters.push_back(emitter_of(draft, i, *area));
    }
    std::ranges::stable_sort(emitters, {}, &Emitter::key);
    std::vector<bool> gone(draft.lights.size());
    bool any = false;
    for (std::size_t i = 0; i < emitters.size(); ++i) {
        if (gone[emitters[i].light]) continue;
        for (std::size_t k = i + 1; k < emitters.size(); ++k) {
            if (!(emitters[k].key - emitters[i].key <= 2 * kTolerance * emitters[i].extent)) break;
            DraftLight &light = draft.lights[emitters[i].light], &other = draft.lights[emitters[k].light];
            if (gone[emitters[k].light] ||
                !is_same_kind(draft, std::get<AreaSpec>(light.spec), std::get<AreaSpec>(other.spec)))
                continue;
            const auto turned = turned_on(emitters[i], emitters[k]);
            if (!turned) continue;
            add_to(light, other, *turned, monitor);
            any = gone[emitters[k].light] = true;
        }
    }
    if (any) remove(draft, gone);
}

namespace {

// Returns the light whose surface a ray meets in place of this light's own surface, if any.
std::optional<std::uint32_t> light_in_place_of(const Scene& scene, std::uint32_t light) {
    constexpr int kPlaces = 32;
    for (int i = 0; i < kPlaces; ++i) {
        const float u = (static_cast<float>(i) + 0.5F) / kPlaces;
        const V2f place(u, std::fmod(u * 32 * 0.618034F, 1.0F));  // spread by the golden ratio
        const auto particle = scene.lights()[light]->sample_Le({place, {0.3F, 0.3F}});
        if (!particle || !(particle->from.error > 0) || !(particle->from.n.length2() > 0.5F)) continue;
        const SurfacePoint& from = particle->from;
        const auto met = scene.intersect(Ray{from.p + 2 * from.error * from.n, -from.n, 4 * from.error});
        if (met && met->light != kNoLight && static_cast<std::uint32_t>(met->light) != light)
            return static_cast<std::uint32_t>(met->light);
    }
    return std::nullopt;
}

}  // namespace

void warn_of_overlapping_lights(const Scene& scene, const std::vector<std::string>& places,
                                const Workers& workers, Monitor& monitor) {
    if (places.size() != scene.lights().size()) return;  // edited parts have other lights
    std::vector<std::optional<std::uint32_t>> others(places.size());
    parallel_chunks(workers, static_cast<std::int64_t>(places.size()), [&](std::int64_t i) {
        const auto light = static_cast<std::uint32_t>(i);
        if (scene.is_on_solid_surfaces(light)) others[light] = light_in_place_of(scene, light);
    });
    for (std::size_t i = 0; i < others.size(); ++i) {
        if (!others[i]) continue;
        monitor.warn(fmt::format(
            "{}: the surface of this light coincides in part with that of the light at {}; there a ray meets "
            "one of the two alone, and the other's light is lost to it",
            places[i], places[*others[i]]));
    }
}

}  // namespace lucerna
