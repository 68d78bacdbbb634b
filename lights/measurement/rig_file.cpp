#include "lights/measurement/rig_file.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/system/hash.h"
#include "engine/text/units.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr int kMostViews = 4096;       // per side
constexpr int kMostRigPixels = 16384;  // per side
constexpr double kLeastFlux = 1e-9, kMostFlux = 1e12;

// Names two keys for the same lengths, exactly one of which must be given.
struct Either {
    const char* direct;
    const char* derived;
};

V2d one_of(const TomlTable& table, const Either& names, const V2d& parts) {
    const bool direct = table.has(names.direct), derived = table.has(names.derived);
    if (direct && derived) {
        input_error(table.place_of(names.derived), "\"{}\" and \"{}\" exclude each other; use one of them",
                    names.derived, names.direct);
    }
    if (!direct && !derived)
        input_error(table.place(), "[rig] lacks \"{}\" or \"{}\"", names.direct, names.derived);
    if (direct) return table.lengths(names.direct);
    const V2d whole = table.lengths(names.derived);
    return {whole.x / parts.x, whole.y / parts.y};  // parts >= 1
}

// In Setup A the sensor moves with the filter, by an integer number of pixels from view to view.
void derive_shift(const TomlTable& table, Rig& rig) {
    const char* key = table.has("spacing") ? "spacing" : "filter";
    const double times = table.has("spacing") ? 1 : 4;  // a filter is four spacings wide
    for (int axis = 0; axis < 2; ++axis) {
        const double pixels = rig.spacing[axis] / rig.pixel[axis];  // both > 0
        const double whole = std::round(pixels);
        if (whole >= 1 && whole <= 65535 && std::fabs(pixels - whole) <= 1e-5 * whole) {
            rig.shift[axis] = static_cast<int>(whole);
            rig.spacing[axis] = whole * rig.pixel[axis];
            continue;
        }
        const double below = std::max(1.0, std::floor(pixels));
        input_error(table.place_of(key),
                    "\"{}\" of {} is {:.6g} pixels of {} per view; Setup A needs a whole number: the nearest "
                    "are {} and {}",
                    key, length_text(times * rig.spacing[axis]), pixels, length_text(rig.pixel[axis]),
                    length_text(times * below * rig.pixel[axis]),
                    length_text(times * (below + 1) * rig.pixel[axis]));
    }
}

void read_course(const TomlTable& table, EmitterDescription& emitter) {
    emitter.exponent = table.number("exponent", 1, 1000, 1.0);
    if (table.has("rim_colour")) emitter.rim_colour = read_colour(table, "rim_colour");
    if (table.has("grazing_colour")) emitter.grazing_colour = read_colour(table, "grazing_colour");
}

void read_disc(const TomlTable& table, EmitterDescription& emitter) {
    const double radius = table.length("radius");
    emitter.half_size = {radius, radius};
    read_course(table, emitter);
}

void read_rectangle(const TomlTable& table, EmitterDescription& emitter) {
    emitter.half_size = table.lengths("size") * 0.5;
    read_course(table, emitter);
}

void read_projector(const TomlTable& table, EmitterDescription& emitter) {
    const double radius = 0.5 * table.length("aperture");
    emitter.half_size = {radius, radius};
    emitter.focal_length = table.length("focal_length");
    emitter.focus = table.length("focus");
    if (!(emitter.focus > emitter.focal_length)) {
        input_error(table.place_of("focus"),
                    "\"focus\" of {} is not beyond the focal length of {}; expected a greater distance",
                    length_text(emitter.focus), length_text(emitter.focal_length));
    }
    emitter.slide = table.path("slide");
    emitter.slide_size = table.lengths("slide_size");
    emitter.inverted = table.flag("inverted", false);
}

void read_scene(const TomlTable& table, EmitterDescription& emitter) {
    emitter.scene = table.path("file");
    constexpr int kMostEmittedRays = 2'000'000'000, kMostSeed = 2147483647;
    emitter.rays = table.whole("rays", 1, kMostEmittedRays, static_cast<int>(emitter.rays));
    emitter.seed = static_cast<std::uint64_t>(table.whole("seed", 0, kMostSeed, 0));
}

