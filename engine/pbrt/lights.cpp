// Lights: point, spot, distant, infinite, diffuse areas, and Lucerna's measured lamps ("lightfield",
// "rayfile"). Its skies are in sky.cpp.
//
// Radiance and intensity are pbrt's numbers unchanged, in W, or in lm in a photometric scene. "power" and
// "illuminance" set the luminance of the light's flux or irradiance. pbrt calls them photometric; here one
// unit of luminance is one unit of either.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/pbrt/light_params.h"
#include "engine/pbrt/shapes.h"
#include "lights/cell_table.h"
#include "lights/photometric_files.h"

namespace lucerna {

namespace {

double luminance_of(const Rgb& color) {
    return static_cast<double>(luminance(color));
}

}  // namespace

Rgb light_color(Reading& reading, Params& params, std::string_view name, ColorUse use) {
    return read_spectrum(reading, params, name, use).value_or(reading.colours().white());
}

Rgb scaled_color(Reading& reading, Params& params, const Rgb& value) {
    const Param* scale = params.find_any("scale");
    if (!scale) return value;
    const Rgb factor = scale->type == Param::Type::real
                           ? Rgb(static_cast<float>(params.real_within("scale", 1, 0, 1e30)))
                           : read_spectrum(reading, params, "scale", ColorUse::ratio).value_or(Rgb(1));
    const Rgb result = value * factor;
    if (!is_finite(result))
        fail(scale->place, "\"scale\" {:g} makes the light infinite", max_component(factor));
    return result;
}

Strength read_strength(Reading& reading, Params& params, const Rgb& color) {
    Strength strength{scaled_color(reading, params, color), positive_or_none(params, "power")};
    const double before = luminance_of(color);
    if (strength.power > 0 && before > 0) strength.power *= luminance_of(strength.color) / before;
    return strength;
}

double positive_or_none(Params& params, std::string_view name) {
    if (!params.has(name)) return 0;
    const double value = params.real(name, 0);
    if (value > 0 && value <= 1e30) return value;
    params.warn_or_refuse(
        params.place_of(name),
        fmt::format("\"{}\" of {}: {:g} is not accepted; expected more than 0 and at most 1e30", name,
                    params.owner(), value),
        "it is left out");
    return 0;
}

Rgb with_illuminance(Params& params, const Rgb& color, double illuminance_now) {
    const double wanted = positive_or_none(params, "illuminance");
    if (wanted == 0) return color;
    if (!(illuminance_now > 0))
        fail(params.place_of("illuminance"), "\"illuminance\": the light is black and cannot be scaled");
    return color * static_cast<float>(wanted / illuminance_now);
}

V3d unit(const V3d& v) {
    const double largest = std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
    return largest > 0 ? (v / largest).normalized() : V3d(0);
}

std::optional<V3d> read_direction(Params& params, std::string_view name) {
    const Param* param = params.find(name, {Param::Type::vector3, Param::Type::normal3, Param::Type::point3});
    if (!param) return std::nullopt;
    require_count(*param, param->numbers.size(), 3);
    const V3d direction(param->numbers[0], param->numbers[1], param->numbers[2]);
    if (!(unit(direction).length2() > 0)) {
        fail(param->values, "\"{}\" of {} is ({:g} {:g} {:g}), which is not a direction", name,
             params.owner(), direction.x, direction.y, direction.z);
    }
    return unit(direction);
}

namespace {

// Accepts parameters that steer pbrt's sampling in some version and change no light.
void accept_sampling(Params& params) {
    params.accept({"nsamples", "samples", "shadow"});
}

void read_point(Reading& reading, Params& params) {
    const M44d& ctm = reading.state.ctm;
    const auto [intensity, power] = read_strength(reading, params, light_color(reading, params, "I"));
    const V3d position = transform_point(ctm, params.point("from", V3d(0)));
    reading.draft.lights.push_back({params.place(), PointSpec{position, intensity}, power});
}

void require_direction(const Params& params, const V3d& direction) {
    if (!(direction.length2() > 0))
        fail(params.place(), "{}: its transformation leaves no direction", params.owner());
}

// Reads a parameter of Lucerna for spots of glTF models.
SpotFalloff read_falloff(Params& params) {
    const std::string name = params.string("falloff", "smoothstep");
    if (name == "smoothstep") return SpotFalloff::smoothstep;
    if (name == "quadratic") return SpotFalloff::quadratic;
    fail(params.place_of("falloff"), "falloff \"{}\" is unknown; expected smoothstep or quadratic",
         shown(name));
}

void read_spot(Reading& reading, Params& params) {
    const M44d& ctm = reading.state.ctm;
    SpotSpec spot;
    const Strength strength = read_strength(reading, params, light_color(reading, params, "I"));
    spot.intensity = strength.color;
    const V3d from = params.point("from", V3d(0)), to = params.point("to", V3d(0, 0, 1));
    if (from == to) fail(params.place(), "{}: \"from\" and \"to\" are the same point", params.owner());
    spot.position = transform_point(ctm, from);
    spot.axis = unit(transform_vector(ctm, to - from));
    require_direction(params, spot.axis);
    spot.cone_degrees = params.real_within("coneangle", 30, 1e-3, 180);
    spot.delta_degrees = params.real_within("conedeltaangle", 5, 0, 180);
    if (spot.delta_degrees > spot.cone_degrees) {
        // The falloff cannot begin beyond the axis, so it begins at the axis.
        params.warn_or_refuse(
            params.place_of("conedeltaangle"),
            fmt::format("conedeltaangle {:g} exceeds coneangle {:g}", spot.delta_degrees, spot.cone_degrees),
            "the latter is used for both");
        spot.delta_degrees = spot.cone_degrees;
    }
    spot.falloff = read_falloff(params);
    reading.draft.lights.push_back({params.place(), spot, strength.power});
}

void read_distant(Reading& reading, Params& params) {
    const V3d from = params.point("from", V3d(0)), to = params.point("to", V3d(0, 0, 1));
    if (from == to) fail(params.place(), "{}: \"from\" and \"to\" are the same point", params.owner());
    const V3d direction = unit(transform_vector(reading.state.ctm, to - from));
    require_direction(params, direction);
    const Rgb radiance = light_color(reading, params, "L");
    const Rgb color = with_illuminance(params, radiance, luminance_of(radiance));
    reading.draft.lights.push_back(
        {params.place(), DistantSpec{direction, scaled_color(reading, params, color)}});
}

void read_infinite(Reading& reading, Params& params) {
    if (params.find_any("portal")) {
        params.warn_or_refuse(params.place_of("portal"),
                              fmt::format("\"portal\" of {} is not supported", params.owner()),
                              "the whole sky emits", "the restriction to the portal");
    }
    if (names_an_image(params)) return read_image_infinite(reading, params);
    // A plane that sees half of a sky of radiance L receives π L.
    const Rgb radiance = light_color(reading, params, "L");
    const Rgb color = with_illuminance(params, radiance, M_PI * luminance_of(radiance));
    reading.draft.lights.push_back({params.place(), InfiniteSpec{scaled_color(reading, params, color)}});
}

void read_light_of(Reading& reading, const std::string& kind, Params& params) {
    accept_sampling(params);
    if (kind == "point") return read_point(reading, params);
    if (kind == "spot") return read_spot(reading, params);
    if (kind == "distant") return read_distant(reading, params);
    // These are names of versions 1 and 3 for other ways to sample the same light.
    if (kind == "infinite" || kind == "infinitesample" || kind == "exinfinite") {
        return read_infinite(reading, params);
    }
    if (kind == "goniometric" || kind == "goniophotometric") return read_goniometric(reading, params);
    if (kind == "projection") return read_projection(reading, params);
    if (kind == "photometric" || kind == "ies" || kind == "ldt")
        return read_photometric_light(reading, kind, params);
    if (kind == "lightfield") return read_light_field(reading, params);
    if (kind == "rayfile") return read_ray_file(reading, params);
    if (kind == "sky") return read_sky(reading, params);
    refuse_kind(params.place(), "LightSource", kind,
                {"point", "spot", "distant", "infinite", "goniometric", "projection", "photometric", "ies",
                 "ldt", "lightfield", "rayfile", "sky"},
                {});
}

std::shared_ptr<const AreaLight> read_area_light_of(Reading& reading, const std::string& kind,
                                                    Params& params) {
    if (kind.empty() || kind == "none") return nullptr;
    if (kind == "lightfield") {
        // Reads the parameters like the light source of that name, for a shape to follow.
        accept_sampling(params);
        read_light_field(reading, params);
        AreaLight area;
        area.place = params.place();
        area.lamp = std::make_shared<const MeasuredSettings>(
            std::get<MeasuredSpec>(reading.draft.lights.back().spec).settings);
        reading.draft.lights.pop_back();
        return std::make_shared<const AreaLight>(area);
    }
    if (kind != "diffuse" && kind != "area") {  // "area" is the name in versions 1 and 2
        refuse_kind(params.place(), "AreaLightSource", kind, {"diffuse", "lightfield"}, {});
    }
    accept_sampling(params);
    AreaLight light;
    light.place = params.place();
    // With an image "L" is a factor.
    const bool has_image = params.has("filename");
    Rgb radiance = light_color(reading, params, "L", has_image ? ColorUse::tint : ColorUse::emission);
    if (has_image) {
        radiance = radiance * mean_of_image(reading, params);
        params.warn_or_refuse(params.place_of("filename"),
                              params.owner() + " with \"filename\" is not supported",
                              "the shape emits the image's mean", "the image on it");
    }
    const Strength strength = read_strength(reading, params, radiance);
    light.radiance = strength.color;
    light.power = strength.power;
    light.two_sided = params.boolean("twosided", false);
    return std::make_shared<const AreaLight>(light);
}

}  // namespace

std::string read_light_group(Params& params) {
    const std::string name = params.string("lightgroup", "");
    const bool is_word = std::ranges::all_of(name, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
               c == '-';
    });
    constexpr std::size_t kLongest = 64;
    if (is_word && name.size() <= kLongest) return name;
    fail(params.place_of("lightgroup"),
         "lightgroup \"{}\" is not a valid layer name; expected letters, digits, _ and -, at most {}",
         shown(name), kLongest);
}

