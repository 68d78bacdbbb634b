// Turns a draft in world space and double precision into the parts of a Scene around its own origin.
#include <algorithm>
#include <cmath>

#include "engine/pbrt/draft.h"
#include "engine/pbrt/read_scene.h"
#include "engine/pbrt/transforms.h"
#include "engine/scene/shape_set.h"
#include "lights/analytic.h"
#include "lights/sun_position.h"

namespace lucerna {
namespace {

// Limits distances so that their squares stay well within a float.
constexpr double kLargestScene = 1e15;
constexpr double kFarthestScene = 1e30;  // from the origin of world space

struct PositionOf {
    V3d operator()(const PointSpec& s) const { return s.position; }
    V3d operator()(const SpotSpec& s) const { return s.position; }
    V3d operator()(const GoniometricSpec& s) const { return s.position; }
    V3d operator()(const ProjectionSpec& s) const { return s.position; }
    V3d operator()(const PhotometricSpec& s) const { return s.position; }
    V3d operator()(const MeasuredSpec& s) const { return s.settings.world_from_light.translation(); }
    V3d operator()(const RayFileSpec& s) const { return s.settings.world_from_light.translation(); }
    template <typename Other>
    std::optional<V3d> operator()(const Other&) const {
        return std::nullopt;
    }
};

std::optional<V3d> position_of(const DraftLight& light) {
    return std::visit([](const auto& s) { return std::optional<V3d>(PositionOf()(s)); }, light.spec);
}

Box3d light_bounds(const Draft& draft) {
    Box3d bounds;
    for (const DraftLight& light : draft.lights) {
        if (const auto position = position_of(light)) bounds.extendBy(*position);
    }
    return bounds;
}

// Rejects positions so far away that overflow alone would silently remove their light.
void require_near(const V3d& position, const V3d& origin, const Location& at, std::string_view what) {
    const double distance = (position - origin).length();
    if (distance <= kLargestScene) return;
    input_error(at, "{} is {:g} away from the middle of the scene; the limit is {:g}", what, distance,
                kLargestScene);
}

V3f to_scene(const V3d& p, const V3d& origin) {
    return V3f(p - origin);
}

// Returns the emitter of a quadric, which is complete and uniformly scaled, as the reader ensures.
EmitterShape quadric_emitter(const Quadric& quadric) {
    const M44d& m = quadric.world_from_object;
    const double scale = uniform_scale(m).value();
    const bool reverse = quadric.traits.reverse_orientation;
    const auto radius = static_cast<float>(static_cast<double>(quadric.radius) * scale);
    if (quadric.kind == Quadric::Kind::sphere) {
        return SphereEmitter{V3f(transform_point(m, V3d(0))), radius, reverse};
    }
    const V3d n = transform_normal(inverse(m).value(), V3d(0, 0, 1)).normalized();
    const auto inner = static_cast<float>(static_cast<double>(quadric.inner_radius) * scale);
    return DiskEmitter{V3f(transform_point(m, V3d(0, 0, static_cast<double>(quadric.height)))),
                       V3f(reverse ? -n : n), radius, inner};
}

// Returns an emitter with exactly the floats of the scene's geometry.
EmitterShape emitter_of(const AreaSpec& area, const SceneParts& parts,
                        const std::vector<std::size_t>& mesh_of) {
    if (area.surface == AreaSpec::Surface::quadric) return quadric_emitter(parts.quadrics[area.index]);
    const Mesh& mesh = parts.meshes[mesh_of[area.index]];
    return TriangleEmitter{mesh.p, kept_triangles(mesh), mesh.traits.reverse_orientation};
}

// Makes the light of a spec, with its colour times `factor`, in the scene's unit.
struct LightMaker {
    const SceneParts& parts;
    const std::vector<std::size_t>& mesh_of;  // index of each of the draft's meshes in `parts`
    const SceneSphere& sphere;
    const Workers& workers;
    Monitor& monitor;
    std::optional<FluxUnit> stated;  // none: W, and measured lamps in their own unit
    const FarFieldOf& far_field;     // none: lamps keep their near field
    const LampFileOf& lamp_file;     // none: lamps keep their own files
    float factor = 1;

    FluxUnit unit() const { return stated.value_or(FluxUnit::watt); }