EmitterDescription read_emitter(const TomlTable& table) {
    using Kind = EmitterDescription::Kind;
    EmitterDescription emitter;
    const std::string kind = table.choice("kind", {"disc", "rectangle", "projector", "scene"});
    emitter.kind = kind == "disc"        ? Kind::disc
                   : kind == "rectangle" ? Kind::rectangle
                   : kind == "projector" ? Kind::projector
                                         : Kind::scene;
    emitter.setback = table.position("setback", 0.0);
    if (emitter.setback < 0 && emitter.kind != Kind::scene) {
        throw InputError(table.place_of("setback"),
                         "the lamp cannot be in front of the sampling plane; expected 0 or more");
    }
    emitter.unit = table.choice("unit", {"lm", "W"}, "lm") == "lm" ? FluxUnit::lumen : FluxUnit::watt;
    if (emitter.kind == Kind::scene) {
        emitter.flux = table.has("flux") ? table.number("flux", kLeastFlux, kMostFlux) : 0;
    } else {
        emitter.flux = table.number("flux", kLeastFlux, kMostFlux);
    }
    if (emitter.kind != Kind::scene) emitter.colour = read_colour(table);  // a scene's lights have their own
    if (emitter.kind == Kind::disc) read_disc(table, emitter);
    if (emitter.kind == Kind::rectangle) read_rectangle(table, emitter);
    if (emitter.kind == Kind::projector) read_projector(table, emitter);
    if (emitter.kind == Kind::scene) read_scene(table, emitter);
    table.done();
    return emitter;
}

AcquireOptions read_quality(const TomlTable& table) {
    AcquireOptions options;
    options.s_nodes = table.whole("s_nodes", 1, kMaxGauss, options.s_nodes);
    options.m_nodes = table.whole("m_nodes", 1, kMaxGauss, options.m_nodes);
    table.done();
    return options;
}

}  // namespace

Rig read_planes(const TomlTable& table) {
    Rig rig;
    const std::string setup = table.choice("setup", {"A", "B"});
    rig.views = table.wholes("views", 1, kMostViews);
    rig.pixels = table.wholes("pixels", 1, kMostRigPixels);
    rig.spacing = one_of(table, {"spacing", "filter"}, {4, 4});
    const V2d pixels(rig.pixels.x, rig.pixels.y);
    rig.pixel = one_of(table, {"pixel", setup == "A" ? "sensor" : "screen"}, pixels);
    rig.distance = table.length("distance");
    if (setup == "A") derive_shift(table, rig);
    if (const std::string fault = rig.fault(); !fault.empty())
        throw InputError(table.place(), "[rig]: " + fault);
    table.done();
    return rig;
}

Rgb read_colour(const TomlTable& table, std::string_view key) {
    if (!table.has(key)) return Rgb(1.0F);
    const std::vector<double> parts = table.numbers(key, 0, 1e6);
    if (parts.size() != 3) {
        input_error(table.place_of(key), "\"{}\" has {} values; expected red, green and blue", key,
                    parts.size());
    }
    const Rgb colour(static_cast<float>(parts[0]), static_cast<float>(parts[1]),
                     static_cast<float>(parts[2]));
    if (!(luminance(colour) > 1e-6F)) input_error(table.place_of(key), "\"{}\" is black", key);
    return colour / luminance(colour);  // the luminance is above 1e-6
}

RigDescription read_rig(const TomlTable& table) {
    RigDescription description;
    description.rig = read_planes(table.table("rig"));
    description.emitter = read_emitter(table.table("emitter"));
    description.rig.centre.z = description.emitter.setback;  // the lamp is the origin
    if (table.has("quality")) description.quality = read_quality(table.table("quality"));
    if (table.has("camera")) description.camera = read_camera(table.table("camera"));
    table.done();
    return description;
}

RigDescription read_rig_file(const std::filesystem::path& file) {
    return read_rig(TomlTable::read(file));
}

void add(WordHash& hash, const Rig& rig) {
    add_planes(hash, rig);
    for (int c = 0; c < 3; ++c) hash.add(rig.centre[c]);
}