void read_light(Reading& reading, const std::string& kind, Params& params) {
    const std::size_t before = reading.draft.lights.size();
    reading.light_spectrum.reset();
    read_light_of(reading, kind, params);
    const std::string group = read_light_group(params);
    for (std::size_t i = before; i < reading.draft.lights.size(); ++i) {
        reading.draft.lights[i].group = group;
        reading.draft.lights[i].spectrum = reading.light_spectrum;
    }
}

std::shared_ptr<const AreaLight> read_area_light(Reading& reading, const std::string& kind, Params& params) {
    reading.light_spectrum.reset();
    const auto light = read_area_light_of(reading, kind, params);
    const std::string group = read_light_group(params);
    if (!light) return nullptr;
    AreaLight grouped = *light;
    grouped.group = group;
    grouped.spectrum = reading.light_spectrum;
    return std::make_shared<const AreaLight>(grouped);
}

// Lamps from measurement files, light fields and ray files, placed in the scene.

namespace {

EmissionMode read_emission(Reading& reading, Params& params) {
    const std::string name = params.string("emission", "exact");
    if (name == "constant") return EmissionMode::constant;
    if (name == "exact") return EmissionMode::exact;
    if (name == "weighted") {
        reading.warn(params.place_of("emission"), "emission \"weighted\" has been removed; exact is used");
        return EmissionMode::exact;
    }
    fail(params.place_of("emission"), "emission \"{}\" is unknown; expected constant or exact", shown(name));
}

Reconstruction read_reconstruction(Params& params) {
    const std::string name = params.string("reconstruction", "exact");
    if (name == "exact") return Reconstruction::exact;
    if (name == "approximate") return Reconstruction::approximate;
    fail(params.place_of("reconstruction"), "reconstruction \"{}\" is unknown; expected exact or approximate",
         shown(name));
}

// Reads the conversion from the lamp's unit to the scene's.
LampUnit read_lamp_unit(const Reading& reading, Params& params) {
    LampUnit unit{reading.draft.unit, 0};
    if (!params.has("efficacy")) return unit;
    unit.efficacy = params.real("efficacy", 0);
    const Place at = params.place_of("efficacy");
    if (!(unit.efficacy > 0 && unit.efficacy <= kMostLumensPerWatt)) {
        fail(at, "\"efficacy\" of {} is {:g} lm/W; expected more than 0 and at most {:g}", params.owner(),
             unit.efficacy, kMostLumensPerWatt);
    }
    if (!unit.wanted) {
        fail(at,
             "\"efficacy\" of {} converts the lamp to the scene's unit, but the scene states none; put "
             "Option \"string unit\" \"photometric\" or \"radiometric\" before WorldBegin",
             params.owner());
    }
    return unit;
}

}  // namespace