    std::unique_ptr<Light> operator()(const PointSpec& s) const {
        return make_point_light(to_scene(s.position, parts.origin), s.intensity * factor, unit());
    }
    std::unique_ptr<Light> operator()(const SpotSpec& s) const {
        return make_spot_light(
            to_scene(s.position, parts.origin), V3f(s.axis), s.intensity * factor,
            {static_cast<float>(s.cone_degrees), static_cast<float>(s.delta_degrees), s.falloff}, unit());
    }
    std::unique_ptr<Light> operator()(const DistantSpec& s) const {
        return make_distant_light(V3f(s.direction), s.irradiance * factor, sphere, unit());
    }
    std::unique_ptr<Light> operator()(const InfiniteSpec& s) const {
        return make_infinite_light(s.radiance * factor, sphere, unit());
    }
    std::unique_ptr<Light> operator()(const ImageInfiniteSpec& s) const {
        return make_image_infinite_light(s.image, s.axes, s.scale * factor, sphere,
                                         stated.value_or(s.own_unit));
    }
    std::unique_ptr<Light> operator()(const SunSpec& s) const {
        return make_sun_light(V3f(s.towards), kSunRadius, s.irradiance * factor, sphere,
                              stated.value_or(FluxUnit::lumen));
    }
    std::unique_ptr<Light> operator()(const GoniometricSpec& s) const {
        return make_goniometric_light(s.image, to_scene(s.position, parts.origin), s.axes, s.scale * factor,
                                      unit());
    }
    std::unique_ptr<Light> operator()(const ProjectionSpec& s) const {
        return make_projection_light(s.slide, to_scene(s.position, parts.origin), s.axes, s.scale * factor,
                                     unit());
    }
    std::unique_ptr<Light> operator()(const PhotometricSpec& s) const {
        return make_photometric_light(
            s.kind, s.web, {to_scene(s.position, parts.origin), s.axes, static_cast<float>(s.metre)},
            s.scale * factor, stated.value_or(FluxUnit::lumen));
    }
    MeasuredSettings settings_of(const MeasuredSettings& lamp) const {
        MeasuredSettings settings = lamp;
        settings.world_from_light = relative_to(settings.world_from_light, parts.origin);
        if (lamp_file) settings.file = lamp_file(settings.file);
        return settings;
    }
    std::unique_ptr<Light> operator()(const MeasuredSpec& s) const {
        const MeasuredSettings settings = settings_of(s.settings);
        if (s.part) return part_of_lamp(settings, *s.part);
        return as_far_field(settings, make_measured_light(settings, workers, monitor));
    }
    std::unique_ptr<Light> part_of_lamp(const MeasuredSettings& settings, const Lumigraph& part) const {
        std::vector<CellTable> tables;
        for (const LightField* field : fields_of(part)) tables.emplace_back(*field, workers, monitor);
        return make_measured_light(part, std::move(tables), settings, monitor, nullptr, workers);
    }
    std::unique_ptr<Light> operator()(const RayFileSpec& s) const {
        RayLightSettings settings = s.settings;
        settings.world_from_light = relative_to(settings.world_from_light, parts.origin);
        return as_far_field(settings, make_ray_light(settings, monitor));
    }
    // If far_field is set, returns the light of the lamp's photometric file with the same flux and colour, at
    // the origin of the lamp's frame. It shines from the opening that the file states, if any.
    template <typename Settings>
    std::unique_ptr<Light> as_far_field(const Settings& settings, std::unique_ptr<Light> lamp) const {
        if (!far_field) return lamp;
        const auto web = std::make_shared<const PhotometricWeb>(far_field(settings.file));
        const M44d& m = settings.world_from_light;
        const auto axis = [&m](int row) { return V3f(V3d(m[row][0], m[row][1], m[row][2]).normalized()); };
        // The web has flux, because one without is rejected when it is made.
        const Rgb scale = lamp->flux() / static_cast<float>(web->flux());
        const auto metre = static_cast<float>(V3d(m[0][0], m[0][1], m[0][2]).length());
        return make_photometric_light("ies", web, {V3f(m.translation()), {axis(0), axis(1), axis(2)}, metre},
                                      scale, lamp->unit());
    }
    std::unique_ptr<Light> operator()(const AreaSpec& s) const {
        if (s.lamp) return lamp_on_shape(s);
        const EmitterShape shape = emitter_of(s, parts, mesh_of);
        Rgb front = s.radiance * factor, back = s.two_sided ? front : Rgb(0.0F);
        for (const CoincidentEmission& other : s.coincident) {
            Rgb radiance = other.radiance;
            if (other.power > 0) {
                const double now = make_area_light(shape, radiance, other.two_sided)->power();
                radiance *= static_cast<float>(now > 0 ? other.power / now : 0);
            }
            if (other.two_sided || !other.turned) front += radiance;
            if (other.two_sided || other.turned) back += radiance;
        }
        auto light = make_area_light(shape, front, back, unit());
        return s.unseen ? make_unseen_light(std::move(light)) : std::move(light);
    }
    std::unique_ptr<Light> lamp_on_shape(const AreaSpec& s) const {
        const MeasuredSettings settings = settings_of(*s.lamp);
        Shapes shape;
        if (s.surface == AreaSpec::Surface::quadric)
            shape.quadrics.push_back(parts.quadrics[s.index]);
        else
            shape.meshes.push_back(parts.meshes[mesh_of[s.index]]);
        return as_far_field(settings, make_measured_light(settings, workers, monitor,
                                                          make_traced_shape(std::move(shape), parts.origin)));
    }
};

std::unique_ptr<Light> build_light(const DraftLight& draft, LightMaker maker) {
    std::unique_ptr<Light> light;
    try {
        light = std::visit(maker, draft.spec);
    } catch (const InputError& error) {
        fail(draft.place, "{}", printable(error.what()));
    }
    if (draft.power > 0) {
        const double now = light->power();
        if (!(now > 0))
            fail(draft.place, "\"power\" {:g}: the light is black and cannot be scaled", draft.power);
        maker.factor = static_cast<float>(draft.power / now);
        light = std::visit(maker, draft.spec);
    }
    const double power = light->power();
    if (!std::isfinite(power) || power < 0) {
        fail(draft.place, "the light's power is {:g} {}; expected a finite power", power,
             flux_unit_name(light->unit()));
    }
    if (power == 0) {
        maker.monitor.warn(
            fmt::format("{}: this {} light has no power", to_string(draft.place.location()), light->kind()));
    }
    const auto* area = std::get_if<AreaSpec>(&draft.spec);
    light->set_file(area && area->lamp ? area->lamp->file : draft.file);
    return light;
}

// Warns of lights in different units, whose image would have no unit.
void warn_of_mixed_units(const std::vector<DraftLight>& drafts,
                         const std::vector<std::unique_ptr<Light>>& lights, Monitor& monitor) {
    std::optional<std::size_t> first;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!(lights[i]->power() > 0)) continue;
        if (!first) first = i;
        const Light &one = *lights[*first], &other = *lights[i];
        if (one.unit() == other.unit()) continue;
        monitor.warn(
            fmt::format("{}: this {} light is in {}, but the {} light at {} is in {}; the image adds both. "
                        "To have all light in lm, put Option \"string unit\" \"photometric\" before "
                        "WorldBegin (or use --unit photometric)",
                        to_string(drafts[i].place.location()), other.kind(), flux_unit_name(other.unit()),
                        one.kind(), to_string(drafts[*first].place.location()), flux_unit_name(one.unit())));
        return;
    }
}

