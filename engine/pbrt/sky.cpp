// LightSource "sky", Lucerna's own: a sky of the CIE or of the all-weather model, its sun, and the ground.
//
// The sky is tabulated by directions, and is then an infinite light like one with an image. The sun is a
// disc. Both count in lumens where the scene states no unit. In a radiometric scene the irradiances of the
// weather are those of the lights; elsewhere luminous efficacies turn them into illuminances.
#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/pbrt/light_params.h"
#include "lights/photometric_files.h"
#include "lights/sky_luminance.h"
#include "lights/sun_position.h"
#include "lights/weather_file.h"

namespace lucerna {
namespace {

constexpr std::string_view kSunWays =
    "\"vector3 sun\"; or \"float latitude\", \"float longitude\" and \"string time\"; or \"string epw\" and "
    "\"string time\"";

// The axes of a sky in the current coordinates.
struct SkyAxes {
    V3d east, north, up;

    V3d to_sky(const V3d& w) const { return {w.dot(east), w.dot(north), w.dot(up)}; }
    M44d current_from_sky() const {
        return M44d(east.x, east.y, east.z, 0, north.x, north.y, north.z, 0, up.x, up.y, up.z, 0, 0, 0, 0, 1);
    }
};

SkyAxes read_axes(Params& params) {
    SkyAxes axes;
    axes.up = read_direction(params, "up").value_or(V3d(0, 0, 1));
    constexpr double kAlong = 1e-6;  // radians between "north" and "up" that count as none
    const auto level = [&](const V3d& w) { return w - w.dot(axes.up) * axes.up; };
    const auto stated = read_direction(params, "north");
    V3d north = level(stated.value_or(V3d(0, 1, 0)));
    if (!(north.length() > kAlong)) {
        if (stated)
            fail(params.place_of("north"), "\"north\" of {} is along \"up\"; expected a horizontal direction",
                 params.owner());
        north = V3d(0, 0, -1);  // where y is up
    }
    axes.north = north.normalized();
    axes.east = axes.north.cross(axes.up);
    return axes;
}

// The sun's place in the sky's frame and the weather, as far as the scene states them.
struct SkyTime {
    std::optional<V3d> sun;
    std::optional<SkyWeather> weather;
};

std::string required_text(Params& params, std::string_view name, std::string_view with) {
    if (!params.has(name))
        fail(params.place(), "{} has \"{}\" but lacks \"string {}\"", params.owner(), with, name);
    return params.string(name, "");
}

SkyTime at_time(Params& params) {
    for (const std::string_view name : {"latitude", "longitude"}) {
        if (!params.has(name)) fail(params.place(), "{} lacks \"float {}\"", params.owner(), name);
    }
    const std::string text = required_text(params, "time", "latitude");
    const auto days = parse_time(text);
    if (!days) {
        fail(params.place_of("time"),
             "\"{}\" is no time; expected date, time and zone in the years 1900 to 2100: "
             "2026-06-21T12:00:00+02:00",
             shown(text));
    }
    const GeographicPlace place{params.real_within("latitude", 0, -90, 90),
                                params.real_within("longitude", 0, -180, 180)};
    const SunPosition sun = sun_position(*days, place);
    SkyWeather weather;
    weather.sun_distance = sun.distance;
    return {sun.direction(), weather};
}

SkyTime of_weather_file(Reading& reading, Params& params) {
    const std::string time = required_text(params, "time", "epw");
    try {
        const WeatherHour hour = read_weather_hour(reading.resolve(params.string("epw", "")), time);
        const SunPosition sun = sun_position(hour.days, hour.place);
        SkyTime result{sun.direction(), hour.weather};
        result.weather->sun_distance = sun.distance;
        return result;
    } catch (const InputError& error) {
        fail(params.place_of("epw"), "{}", printable(error.what()));
    }
}

// The weather has irradiances only if the scene or its weather file states them.
SkyTime read_time(Reading& reading, Params& params, const SkyAxes& axes) {
    const bool by_vector = params.has("sun"), by_place = params.has("latitude") || params.has("longitude"),
               by_file = params.has("epw");
    if (int{by_vector} + int{by_place} + int{by_file} > 1)
        fail(params.place(), "{} states the sun's place more than once; expected one of {}", params.owner(),
             kSunWays);
    if (by_file) return of_weather_file(reading, params);
    SkyTime time;
    if (by_place) time = at_time(params);
    if (const auto sun = read_direction(params, "sun")) time.sun = axes.to_sky(*sun);
    constexpr double kMostIrradiance = 1500;  // W/m², more than outside the atmosphere
    const double diffuse = params.real_within("diffuseirradiance", 0, 0, kMostIrradiance);
    const double direct = params.real_within("directirradiance", 0, 0, kMostIrradiance);
    if (!params.has("diffuseirradiance")) {
        if (params.has("directirradiance"))
            fail(params.place_of("directirradiance"), "{} lacks \"float diffuseirradiance\"", params.owner());
        time.weather.reset();
        return time;
    }
    if (!time.weather) time.weather.emplace();
    time.weather->diffuse_horizontal = diffuse;
    time.weather->direct_normal = direct;
    return time;
}

// Returns the sun's place, which must be above the horizon.
V3d required_sun(const Params& params, const SkyTime& time) {
    if (!time.sun) fail(params.place(), "{} lacks the sun's place: {}", params.owner(), kSunWays);
    if (!(time.sun->z > 0)) {
        fail(params.place(), "{}: the sun is {:.2f} degrees below the horizon", params.owner(),
             asin(-time.sun->z) / kRadiansPerDegree);
    }
    return *time.sun;
}

struct SkyStrength {
    double sky, sun;  // irradiance of a horizontal plane and of one that faces the sun, in the light's unit
};

SkyStrength sky_strength(const Reading& reading, Params& params, const SkyTime& time,
                         const std::optional<AllWeatherSky>& by_weather) {
    const bool photometric = reading.draft.unit.value_or(FluxUnit::lumen) == FluxUnit::lumen;
    constexpr double kUsual = 10'000;  // lx
    SkyStrength strength{photometric ? kUsual : 0, 0};
    if (by_weather) {
        strength.sky = time.weather->diffuse_horizontal * (photometric ? by_weather->diffuse_efficacy : 1);
        strength.sun = time.weather->direct_normal * (photometric ? by_weather->direct_efficacy : 1);
    }
    if (const double stated = positive_or_none(params, "illuminance"); stated > 0) strength.sky = stated;
    if (const double stated = positive_or_none(params, "sunilluminance"); stated > 0) strength.sun = stated;
    if (!(strength.sky > 0))
        fail(params.place(),
             "{} lacks its strength in W/m²: \"float illuminance\" or \"float diffuseirradiance\"",
             params.owner());
    return strength;
}

// Returns none for the all-weather model.
std::optional<SkyModel> read_cie_type(Params& params) {
    if (!params.has("type")) fail(params.place(), "{} lacks \"string type\"", params.owner());
    const std::string name = params.string("type", "");
    if (name == "perez") return std::nullopt;
    constexpr std::string_view kPrefix = "cie-";
    if (name.starts_with(kPrefix)) {
        const auto number = number_of(name.substr(kPrefix.size()));
        if (number && *number == std::floor(*number) && *number >= 1 && *number <= kCieSkies)
            return cie_sky(static_cast<int>(*number));
    }
    fail(params.place_of("type"), "type \"{}\" is unknown; expected cie-1 to cie-{}, or perez", shown(name),
         kCieSkies);
}

// Returns the luminances of sky and ground, with 1 unit of irradiance by the sky on a horizontal plane;
// `ground` is the luminance below the horizon.
std::shared_ptr<const DirectionalImage> tabulated(const SkyModel& model, const V3d& sun, double ground) {
    constexpr int kWidth = 1024;  // 0.35°
    const auto grey = [](double value) { return Rgb(static_cast<float>(value)); };
    const auto image = image_by_latitude(
        kWidth, kWidth / 2, [&](const V3d& w) { return grey(model.relative_luminance(w, sun)); });
    const auto whole = double{DirectionalImage(image, SphereMap::latitude_longitude).irradiance().x};
    for (int y = 0; y < image->height; ++y) {
        for (int x = 0; x < image->width; ++x) {
            const bool above = y < image->height / 2;
            image->set_rgb(x, y, above ? image->rgb_at(x, y) / static_cast<float>(whole) : grey(ground));
        }
    }
    return std::make_shared<DirectionalImage>(image, SphereMap::latitude_longitude);
}

// Returns none where no irradiances are stated, which the all-weather model requires.
std::optional<AllWeatherSky> read_weather_sky(const Params& params, const SkyTime& time, bool is_required) {
    if (!time.weather) {
        if (!is_required) return std::nullopt;
        fail(params.place(),
             "{} \"perez\" lacks the weather: \"string epw\", or \"float directirradiance\" and \"float "
             "diffuseirradiance\"",
             params.owner());
    }
    if (!(time.weather->diffuse_horizontal > 0))
        fail(params.place(), "{}: the sky gives no light at this time", params.owner());
    return all_weather_sky(*time.weather, acos(std::min(1.0, required_sun(params, time).z)));
}

}  // namespace

void read_sky(Reading& reading, Params& params) {
    const std::optional<SkyModel> cie = read_cie_type(params);
    const SkyAxes axes = read_axes(params);
    const SkyTime time = read_time(reading, params, axes);
    const std::optional<AllWeatherSky> by_weather = read_weather_sky(params, time, !cie);
    const SkyModel model = cie ? *cie : by_weather->model;
    const SkyStrength strength = sky_strength(reading, params, time, by_weather);
    const bool has_sun = strength.sun > 0;
    const V3d sun = has_sun || model.has_sun() ? required_sun(params, time) : V3d(0, 0, 1);
    const bool sun_shines = has_sun && !reading.draft.without_sun;

    const double on_ground = strength.sky + (sun_shines ? strength.sun * sun.z : 0);
    const double ground = params.real_within("ground", 0, 0, 1) * on_ground / kPiD;
    const LightAxes in_world = light_axes(then(axes.current_from_sky(), reading.state.ctm), params);
    const auto light = [&](double irradiance) {
        return scaled_color(reading, params, reading.colours().white() * static_cast<float>(irradiance));
    };
    reading.draft.lights.push_back(
        {params.place(), ImageInfiniteSpec{tabulated(model, sun, ground / strength.sky), in_world,
                                           light(strength.sky), FluxUnit::lumen}});
    if (sun_shines) {
        reading.draft.lights.push_back(
            {params.place(), SunSpec{V3d(in_world.to_world(V3f(sun))), light(strength.sun)}});
    }
}

}  // namespace lucerna