M44d read_placement(const Reading& reading, Params& params) {
    const V3d from = params.point("from", V3d(0));
    const M44d moved = then(translation(from), reading.state.ctm);
    if (!params.has("to")) return moved;
    const V3d to = params.point("to", V3d(0)), z = unit(to - from);
    if (!(z.length2() > 0)) {
        fail(params.place_of("to"),
             "\"from\" ({:g} {:g} {:g}) and \"to\" ({:g} {:g} {:g}) of {} give no direction; expected two "
             "different points",
             from.x, from.y, from.z, to.x, to.y, to.z, params.owner());
    }
    const V3d up = read_direction(params, "up").value_or(V3d(0, 1, 0));
    constexpr double kAlong = 1e-6;  // radians between "up" and the line of sight that count as none
    V3d x = up.cross(z);
    if (!(x.length() > kAlong)) {
        const bool x_is_up = std::fabs(up.x) > std::max(std::fabs(up.y), std::fabs(up.z));
        const V3d side = x_is_up ? V3d(0, 1, 0) : V3d(1, 0, 0);
        x = side - side.dot(z) * z;
    }
    x.normalize();
    const V3d y = z.cross(x);
    return then(M44d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, 0, 0, 0, 1), moved);
}

namespace {

// Reads the parameters of both kinds: file, place, "scale" and "power".
template <typename Settings>
Settings read_lamp(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    Settings lamp;
    lamp.file = reading.resolve(params.string("filename", ""));
    lamp.world_from_light = read_placement(reading, params);
    lamp.colours = reading.colours();
    lamp.power_scale = static_cast<float>(params.real_within("scale", 1, 0, 1e30));
    lamp.power = static_cast<float>(positive_or_none(params, "power"));
    lamp.unit = read_lamp_unit(reading, params);
    if (!uniform_scale(lamp.world_from_light)) {
        fail(params.place(),
             "{} is stretched or sheared by its transformation; expected rotation, translation and uniform "
             "scale",
             params.owner());
    }
    if (swaps_handedness(lamp.world_from_light)) {
        fail(params.place(), "{} is mirrored by its transformation; a measured lamp cannot be",
             params.owner());
    }
    return lamp;
}

}  // namespace