// Warns of measured lamps in very large scenes, because models are often made in millimetres.
void warn_of_size(const Draft& draft, const std::vector<std::unique_ptr<Light>>& lights, double diagonal,
                  Monitor& monitor) {
    constexpr double kLarge = 1000;  // scene units, that is m: more than any building, less than a room in mm
    const bool measured = draft.unit == FluxUnit::lumen || std::ranges::any_of(lights, [](const auto& light) {
                              return !light->file().empty();
                          });
    if (!measured || !(diagonal > kLarge)) return;
    monitor.warn(
        fmt::format("{}: the scene is {:.4g} m across; lengths are metres: `Scale 0.001 0.001 0.001` "
                    "after WorldBegin, if the model is in millimetres?",
                    draft.sources.front()->name(), diagonal));
}

// Lists the groups in the order of the text. "default" holds ungrouped lights and the emission of media.
LightGroups group_lights(const std::vector<DraftLight>& lights, bool glows) {
    constexpr const char* kRest = "default";
    LightGroups groups;
    const auto named = [](const DraftLight& light) { return !light.group.empty(); };
    if (std::ranges::none_of(lights, named)) return groups;
    const auto of = [&groups](const std::string& name) {
        const auto found = std::ranges::find(groups.names, name);
        if (found == groups.names.end()) groups.names.push_back(name);
        return static_cast<std::uint32_t>(std::ranges::find(groups.names, name) - groups.names.begin());
    };
    for (const DraftLight& light : lights) groups.of_light.push_back(of(named(light) ? light.group : kRest));
    if (glows) groups.of_rest = of(kRest);
    return groups;
}

// Sets the spectra of groups whose lights have the same one.
void add_spectra(const std::vector<DraftLight>& lights, LightGroups& groups) {
    groups.spectra.resize(groups.names.size());
    for (std::size_t i = 0; i < lights.size(); ++i)
        groups.spectra[groups.of_light[i]] = lights[i].spectrum.value();
}

// Returns the distance from the origin to the box's farthest corner, the reach of lights at infinity.
float reach_of(const Box3d& box) {
    if (box.isEmpty()) return 0;
    V3d far;
    for (int k = 0; k < 3; ++k) far[k] = std::max(std::fabs(box.min[k]), std::fabs(box.max[k]));
    return static_cast<float>(far.length());
}

