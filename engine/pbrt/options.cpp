// Reads camera, film, filter and sampler, the options before WorldBegin; integrator.cpp reads the integrator.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/pbrt/state.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

using Type = Param::Type;

void read_screen_window(Reading& reading, Params& params) {
    const Param* window = params.find("screenwindow", {Type::real});
    if (!window) return;
    if (window->numbers.size() != 4) {
        return params.warn_or_refuse(
            window->place,
            fmt::format("\"screenwindow\" has {} numbers; expected 4 (x0 x1 y0 y1)", window->numbers.size()),
            "it is left out");
    }
    if (!(window->numbers[0] < window->numbers[1] && window->numbers[2] < window->numbers[3])) {
        return params.warn_or_refuse(window->place,
                                     fmt::format("\"screenwindow\" is {:g}; expected x0 < x1 and y0 < y1",
                                                 fmt::join(window->numbers, " ")),
                                     "it is left out");
    }
    for (std::size_t i = 0; i < 4; ++i)
        reading.draft.camera.screen[i] = static_cast<float>(window->numbers[i]);
}

// Reads the width or height of the image in pixels.
int read_side(Params& params, std::string_view name, int fallback) {
    constexpr int kMost = 1 << 16;
    const int side = params.integer(name, fallback);
    if (side < 1 || side > kMost) {
        fail(params.place_of(name), "{}: {} is not accepted; expected 1 to {} pixels", name, side, kMost);
    }
    return side;
}

// Reads the crop of the image, as shares of its sides or in pixels.
void read_crop(Params& params, FilmSettings& film) {
    const Param* shares = params.find("cropwindow", {Type::real});
    const Param* pixels = params.find("pixelbounds", {Type::integer, Type::real});
    const Param* window = shares ? shares : pixels;
    if (!window) return;
    if (window->numbers.size() != 4) {
        return params.warn_or_refuse(window->place,
                                     fmt::format("\"{}\" has {} numbers; expected 4 (x0 x1 y0 y1)",
                                                 window->name, window->numbers.size()),
                                     "it is left out");
    }
    const double wide = film.width, high = film.height;
    const auto edge = [&](std::size_t i) {
        const double most = i < 2 ? wide : high;
        const double at = window->numbers[i];
        return static_cast<int>(std::clamp(shares ? std::ceil(most * at) : at, 0.0, most));
    };
    // As in pbrt, the edges may have either order.
    film.crop_begin = V2i(std::min(edge(0), edge(1)), std::min(edge(2), edge(3)));
    film.crop_end = V2i(std::max(edge(0), edge(1)), std::max(edge(2), edge(3)));
    if (film.crop_begin.x >= film.crop_end.x || film.crop_begin.y >= film.crop_end.y) {
        fail(window->place, "\"{}\" {:g} leaves no pixel of {} x {}", window->name,
             fmt::join(window->numbers, " "), film.width, film.height);
    }
}

// Reads version 4's camera sensor. Exposure time and ISO become one factor; measured sensors are not
// supported.
double read_sensor(Params& params) {
    const std::string sensor = params.string("sensor", "cie1931");
    if (sensor != "cie1931") {
        params.warn_or_refuse(params.place_of("sensor"),
                              fmt::format("sensor \"{}\" is not supported; expected cie1931", shown(sensor)),
                              "cie1931 is used", "the sensor's own colours");
    }
    if (params.real("whitebalance", 0) != 0) {
        params.warn_or_refuse(params.place_of("whitebalance"),
                              "\"whitebalance\" is not supported; expected 0", "colours are not changed",
                              "white balance");
    }
    const double iso = params.real_within("iso", 100, 1e-6, 1e9);
    const double seconds = params.real_within("exposuretime", 1, 1e-9, 1e9);
    return iso * seconds / 100 * params.real_within("imagingratio", 1, 1e-9, 1e9);
}

float read_radius(Params& params, std::string_view v4_name, std::string_view v3_name, double fallback) {
    const std::string_view name = params.has(v3_name) ? v3_name : v4_name;
    if (params.has(v3_name) && params.has(v4_name)) {
        params.warn_or_refuse(
            params.place_of(v3_name),
            fmt::format("\"{}\" and \"{}\" are two names of the same parameter; use one", v3_name, v4_name),
            fmt::format("\"{}\" is used", v3_name));
    }
    // Accepts both names, so that either is suggested when a third is misspelt.
    params.accept({v3_name, v4_name});
    return static_cast<float>(params.real_within(name, fallback, 1e-3, 100));
}

}  // namespace