void read_light_field(Reading& reading, Params& params) {
    auto lamp = read_lamp<MeasuredSettings>(reading, params);
    lamp.mode = read_emission(reading, params);
    lamp.reconstruction = read_reconstruction(params);
    if (lamp.reconstruction != Reconstruction::exact && lamp.mode != EmissionMode::exact) {
        fail(params.place_of("emission"),
             "reconstruction \"approximate\" works with emission \"exact\" only");
    }
    reading.draft.caches.push_back(cell_table_file(lamp.file));
    reading.draft.lights.push_back({.place = params.place(), .spec = MeasuredSpec{lamp}, .file = lamp.file});
}

void read_ray_file(Reading& reading, Params& params) {
    const auto lamp = read_lamp<RayLightSettings>(reading, params);
    reading.draft.lights.push_back({.place = params.place(), .spec = RayFileSpec{lamp}, .file = lamp.file});
}

// Lamps from photometric files: LightSource "photometric", far fields that shine from luminous openings or
// points, in lumens. The names "ies" and "ldt" mean the same.
//
// The lamp's frame is that of light fields: nadir (γ = 0) is +z, the plane C0 contains +x, C90 contains -y.

namespace {

// Reports warnings of a file's reader at the place in the scene that names the file.
class PlacedMonitor final : public Monitor {
  public:
    PlacedMonitor(Reading& reading, const Place& place) : reading_(reading), place_(place) {}
    void warn(std::string_view line) override { reading_.warn(place_, printable(std::string(line))); }

