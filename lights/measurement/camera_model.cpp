#include "lights/measurement/camera_model.h"

#include <algorithm>

namespace lucerna {
namespace {

constexpr int kMostExposures = 32;
constexpr int kMostPhotograph = 32768;  // pixels on a side

std::vector<double> read_exposures(const TomlTable& table) {
    std::vector<double> times = table.numbers("exposures", 1e-9, 1e6);
    if (times.empty() || times.size() > kMostExposures) {
        input_error(table.place_of("exposures"), "\"exposures\" has {} values; 1 to {} are accepted",
                    times.size(), kMostExposures);
    }
    for (std::size_t i = 1; i < times.size(); ++i) {
        if (times[i] > times[i - 1]) continue;
        input_error(table.place_of("exposures"),
                    "\"exposures\" has {:g} s after {:g} s; times that rise are accepted", times[i],
                    times[i - 1]);
    }
    return times;
}

int read_bits(const TomlTable& table, int fallback) {
    const int bits = table.whole("bits", 8, 32, fallback);
    if (bits > 16 && bits != 32) {
        input_error(table.place_of("bits"), "\"bits\" of {} is not accepted; 8 to 16, or 32 for floats, are",
                    bits);
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
