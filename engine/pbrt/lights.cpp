// Lights: point, spot, distant, constant sky, diffuse areas, and our own measured lamps ("lightfield").
//
// Radiance and intensity are taken as pbrt's numbers stand, in W; "power" and "illuminance" set the luminance
// of the light's flux or irradiance (pbrt calls them photometric; one unit of luminance is one unit of either
// here).
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// "scale": a float, or version 3's colour. Applied to `value`.
Rgb scaled(Params& params, const Rgb& value) {
    const Param* scale = params.find("scale", {Type::real, Type::rgb});
    if (!scale) return value;
    if (scale->type == Type::rgb) return value * to_rgb(*scale);
    const Rgb result = value * static_cast<float>(params.real_within("scale", 1, 0, 1e30));
    if (!is_finite(result))
        fail(scale->place, "\"scale\" {:g} makes the light infinite", scale->numbers.front());
    return result;
}

// A positive number where the parameter is given, otherwise 0.
double positive_or_none(Params& params, std::string_view name) {
    if (!params.has(name)) return 0;
    const double value = params.real(name, 0);
    if (!(value > 0 && value <= 1e30)) {
        fail(params.place_of(name), "\"{}\" of {}: {:g} is not accepted; more than 0, to 1e30 is", name,
             params.owner(), value);
    }
    return value;
}

// Multiplies so that the luminance becomes illuminance / `per_unit`.
Rgb with_illuminance(Params& params, const Rgb& color, double per_unit) {
    const double wanted = positive_or_none(params, "illuminance");
    if (wanted == 0) return color;
    const double now = static_cast<double>(luminance(color));
    if (!(now > 0))
        fail(params.place_of("illuminance"), "\"illuminance\": the light is black, it cannot be scaled");
    return color * static_cast<float>(wanted / (per_unit * now));
}

void refuse_image(const Params& params, std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) {
        if (params.has(name))
            fail(params.place_of(name), "{} with \"{}\" is not supported yet", params.owner(), name);
    }
}

void read_point(Reading& reading, Params& params) {
    refuse_image(params, {"filename"});
    const M44d& ctm = reading.state.ctm;
    const Rgb intensity = scaled(params, params.rgb("I", Rgb(1.0F)));
    const V3d position = transform_point(ctm, params.point("from", V3d(0)));
    reading.draft.lights.push_back(
        {params.place(), PointSpec{position, intensity}, positive_or_none(params, "power")});
}

void read_spot(Reading& reading, Params& params) {
    const M44d& ctm = reading.state.ctm;
    SpotSpec spot;
    spot.intensity = scaled(params, params.rgb("I", Rgb(1.0F)));
    const V3d from = params.point("from", V3d(0)), to = params.point("to", V3d(0, 0, 1));
    if (from == to) fail(params.place(), "{}: \"from\" and \"to\" are the same point", params.owner());
    spot.position = transform_point(ctm, from);
    spot.axis = transform_vector(ctm, to - from).normalized();
    spot.cone_degrees = params.real_within("coneangle", 30, 1e-3, 180);
    spot.delta_degrees = params.real_within("conedeltaangle", 5, 0, 180);
    if (spot.delta_degrees > spot.cone_degrees) {
        // pbrt's cosines then cross; nothing sensible is meant by it.
        fail(params.place_of("conedeltaangle"), "conedeltaangle {:g} exceeds coneangle {:g}",
             spot.delta_degrees, spot.cone_degrees);
    }
    reading.draft.lights.push_back({params.place(), spot, positive_or_none(params, "power")});
}

void read_distant(Reading& reading, Params& params) {
    const V3d from = params.point("from", V3d(0)), to = params.point("to", V3d(0, 0, 1));
    if (from == to) fail(params.place(), "{}: \"from\" and \"to\" are the same point", params.owner());
    const V3d direction = transform_vector(reading.state.ctm, to - from).normalized();
    const Rgb color = with_illuminance(params, params.rgb("L", Rgb(1.0F)), 1);
    reading.draft.lights.push_back({params.place(), DistantSpec{direction, scaled(params, color)}});
}

void read_infinite(Reading& reading, Params& params) {
    refuse_image(params, {"filename", "mapname", "portal"});
    params.accept({"nsamples", "samples"});
    // A plane that sees half of a sky of radiance L receives π L.
    const Rgb color = with_illuminance(params, params.rgb("L", Rgb(1.0F)), M_PI);
    reading.draft.lights.push_back({params.place(), InfiniteSpec{scaled(params, color)}});
}

EmissionMode read_emission(Params& params) {
    const std::string name = params.string("emission", "exact");
    if (name == "constant") return EmissionMode::constant;
    if (name == "exact") return EmissionMode::exact;
    if (name == "weighted") return EmissionMode::weighted;
    fail(params.place_of("emission"), "emission \"{}\" is unknown; constant, exact and weighted are accepted",
         shown(name));
}

void read_light_field(Reading& reading, Params& params) {
    if (!params.has("filename")) fail(params.place(), "{} lacks \"string filename\"", params.owner());
    MeasuredSettings lamp;
    lamp.file = reading.resolve(params.string("filename", ""));
    lamp.world_from_light = reading.state.ctm;
    lamp.power_scale = static_cast<float>(params.real_within("scale", 1, 0, 1e30));
    lamp.power = static_cast<float>(positive_or_none(params, "power"));
    lamp.mode = read_emission(params);
    if (!uniform_scale(lamp.world_from_light)) {
        fail(params.place(),
             "{} is stretched or sheared by its transformation; rotation, translation and one scale "
             "for all directions are accepted",
             params.owner());
    }
    if (swaps_handedness(lamp.world_from_light)) {
        fail(params.place(), "{} is mirrored by its transformation; a measured lamp cannot be",
             params.owner());
    }
    reading.draft.lights.push_back({params.place(), MeasuredSpec{lamp}});
}

}  // namespace

void read_light(Reading& reading, const std::string& kind, Params& params) {
    if (kind == "point") return read_point(reading, params);
    if (kind == "spot") return read_spot(reading, params);
    if (kind == "distant") return read_distant(reading, params);
    if (kind == "infinite") return read_infinite(reading, params);
    if (kind == "lightfield") return read_light_field(reading, params);
    refuse_kind(params.place(), "LightSource", kind, {"point", "spot", "distant", "infinite", "lightfield"},
                {"exinfinite", "goniometric", "infinitesample", "projection"});
}

std::shared_ptr<const AreaLight> read_area_light(Reading&, const std::string& kind, Params& params) {
    if (kind.empty() || kind == "none") return nullptr;
    if (kind != "diffuse" && kind != "area") {  // "area" is version 2's name
        refuse_kind(params.place(), "AreaLightSource", kind, {"diffuse"}, {});
    }
    refuse_image(params, {"filename"});
    params.accept({"samples", "nsamples"});
    AreaLight light;
    light.place = params.place();
    light.radiance = scaled(params, params.rgb("L", Rgb(1.0F)));
    light.power = positive_or_none(params, "power");
    light.two_sided = params.boolean("twosided", false);
    return std::make_shared<const AreaLight>(light);
}

}  // namespace lucerna