  private:
    Reading& reading_;
    const Place& place_;
};

// Returns the factor from the candela of a photometric file to the scene's unit.
double factor_of_file(const LampUnit& unit, const std::filesystem::path& file, const Place& at) {
    try {
        return unit_factor(unit, FluxUnit::lumen, 0, {file.string()});
    } catch (const InputError& error) {
        fail(at, "{}", printable(error.what()));
    }
}

std::vector<LuminaireEmitter> read_emitters(Reading& reading, const std::filesystem::path& file,
                                            const Place& place) {
    try {
        PlacedMonitor monitor(reading, place);
        return read_luminaire(file, monitor);
    } catch (const InputError& error) {
        fail(place, "{}", printable(error.what()));
    }
}

// Removes the openings if the lamp shall shine from points.
void read_emission_of(Params& params, std::vector<LuminaireEmitter>& emitters,
                      const std::filesystem::path& file) {
    const bool has_opening = std::ranges::any_of(emitters, [](const LuminaireEmitter& emitter) {
        return emitter.web.info().opening.faces().second > 0;
    });
    const std::string name = params.string("emission", has_opening ? "opening" : "point");
    if (name == "point") {
        for (LuminaireEmitter& emitter : emitters) emitter.web.set_opening({});
        return;
    }
    const Place& place = params.place_of("emission");
    if (name != "opening") fail(place, "emission \"{}\" is unknown; expected opening or point", shown(name));
    if (!has_opening) {
        fail(place, "emission \"opening\": {} states no luminous opening with an area; expected \"point\"",
             printable(file.string()));
    }
}

// Places an emitter of the luminaire, whose own place and axes `luminaire` has.
PhotometricSpec placed(const PhotometricSpec& luminaire, LuminaireEmitter&& emitter) {
    PhotometricSpec spec = luminaire;
    const auto to_world = [&](const V3d& w) { return V3d(luminaire.axes.to_world(V3f(w))); };
    spec.position += spec.metre * to_world(emitter.position);
    const std::array<V3d, 3>& axes = emitter.axes;
    spec.axes = {V3f(to_world(axes[0])), V3f(to_world(axes[1])), V3f(to_world(axes[2]))};
    spec.web = std::make_shared<const PhotometricWeb>(std::move(emitter.web));
    return spec;
}

}  // namespace

void read_photometric_light(Reading& reading, const std::string& kind, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    const std::filesystem::path file = reading.resolve(params.string("filename", ""));
    const Place& place = params.place_of("filename");
    PhotometricSpec spec;
    spec.kind = kind == "ies" ? "ies" : kind == "ldt" ? "ldt" : "photometric";
    std::vector<LuminaireEmitter> emitters = read_emitters(reading, file, place);
    read_emission_of(params, emitters, file);
    const M44d placement = read_placement(reading, params);
    spec.axes = light_axes(placement, params);
    spec.metre =
        cbrt(std::fabs(placement.determinant()));  // of a stretched one, which has been warned of, the mean
    spec.position = transform_point(placement, V3d(0));
    // A colour tints the light and leaves its candela unchanged.
    const Rgb colour = light_color(reading, params, "color", ColorUse::tint);
    if (!(luminance(colour) > 0)) fail(params.place_of("color"), "\"color\" is black");
    const auto [scale, power] = read_strength(reading, params, colour / luminance(colour));
    spec.scale = scale;
    const LampUnit unit = read_lamp_unit(reading, params);
    if (!(power > 0)) spec.scale *= static_cast<float>(factor_of_file(unit, file, place));
    double flux = 0;
    for (const LuminaireEmitter& emitter : emitters) flux += emitter.web.flux();
    for (LuminaireEmitter& emitter : emitters) {
        // A stated power is shared in proportion to the flux.
        const double share = emitters.size() == 1 || !(flux > 0) ? 1 : emitter.web.flux() / flux;
        if (power > 0 && !(share > 0)) continue;
        reading.draft.lights.push_back({.place = params.place(),
                                        .spec = placed(spec, std::move(emitter)),
                                        .power = power * share,
                                        .file = file});
    }
}

}  // namespace lucerna