SceneMedia build_media(const Draft& draft, const V3d& origin) {
    SceneMedia media;
    if (!draft.uses_media) return media;
    for (const DraftMedium& made : draft.media) {
        Medium medium = made.medium.value();  // require_media() ensures that it is set
        const auto back = inverse(relative_to(made.world_from_medium, origin));
        if (!back)
            fail(made.place, "the medium's transformation is not invertible around the scene's origin");
        medium.medium_from_scene = *back;
        media.all.push_back(std::move(medium));
    }
    media.regions = draft.regions;
    media.camera = draft.camera_medium;
    return media;
}

Camera::Settings build_camera(const Draft& draft, const V3d& origin) {
    Camera::Settings camera = draft.camera;
    camera.world_from_camera = relative_to(camera.world_from_camera, origin);
    camera.width = draft.film.width;
    camera.height = draft.film.height;
    const bool window_given = std::any_of(camera.screen, camera.screen + 4, [](float x) { return x != 0; });
    if (draft.frame_aspect_ratio > 0 && !window_given) {
        // As in pbrt, the shorter side of the frame spans [-1, 1].
        const auto aspect = static_cast<float>(draft.frame_aspect_ratio);
        const float x = std::max(1.0F, aspect), y = std::max(1.0F, 1 / aspect);
        const float window[4] = {-x, x, -y, y};
        std::copy_n(window, 4, camera.screen);
    }
    return camera;
}

}  // namespace

Assembled assemble(Draft draft, const Workers& workers, Monitor& monitor) {
    Assembled result;
    SceneParts& parts = result.parts;

    merge_coincident_lights(draft, monitor);
    const bool by_spectra = draft.film.colours.has_intervals();
    if (by_spectra) split_by_spectra(draft, monitor);

    // The origin is the centre of everything, so that float32 keeps the shape of a scene wherever it lies.
    const Placements placements = place_objects(draft);
    Box3d bounds = bounds_of(draft);
    bounds.extendBy(placements.bounds);
    const bool has_shapes = !bounds.isEmpty();
    if (!has_shapes) bounds = light_bounds(draft);
    parts.origin = bounds.isEmpty() ? V3d(0) : bounds.center();
    SceneSphere sphere;
    const double radius = bounds.isEmpty() ? 0 : bounds.size().length() / 2;
    const Location at = draft.sources.front()->location(0);
    if (!(radius <= kLargestScene)) {
        input_error(at, "the scene's radius is {:g}; the limit is {:g}", radius, kLargestScene);
    }
    if (!(parts.origin.length() <= kFarthestScene)) {
        input_error(at, "the middle of the scene is {:g} away from the origin; the limit is {:g}",
                    parts.origin.length(), kFarthestScene);
    }
    for (const DraftLight& light : draft.lights) {
        if (const auto position = position_of(light))
            require_near(*position, parts.origin, light.place.location(), "the light");
    }
    require_near(draft.camera.world_from_camera.translation(), parts.origin, at, "the camera");
    // Enlarges the radius a little, as the float32 vertices may exceed the bounds by their rounding.
    if (radius > 0) sphere.radius = static_cast<float>(radius * (1 + 1e-6)) * (1 + 1e-6F);

    parts.unit = draft.unit;
    parts.materials = draft.materials;
    std::vector<std::size_t> mesh_of;
    static_cast<Shapes&>(parts) =
        build_shapes(std::move(static_cast<DraftShapes&>(draft)), parts.origin, mesh_of);
    build_prototypes(draft, placements, parts);
    parts.media = build_media(draft, parts.origin);
    sphere.radius = std::max(sphere.radius,
                             std::min(static_cast<float>(kLargestScene), reach_of(bounds_of(parts.media))));
    for (const DraftLight& light : draft.lights) {
        result.light_places.push_back(to_string(light.place.location()));
        parts.lights.push_back(build_light(light, LightMaker{parts, mesh_of, sphere, workers, monitor,
                                                             draft.unit, draft.far_field, draft.lamp_file}));
    }
    warn_of_mixed_units(draft.lights, parts.lights, monitor);
    const bool glows = std::any_of(parts.media.all.begin(), parts.media.all.end(),
                                   [](const Medium& medium) { return medium.emits(); });
    if (by_spectra && glows)
        input_error(at, "a medium emits light, whose spectrum is not known; colours need that of all light");
    parts.light_groups = group_lights(draft.lights, glows);
    if (by_spectra) add_spectra(draft.lights, parts.light_groups);
    if (!has_shapes && draft.media.empty()) {
        monitor.warn(
            draft.sources.front()->name() +
            ": the scene has no shapes; only lights that are seen without a surface are in its image");
    }
    warn_of_size(draft, parts.lights, 2 * radius, monitor);
    if (draft.lights.empty() && !glows)
        monitor.warn(draft.sources.front()->name() + ": the scene has no light");
    result.camera = build_camera(draft, parts.origin);
    return result;
}

}  // namespace lucerna