namespace {

void read_lens(Camera::Settings& camera, Params& params) {
    camera.lens_radius = static_cast<float>(params.real_within("lensradius", 0, 0, 1e30));
    // Versions 1 and 2 write 1e30 for infinity, which makes the lens blur nothing.
    camera.focal_distance = static_cast<float>(params.real_within("focaldistance", 1e6, 1e-30, 1e38));
}

// Reads the mapping of the sphere. Version 4 has equal areas by default, the older "environment" latitude and
// longitude.
Camera::Settings::Mapping read_mapping(Params& params, bool environment) {
    const std::string mapping = environment ? "equirectangular" : params.string("mapping", "equalarea");
    if (mapping == "equirectangular") return Camera::Settings::Mapping::equirectangular;
    if (mapping == "equalarea") return Camera::Settings::Mapping::equal_area;
    params.warn_or_refuse(
        params.place_of("mapping"),
        fmt::format("mapping \"{}\" is not accepted; expected equalarea or equirectangular", shown(mapping)),
        "equalarea is used");
    return Camera::Settings::Mapping::equal_area;
}

}  // namespace

void read_camera(Reading& reading, const std::string& kind, Params& params) {
    Camera::Settings& camera = reading.draft.camera;
    // Accepts clipping planes and shutter times, as nothing moves or is clipped.
    params.accept({"hither", "yon", "shutteropen", "shutterclose"});
    if (kind == "spherical" || kind == "environment") {
        camera.kind = Camera::Settings::Kind::spherical;
        camera.mapping = read_mapping(params, kind == "environment");
        params.accept({"screenwindow", "frameaspectratio", "lensradius", "focaldistance"});
        return;
    }
    if (kind == "perspective") {
        camera.kind = Camera::Settings::Kind::perspective;
        double fov = params.real_within("fov", 90, 1e-3, 179.999);
        if (params.has("halffov")) fov = 2 * params.real_within("halffov", 45, 5e-4, 89.999);
        camera.fov_degrees = static_cast<float>(fov);
    } else if (kind == "orthographic") {
        camera.kind = Camera::Settings::Kind::orthographic;
    } else if (kind == "realistic") {
        return read_realistic(reading, params);
    } else {
        refuse_kind(params.place(), "Camera", kind,
                    {"perspective", "orthographic", "spherical", "environment", "realistic"}, {});
    }
    read_screen_window(reading, params);
    reading.draft.frame_aspect_ratio =
        params.has("frameaspectratio") ? params.real_within("frameaspectratio", 1, 1e-3, 1e3) : 0;
    read_lens(camera, params);
}

void read_film(Reading& reading, const std::string& kind, Params& params) {
    FilmSettings& film = reading.draft.film;
    const bool version3 = kind == "image";
    if (kind == "gbuffer" || kind == "spectral") {
        reading.warn_or_refuse(params.place(), fmt::format("Film \"{}\" is not supported", kind),
                               "red, green and blue are written", "its other channels");
        params.accept({"buckets", "coordsys", "lambdamax", "lambdamin", "nbuckets"});
    } else if (!version3 && kind != "rgb") {
        refuse_kind(params.place(), "Film", kind, {"rgb", "image", "gbuffer", "spectral"}, {});
    }
    const ColourSpace* space = reading.state.colour_space;
    if (space && !WorkingSpace::named(space->name)) {
        reading.warn_or_refuse(
            params.place(), fmt::format("an image in ColorSpace \"{}\" is not supported", space->name),
            film.colours.is_srgb() ? "it is in linear sRGB" : fmt::format("it is in {}", film.colours.name()),
            "saturation");
    }
    // Each version has its own default.
    film.width = read_side(params, "xresolution", version3 ? 640 : 1280);
    film.height = read_side(params, "yresolution", version3 ? 480 : 720);
    film.filename = params.string("filename", FilmSettings{}.filename.string());
    if (film.filename.empty()) {
        film.filename = FilmSettings{}.filename;
        params.warn_or_refuse(params.place_of("filename"),
                              "\"filename\" is empty; expected the name of an image",
                              fmt::format("\"{}\" is used", film.filename.string()));
    }
    reading.draft.film_diagonal = params.real_within("diagonal", 35, 1e-3, 1e6) / 1000;
    reading.draft.film_of_version4 = !version3;
    double scale = params.real_within("scale", 1, 1e-30, 1e30);
    if (!version3) scale *= read_sensor(params);
    film.scale = static_cast<float>(scale);
    read_crop(params, film);
    // Accepts options of half floats and of older file output.
    params.accept({"savefp16", "maxcomponentvalue", "maxsampleluminance", "premultiplyalpha",
                   "writefrequency", "display"});
}