std::uint64_t description_key(const RigDescription& description) {
    WordHash key;
    const EmitterDescription& emitter = description.emitter;
    add(key, description.rig);
    for (int axis = 0; axis < 2; ++axis) {
        key.add(emitter.half_size[axis]);
        key.add(emitter.slide_size[axis]);
    }
    for (int c = 0; c < 3; ++c) key.add(emitter.colour[c]);
    const auto add_colour = [&key](int number, const std::optional<Rgb>& colour) {
        if (!colour) return;
        key.add(number);
        for (int c = 0; c < 3; ++c) key.add((*colour)[c]);
    };
    add_colour(1, emitter.rim_colour);
    add_colour(2, emitter.grazing_colour);
    for (const double x :
         {emitter.setback, emitter.flux, emitter.exponent, emitter.focal_length, emitter.focus})
        key.add(x);
    key.add(static_cast<int>(emitter.kind));
    key.add(static_cast<int>(emitter.unit));
    key.add(static_cast<int>(emitter.inverted));
    key.add(emitter.slide.string());
    key.add(emitter.scene.string());
    key.add(static_cast<std::uint64_t>(emitter.rays));
    key.add(emitter.seed);
    key.add(description.quality.s_nodes);
    key.add(description.quality.m_nodes);
    return key.value();
}

namespace {

constexpr int kMostExposures = 32;
constexpr int kMostPhotograph = 32768;  // pixels on a side

std::vector<double> read_exposures(const TomlTable& table) {
    std::vector<double> times = table.numbers("exposures", 1e-9, 1e6);
    if (times.empty() || times.size() > kMostExposures) {
        input_error(table.place_of("exposures"), "\"exposures\" has {} values; expected 1 to {}",
                    times.size(), kMostExposures);
    }
    for (std::size_t i = 1; i < times.size(); ++i) {
        if (times[i] > times[i - 1]) continue;
        input_error(table.place_of("exposures"),
                    "\"exposures\" has {:g} s after {:g} s; expected ascending times", times[i],
                    times[i - 1]);
    }
    return times;
}

int read_bits(const TomlTable& table, int fallback) {
    const int bits = table.whole("bits", 8, 32, fallback);
    if (bits > 16 && bits != 32) {
        input_error(table.place_of("bits"),
                    "\"bits\" of {} is not accepted; expected 8 to 16, or 32 for floats", bits);
    }
    return bits;
}

}  // namespace

CameraModel read_camera(const TomlTable& table) {
    CameraModel camera;
    if (table.has("exposures")) camera.exposures = read_exposures(table);
    camera.bits = read_bits(table, camera.bits);
    camera.full_well = table.number("full_well", 1, 1e9, camera.full_well);
    camera.read_noise = table.number("read_noise", 0, 1e6, camera.read_noise);
    camera.shot_noise = table.flag("shot_noise", camera.shot_noise);
    camera.dark_current = table.number("dark_current", 0, 1e9, camera.dark_current);
    camera.hot_pixels = table.number("hot_pixels", 0, 1, camera.hot_pixels);
    camera.hot_factor = table.number("hot_factor", 1, 1e9, camera.hot_factor);
    camera.sensitivity = table.number("sensitivity", 0, 1e30, camera.sensitivity);
    camera.fill = table.number("fill", 1e-6, 1, camera.fill);
    constexpr int kMostSeed = 2147483647;
    camera.seed = static_cast<std::uint64_t>(table.whole("seed", 0, kMostSeed, 1));
    camera.oversampling = table.wholes("oversampling", 1, 64, camera.oversampling);
    camera.margin = table.wholes("margin", 0, 4096, camera.margin);
    for (int axis = 0; axis < 3; ++axis) {
        const char* names[] = {"x", "y", "z"};
        camera.place[axis] = table.position(names[axis], 0.0);
    }
    camera.photograph = table.wholes("photograph", 1, kMostPhotograph, camera.photograph);
    if (table.has("pedestal")) camera.pedestal = table.number("pedestal", 0, 65535);
    camera.darks = table.whole("darks", 0, 1000, camera.darks);
    camera.format = camera.bits == 32 ? table.choice("format", {"exr"}, "exr")
                                      : table.choice("format", {"png", "tiff"}, "png");
    table.done();
    return camera;
}

}  // namespace lucerna
