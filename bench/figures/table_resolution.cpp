// Measures the effect of the resolution of a lamp's field and table, for the study `table`.
//
// A disc whose intensity falls off as cos^20 is measured with increasing numbers of views and pixels. Each
// field is emitted in each mode and counted on three planes, and compared with the irradiance of the disc
// itself. Writes lines
//
//   views,pixels,cells,field_bytes,table_bytes,build_seconds,mode,rate,plane,bias2,bias2_error,noise2,particles
//
// with the CPU time of building the table as build_seconds, and the rest as in emission_modes.cpp.
//
// usage: figure_table_resolution [--quick] > table.csv
#include <fmt/core.h>

#include <string>

#include "bench/figures/figure_main.h"
#include "bench/figures/lamp_emission.h"
#include "lights/gauss.h"
#include "lights/measurement/acquire.h"

namespace {

using namespace lucerna;

constexpr double kRadius = 0.025, kDistance = 0.25, kExponent = 20, kFlux = 1000;  // m, m, 1, W
constexpr std::array<double, 3> kPlanes{0.05, 0.5, 10};
constexpr int kPixels = 64;

struct Resolution {
    int views, pixels;
};

// Returns the rig that `lucerna light acquire` would choose: one filter beyond the edge on every side, and M
// wide enough for 98 % of the flux.
Rig rig_of(const Resolution& resolution) {
    Rig rig;
    rig.views = {resolution.views, resolution.views};
    rig.pixels = {resolution.pixels, resolution.pixels};
    rig.distance = kDistance;
    const double cosine = std::pow(0.02, 1 / (kExponent + 1));
    const double half = kRadius + kDistance * std::sqrt(1 - cosine * cosine) / cosine;
    rig.spacing = V2d(2 * kRadius / (resolution.views - 3));
    rig.pixel = V2d(2 * half / resolution.pixels);
    return rig;
}

// Returns the disc's irradiance at a point of a plane that faces it, by summation over rings and sectors,
// with the radiance of cosine_emitter.
double disc_irradiance(double x, double y, double z) {
    constexpr int kSectors = 96, kRings = 24;
    const double peak = kFlux * (kExponent + 1) / (2 * kPiD);  // W/sr
    double sum = 0;
    for (int ring = 0; ring < kRings; ++ring) {
        const double radius = kRadius * std::sqrt((ring + 0.5) / kRings);  // rings of equal areas
        for (int sector = 0; sector < kSectors; ++sector) {
            const double angle = 2 * kPiD * (sector + 0.5 * (ring % 2)) / kSectors;
            const double dx = x - radius * std::cos(angle), dy = y - radius * std::sin(angle);
            const double d2 = dx * dx + dy * dy + z * z;
            const double cosine = z / std::sqrt(d2);
            sum += std::pow(cosine, kExponent + 1) / d2;
        }
    }
    return peak * sum / (kRings * kSectors);
}

PlaneIrradiance truth_on(const PlanePatch& patch) {
    constexpr int kFine = 4;  // samples per pixel and axis
    PlaneIrradiance truth{patch, {}};
    for (int i = 0; i < patch.pixels.x * patch.pixels.y; ++i) {
        double sum = 0;
        for (int s = 0; s < kFine * kFine; ++s) {
            const double column = i % patch.pixels.x + (s % kFine + 0.5) / kFine;
            const double row = i / patch.pixels.x + (s / kFine + 0.5) / kFine;
            sum += disc_irradiance((column / patch.pixels.x - 0.5) * patch.size.x,
                                   (row / patch.pixels.y - 0.5) * patch.size.y, patch.distance);
        }
        truth.values.push_back(sum / (kFine * kFine));
    }
    return truth;
}

// Returns the irradiance over squares as wide as the disc and its beam within half of the peak intensity.
std::vector<PlaneIrradiance> truths_on(int pixels) {
    const double cosine = std::pow(0.5, 1 / kExponent), tangent = std::sqrt(1 - cosine * cosine) / cosine;
    std::vector<PlaneIrradiance> truths;
    for (const double plane : kPlanes) {
        const double distance = plane * kDistance, side = 2 * (1.2 * kRadius + distance * tangent);
        truths.push_back(truth_on({distance, {0, 0}, {side, side}, {pixels, pixels}}));
    }
    return truths;
}

void measure(const Resolution& resolution, std::span<const PlaneIrradiance> truths,
             const Particles& particles) {
    Monitor silent;
    const V2d half(kRadius, kRadius);
    const LightField field = acquire(cosine_emitter(EmitterModel::Outline::disc, half, kFlux, kExponent),
                                     rig_of(resolution), Workers{}, silent, AcquireOptions{2, 2, nullptr});
    const double begin = cpu_seconds();
    const CellTable table(field, Workers{}, silent);
    const double build = cpu_seconds() - begin;
    for (const auto& [mode, name] : kEmissionModes) {
        MeasuredSettings settings;
        settings.mode = mode;
        const auto light = make_measured_light(field, table, settings, silent);
        const EmissionMeasured measured = measure_emission(*light, truths, particles);
        for (std::size_t i = 0; i < truths.size(); ++i) {
            fmt::print("{},{},{},{},{},{:.4g},{},{:.4g},{:g},{:.6g},{:.3g},{:.6g},{}\n", resolution.views,
                       resolution.pixels, table.cells(), field.coefficients().size_bytes(), table.bytes(),
                       build, name, measured.particles_per_second, kPlanes[i], measured.planes[i].bias2,
                       measured.planes[i].bias2_error, measured.planes[i].noise2, particles.in_batch);
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    return figure_main("figure_table_resolution", argc, argv, [](const std::vector<std::string>& words) {
        const bool quick = !words.empty() && words[0] == "--quick";
        const Particles particles = quick ? Particles{4, 1U << 12} : Particles{};
        const std::vector<Resolution> resolutions =
            quick ? std::vector<Resolution>{{5, 8}, {6, 12}}
                  : std::vector<Resolution>{{5, 12}, {7, 24}, {11, 48}, {19, 64}, {35, 96}};
        const std::vector<PlaneIrradiance> truths = truths_on(quick ? 12 : kPixels);
        fmt::print(
            "views,pixels,cells,field_bytes,table_bytes,build_seconds,mode,rate,plane,bias2,bias2_error,"
            "noise2,"
            "particles\n");
        for (const Resolution& resolution : resolutions) measure(resolution, truths, particles);
    });
}
