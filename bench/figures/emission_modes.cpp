// Measures the cost and the errors of the modes of emission from a measured lamp, for the study `emission`.
//
// Each lamp, with its negative coefficients set to 0, is emitted in each mode and counted on three planes,
// and compared with the irradiance that its coefficients give there. Writes lines
//
//   lamp,coefficients,table_bytes,mode,rate,plane,bias2,bias2_error,noise2,particles
//
// with the rate in particles per second of one thread's CPU time, the plane's distance in units of M's, bias²
// (and its standard error) and noise² relative to the mean square of the irradiance, and the number of
// particles that the noise belongs to.
//
// usage: figure_emission_modes [--quick] LAMP.exr... > emission.csv
#include <fmt/core.h>

#include <filesystem>
#include <string>

#include "bench/figures/figure_main.h"
#include "bench/figures/lamp_emission.h"

namespace {

using namespace lucerna;

constexpr std::array<double, 3> kPlanes{0.05, 0.5, 10};
constexpr int kPixels = 64;

void measure(const std::filesystem::path& file, const Particles& particles) {
    Monitor silent;
    const LightField field = without_negative(read_light_field(file));
    const CellTable table(field, Workers{}, silent);
    std::vector<PlaneIrradiance> truths;
    for (const double plane : kPlanes) {
        const double distance = plane * field.rig().distance;
        truths.push_back(
            project(field, frame_light(field, distance, kPixels, Workers{}, silent), Workers{}, silent));
    }
    for (const auto& [mode, name] : kEmissionModes) {
        MeasuredSettings settings;
        settings.file = file;
        settings.mode = mode;
        settings.world_from_light.translate(-field.rig().centre);  // puts S at z = 0, as for project()
        const auto light = make_measured_light(field, table, settings, silent);
        const EmissionMeasured measured = measure_emission(*light, truths, particles);
        for (std::size_t i = 0; i < truths.size(); ++i) {
            fmt::print("{},{},{},{},{:.4g},{:g},{:.6g},{:.3g},{:.6g},{}\n", file.stem().string(),
                       field.rig().coefficients(), table.bytes(), name, measured.particles_per_second,
                       kPlanes[i], measured.planes[i].bias2, measured.planes[i].bias2_error,
                       measured.planes[i].noise2, particles.in_batch);
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    return figure_main("figure_emission_modes", argc, argv, [](const std::vector<std::string>& words) {
        Particles particles;
        fmt::print("lamp,coefficients,table_bytes,mode,rate,plane,bias2,bias2_error,noise2,particles\n");
        for (const std::string& word : words) {
            if (word == "--quick")
                particles = {4, 1U << 12};
            else if (!word.empty())
                measure(word, particles);
        }
    });
}
