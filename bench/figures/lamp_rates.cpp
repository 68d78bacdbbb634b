// Measures how fast a light field and a list of rays light a plane, for `lamp_compression.py`.
//
// The planes are at contact, a hundredth of the width of S in front of it, and at 1 m, each a square around
// the light in 48 x 48 pixels. Particles are counted into the pixels; direct light is estimated at the
// pixels' centres by directions towards the lamp, which a list of rays does not have. Writes the line
//
//   rate particles_contact particles_1m direct_contact direct_1m
//
// with the rate in particles per second of one thread's CPU time, and otherwise the CPU seconds after which
// the error of all pixels, root mean square relative to that of the irradiance, is 1 %: variance times time.
//
// usage: figure_lamp_rates LAMP.exr [RAYS]      with RAYS, their list is measured in the frame of the lamp
#include <fmt/core.h>

#include <stdexcept>
#include <string>

#include "bench/figures/figure_main.h"
#include "bench/figures/lamp_emission.h"
#include "lights/ray_set.h"

namespace {

using namespace lucerna;

constexpr int kPixels = 48;
constexpr double kError = 0.01;

// Returns the seconds of variance times time for direct light at the pixels' centres.
double direct_seconds(const Light& light, const PlanePatch& patch) {
    constexpr int kSamples = 64;
    double variance = 0, square = 0;
    const double begin = cpu_seconds();
    for (int y = 0; y < kPixels; ++y) {
        for (int x = 0; x < kPixels; ++x) {
            const V3f point(static_cast<float>(patch.centre.x + ((x + 0.5) / kPixels - 0.5) * patch.size.x),
                            static_cast<float>(patch.centre.y + ((y + 0.5) / kPixels - 0.5) * patch.size.y),
                            static_cast<float>(patch.distance));
            Sampler numbers(1, Purpose::bench, 0, static_cast<std::uint64_t>(y * kPixels + x));
            double sum = 0, sum2 = 0;
            for (int i = 0; i < kSamples; ++i) {
                const auto sample = light.sample_Li(point, numbers.next2());
                // The plane faces the lamp, which is towards -z.
                const double e =
                    sample ? double{luminance(sample->weight)} * std::max(0.0, -double{sample->w.z}) : 0.0;
                sum += e;
                sum2 += e * e;
            }
            const double mean = sum / kSamples,
                         spread = (sum2 / kSamples - mean * mean) * kSamples / (kSamples - 1);
            variance += spread;
            square += mean * mean - spread / kSamples;
        }
    }
    const double each = (cpu_seconds() - begin) / kSamples;  // of one sample in every pixel
    return variance / square * each / (kError * kError);
}

void run(const std::vector<std::string>& words) {
    if (words.empty() || words.size() > 2) throw std::runtime_error("LAMP.exr [RAYS] are needed");
    Monitor silent;
    const LightField field = read_light_field(words[0]);
    const Rig& rig = field.rig();
    M44d world_from_light;
    world_from_light.translate(-rig.centre);  // puts S at z = 0, as for project()
    const double width = 2 * rig.interval_edge(0, rig.intervals(0));
    std::vector<PlaneIrradiance> truths;
    for (const double distance : {0.01 * width, 1.0}) {
        truths.push_back(
            project(field, frame_light(field, distance, kPixels, Workers{}, silent), Workers{}, silent));
    }

    std::unique_ptr<Light> light;
    if (words.size() == 1) {
        MeasuredSettings settings;
        settings.file = words[0];
        settings.world_from_light = world_from_light;
        light = make_measured_light(field, CellTable(field, Workers{}, silent), settings, silent);
    } else {
        RayLightSettings settings;
        settings.file = words[1];
        settings.world_from_light = world_from_light;
        light = make_ray_light(settings, silent);
    }
    const Particles particles{16, 1U << 16};
    const EmissionMeasured measured = measure_emission(*light, truths, particles);
    fmt::print("{:.4g}", measured.particles_per_second);
    for (const PlaneErrors& plane : measured.planes) {
        fmt::print(" {:.4g}",
                   plane.noise2 * particles.in_batch / measured.particles_per_second / (kError * kError));
    }
    for (const PlaneIrradiance& truth : truths) {
        if (light->only_particles())
            fmt::print(" nan");
        else
            fmt::print(" {:.4g}", direct_seconds(*light, truth.patch));
    }
    fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
    return figure_main("figure_lamp_rates", argc, argv, run);
}