void read_filter(Reading& reading, const std::string& kind, Params& params) {
    FilterSettings& filter = reading.draft.film.filter;
    double radius = 0;
    if (kind == "box") {
        filter.kind = FilterSettings::Kind::box;
        radius = 0.5;
    } else if (kind == "triangle") {
        filter.kind = FilterSettings::Kind::triangle;
        radius = 2;
    } else if (kind == "gaussian") {
        filter.kind = FilterSettings::Kind::gaussian;
        const bool version3 = params.has("xwidth") || params.has("ywidth") || params.has("alpha");
        radius = version3 ? 2 : 1.5;
        // Version 3 writes exp(-alpha x²).
        const double sigma = version3 ? std::sqrt(0.5 / params.real_within("alpha", 2, 1e-6, 1e6))
                                      : params.real_within("sigma", 0.5, 1e-3, 100);
        filter.sigma = static_cast<float>(sigma);
    } else if (kind == "mitchell") {
        filter.kind = FilterSettings::Kind::mitchell;
        radius = 2;
        filter.b = static_cast<float>(params.real_within("B", 1.0 / 3, -10, 10));
        filter.c = static_cast<float>(params.real_within("C", 1.0 / 3, -10, 10));
    } else if (kind == "sinc" || kind == "lanczos") {
        filter.kind = FilterSettings::Kind::sinc;
        radius = 4;
        filter.tau = static_cast<float>(params.real_within("tau", 3, 0.1, 100));
    } else {
        constexpr std::string_view known[] = {"box", "triangle", "gaussian", "mitchell", "sinc"};
        params.warn_or_refuse(params.place(),
                              fmt::format("unknown PixelFilter \"{}\"; {}known are {}", shown(kind),
                                          did_you_mean(kind, known), fmt::join(known, ", ")),
                              "box is used");
        filter.kind = FilterSettings::Kind::box;
        radius = 0.5;
    }
    filter.radius = {read_radius(params, "xradius", "xwidth", radius),
                     read_radius(params, "yradius", "ywidth", radius)};
}

void read_sampler(Reading& reading, const std::string& kind, Params& params) {
    constexpr std::string_view known[] = {
        "02sequence",  "adaptive", "bestcandidate", "halton", "independent", "lowdiscrepancy", "maxmindist",
        "paddedsobol", "pmj02bn",  "random",        "sobol",  "stratified",  "zsobol"};
    if (std::find(std::begin(known), std::end(known), kind) == std::end(known)) {
        reading.monitor.info(
            fmt::format("{}: Sampler \"{}\" is not one of pbrt's; only its number of samples is used",
                        to_string(params.place().location()), shown(kind)));
    }
    params.accept({"dimensions", "jitter", "randomization", "samplepixelcenter", "seed"});
    const auto count = [&](std::string_view name, int fallback) {
        const int value = params.integer(name, fallback);
        const int held = std::clamp(value, 1, 1 << 24);
        if (held != value) {
            params.warn_or_refuse(
                params.place_of(name),
                fmt::format("{}: {} is not accepted; expected 1 to {}", name, value, 1 << 24),
                fmt::format("{} is used", held));
        }
        return held;
    };
    if (params.has("xsamples") || params.has("ysamples")) {
        const auto product = static_cast<std::int64_t>(count("xsamples", 4)) * count("ysamples", 4);
        if (product > 1 << 24) {
            params.warn_or_refuse(
                params.place(),
                fmt::format("xsamples x ysamples is {}; expected at most {}", product, 1 << 24),
                fmt::format("{} is used", 1 << 24));
        }
        reading.draft.spp = static_cast<int>(std::min<std::int64_t>(product, 1 << 24));
    } else if (params.has("samplesperpixel")) {
        reading.draft.spp = count("samplesperpixel", 16);
    } else {
        reading.draft.spp = count("pixelsamples", 16);
    }
}

}  // namespace lucerna
