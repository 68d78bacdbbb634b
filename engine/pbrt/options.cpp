// Camera, film, filter and sampler: what stands before WorldBegin. The integrator has integrator.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

using Type = Param::Type;

void read_screen_window(Reading& reading, Params& params) {
    const Param* window = params.find("screenwindow", {Type::real});
    if (!window) return;
    if (window->numbers.size() != 4) {
        fail(window->place, "\"screenwindow\" has {} numbers; 4 are accepted (x0 x1 y0 y1)",
             window->numbers.size());
    }
    if (!(window->numbers[0] < window->numbers[1] && window->numbers[2] < window->numbers[3])) {
        fail(window->place, "\"screenwindow\" is {:g}; x0 < x1 and y0 < y1 are accepted",
             fmt::join(window->numbers, " "));
    }
    for (std::size_t i = 0; i < 4; ++i)
        reading.draft.camera.screen[i] = static_cast<float>(window->numbers[i]);
}

// One side of the picture, in pixels.
int read_side(Params& params, std::string_view name, int fallback) {
    constexpr int kMost = 1 << 16;
    const int side = params.integer(name, fallback);
    if (side < 1 || side > kMost) {
        fail(params.place_of(name), "{}: {} is not accepted; 1 to {} pixels are", name, side, kMost);
    }
    return side;
}

// Only what covers the whole picture.
void require_full_picture(Params& params, const FilmSettings& film) {
    const std::pair<std::string_view, std::array<double, 4>> windows[] = {
        {"cropwindow", {0, 1, 0, 1}},
        {"pixelbounds", {0, static_cast<double>(film.width), 0, static_cast<double>(film.height)}}};
    for (const auto& [name, full] : windows) {
        const Param* window = params.find(name, {Type::real, Type::integer});
        if (!window) continue;
        if (!std::equal(full.begin(), full.end(), window->numbers.begin(), window->numbers.end())) {
            fail(window->place, "{} {:g} is not supported yet; the whole picture is ({:g})", name,
                 fmt::join(window->numbers, " "), fmt::join(full, " "));
        }
    }
}

// Version 4's camera sensor: exposure time and ISO make one factor; a measured sensor is another matter.
double read_sensor(Params& params) {
    const std::string sensor = params.string("sensor", "cie1931");
    if (sensor != "cie1931") {
        fail(params.place_of("sensor"), "sensor \"{}\" is not supported yet; cie1931 is", shown(sensor));
    }
    if (params.real("whitebalance", 0) != 0) {
        fail(params.place_of("whitebalance"), "\"whitebalance\" is not supported yet; 0 is accepted");
    }
    const double iso = params.real_within("iso", 100, 1e-6, 1e9);
    const double seconds = params.real_within("exposuretime", 1, 1e-9, 1e9);
    return iso * seconds / 100 * params.real_within("imagingratio", 1, 1e-9, 1e9);
}

float read_radius(Params& params, std::string_view v4_name, std::string_view v3_name, double fallback) {
    const std::string_view name = params.has(v3_name) ? v3_name : v4_name;
    if (params.has(v3_name) && params.has(v4_name)) {
        fail(params.place_of(v3_name), "\"{}\" and \"{}\" are two names for one thing; one is accepted",
             v3_name, v4_name);
    }
    // Read under both names, so that either is offered when a third is misspelt.
    params.accept({v3_name, v4_name});
    return static_cast<float>(params.real_within(name, fallback, 1e-3, 100));
}

}  // namespace

void read_camera(Reading& reading, const std::string& kind, Params& params) {
    Camera::Settings& camera = reading.draft.camera;
    if (kind == "perspective") {
        camera.kind = Camera::Settings::Kind::perspective;
        double fov = params.real_within("fov", 90, 1e-3, 179.999);
        if (params.has("halffov")) fov = 2 * params.real_within("halffov", 45, 5e-4, 89.999);
        camera.fov_degrees = static_cast<float>(fov);
    } else if (kind == "orthographic") {
        camera.kind = Camera::Settings::Kind::orthographic;
    } else {
        refuse_kind(params.place(), "Camera", kind, {"perspective", "orthographic"},
                    {"environment", "realistic", "spherical"});
    }
    read_screen_window(reading, params);
    reading.draft.frame_aspect_ratio =
        params.has("frameaspectratio") ? params.real_within("frameaspectratio", 1, 1e-3, 1e3) : 0;
    camera.lens_radius = static_cast<float>(params.real_within("lensradius", 0, 0, 1e30));
    camera.focal_distance = static_cast<float>(params.real_within("focaldistance", 1e6, 1e-30, 1e30));
}

void read_film(Reading& reading, const std::string& kind, Params& params) {
    FilmSettings& film = reading.draft.film;
    const bool version3 = kind == "image";
    if (!version3 && kind != "rgb") {
        refuse_kind(params.place(), "Film", kind, {"rgb", "image"}, {"gbuffer", "spectral"});
    }
    // Each version's own default.
    film.width = read_side(params, "xresolution", version3 ? 640 : 1280);
    film.height = read_side(params, "yresolution", version3 ? 480 : 720);
    film.filename = params.string("filename", FilmSettings{}.filename.string());
    if (film.filename.empty())
        fail(params.place_of("filename"), "\"filename\" is empty; the name of an image is accepted");
    double scale = params.real_within("scale", 1, 1e-30, 1e30);
    if (!version3) scale *= read_sensor(params);
    film.scale = static_cast<float>(scale);
    require_full_picture(params, film);
    params.accept(
        {"savefp16", "diagonal"});  // half floats; the size of a film that only a real lens asks for
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
    } else {
        refuse_kind(params.place(), "PixelFilter", kind, {"box", "triangle", "gaussian"},
                    {"lanczos", "mitchell", "sinc"});
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
    params.accept({"dimensions", "jitter", "randomization", "seed"});
    const auto count = [&](std::string_view name, int fallback) {
        const int value = params.integer(name, fallback);
        if (value < 1 || value > 1 << 24) {
            fail(params.place_of(name), "{}: {} is not accepted; 1 to {} is", name, value, 1 << 24);
        }
        return value;
    };
    if (params.has("xsamples") || params.has("ysamples")) {
        const auto product = static_cast<std::int64_t>(count("xsamples", 4)) * count("ysamples", 4);
        if (product > 1 << 24)
            fail(params.place(), "xsamples x ysamples is {}; at most {} is accepted", product, 1 << 24);
        reading.draft.spp = static_cast<int>(product);
    } else if (params.has("samplesperpixel")) {
        reading.draft.spp = count("samplesperpixel", 16);
    } else {
        reading.draft.spp = count("pixelsamples", 16);
    }
}

}  // namespace lucerna
