// Compares light fields measured with and without the optical filter, and reconstructed exactly or
// approximately, with the lamp itself, for docs/results/results.md.
//
// Two lamps of fine structure, an LED chip under metal fingers and a projector whose slide has fine lines,
// are measured on the virtual bench at increasing numbers of views: behind the filter, and without it as a
// canned light source [Heidrich 1998] at the same positions and pixels. The irradiance that each casts at S,
// at 10 mm and at 1 m is compared with the lamp's own, computed by quadrature without any light field. Writes
// lines "error,lamp,distance,views,kind,rms" (relative to the rms of the irradiance) and pictures,
// "picture,lamp,kind,row,column,value".
//
// usage: canned > canned.csv
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "bench/figures/figure_main.h"
#include "engine/base/parallel.h"
#include "lights/gauss.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/plane_irradiance.h"

namespace {

using namespace lucerna;

constexpr int kSide = 64;         // pixels of a plane
constexpr int kPictureViews = 9;  // views of the pictures

struct Lamp {
    std::string name;
    EmitterModel emitter;
    V2i pixels;
    double distance;        // from S to M [m]
    double half_s, half_m;  // [m]
    double at[3];           // distances of the planes [m]
    double half_plane[3];   // [m]
    int s_nodes;            // of the acquisition
    int pictured;           // the plane that the pictures show
};

Lamp chip() {
    constexpr double kHalf = 1e-3, kPitch = 0.25e-3, kFinger = 0.06e-3, kEdge = 0.03e-3;
    const auto fingers = [](const V2d& p) {
        const double at = std::fabs(std::remainder(p.x * kHalf, kPitch));
        const double beside = std::clamp((at - 0.5 * kFinger) / kEdge + 0.5, 0.0, 1.0);
        return 0.05 + 0.95 * beside * beside * (3 - 2 * beside);
    };
    return {"chip",
            cosine_emitter(EmitterModel::Outline::rectangle, {kHalf, kHalf}, 1, 1, fingers),
            {48, 48},
            10e-3,
            kHalf,
            25e-3,
            {0, 10e-3, 1},
            {1.2e-3, 10e-3, 1},
            5,
            0};
}

Lamp projector() {
    constexpr int kTexels = 240;
    Image slide = Image::rgb(kTexels, kTexels);
    for (int y = 0; y < kTexels; ++y) {
        for (int x = 0; x < kTexels; ++x) {
            const int period = x < kTexels / 2 ? 24 : 12;  // 20 texels per millimetre
            slide.set_rgb(x, y, Rgb(x % period < period / 2 && y > 20 && y < 220 ? 1.0F : 0.0F));
        }
    }
    Projector lens;
    lens.aperture = 5e-3;
    lens.focal_length = 20e-3;
    lens.focus = 1;
    lens.slide_size = {12e-3, 12e-3};
    lens.flux = 1;
    return {"projector",
            projector_emitter(lens, slide),
            {96, 96},
            40e-3,
            5e-3,
            18e-3,
            {0, 10e-3, 1},
            {6e-3, 8e-3, 0.32},
            2,
            2};
}

Rig rig_of(const Lamp& lamp, int views) {
    Rig rig;
    rig.views = {views, views};
    rig.spacing = V2d(2 * lamp.half_s / (views - 3));  // one filter beyond the emitter's edge on each side
    rig.pixels = lamp.pixels;
    for (int a = 0; a < 2; ++a) rig.pixel[a] = 2 * lamp.half_m / lamp.pixels[a];
    rig.distance = lamp.distance;
    return rig;
}

// Returns the irradiance of the light that passes M.
double lamp_irradiance(const Lamp& lamp, const V3d& x) {
    constexpr int kSteps = 160;
    const EmitterModel& emitter = lamp.emitter;
    const bool disc = emitter.outline == EmitterModel::Outline::disc;
    double sum = 0;
    const double half = x.z == 0 ? lamp.half_m : emitter.half_size.x;
    for (int i = 0; i < kSteps * kSteps; ++i) {
        const V2d at(half * (2 * (i % kSteps + 0.5) / kSteps - 1),
                     half * (2 * (static_cast<double>(i / kSteps) + 0.5) / kSteps - 1));
        // The ray passes S at `p` towards M at `m`.
        const V2d p = x.z == 0 ? V2d(x.x, x.y) : at;
        const V2d m = x.z == 0 ? at : p + (V2d(x.x, x.y) - p) * (lamp.distance / x.z);
        if (std::max(std::fabs(m.x), std::fabs(m.y)) > lamp.half_m) continue;
        if (disc ? p.length() > emitter.half_size.x
                 : std::max(std::fabs(p.x), std::fabs(p.y)) > emitter.half_size.x)
            continue;
        const double z = x.z == 0 ? lamp.distance : x.z;
        const V3d way = x.z == 0 ? V3d(m.x - p.x, m.y - p.y, z) : V3d(x.x - p.x, x.y - p.y, z);
        const double r2 = way.length2();  // > 0, because z is
        sum += emitter.radiance(p, way.normalized()) * sqr(z) / sqr(r2);
    }
    return sum * sqr(2 * half / kSteps);
}

std::vector<double> reference(const Lamp& lamp, const PlanePatch& patch, const Workers& workers) {
    std::vector<double> values(kSide * kSide);
    parallel_chunks(workers, kSide, [&](std::int64_t y) {
        for (int x = 0; x < kSide; ++x) {
            constexpr int kFine = 3;  // points per pixel along each axis
            double sum = 0;
            for (int i = 0; i < kFine * kFine; ++i) {
                const V2d at((x + (i % kFine + 0.5) / kFine) / kSide - 0.5,
                             (static_cast<double>(y) + (i / kFine + 0.5) / kFine) / kSide - 0.5);
                sum += lamp_irradiance(lamp, {at.x * patch.size.x, at.y * patch.size.y, patch.distance});
            }
            values[static_cast<std::size_t>(y * kSide + x)] = sum / (kFine * kFine);
        }
    });
    return values;
}

double rms(const std::vector<double>& values, const std::vector<double>& truth) {
    double difference = 0, all = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        difference += sqr(values[i] - truth[i]);
        all += sqr(truth[i]);
    }
    return std::sqrt(difference / all);  // the plane has light
}

void print_picture(const Lamp& lamp, const char* kind, const std::vector<double>& values) {
    for (int i = 0; i < kSide * kSide; ++i) {
        fmt::print("picture,{},{},{},{},{:.6g}\n", lamp.name, kind, i / kSide, i % kSide,
                   values[static_cast<std::size_t>(i)]);
    }
}

void measure(const Lamp& lamp) {
    Monitor silent;
    const Workers workers;
    std::vector<PlanePatch> patches;
    std::vector<std::vector<double>> truths;
    for (int i = 0; i < 3; ++i) {
        patches.push_back({lamp.at[i], {0, 0}, V2d(2 * lamp.half_plane[i]), {kSide, kSide}});
        truths.push_back(reference(lamp, patches.back(), workers));
    }
    print_picture(lamp, "lamp", truths[static_cast<std::size_t>(lamp.pictured)]);
    for (const int views : {5, 7, 9, 13, 17, 25, 33}) {
        const Rig rig = rig_of(lamp, views);
        const AcquireOptions options{lamp.s_nodes, 2};
        const LightField filtered = acquire(lamp.emitter, rig, workers, silent, options);
        const LightField canned = acquire_without_filter(lamp.emitter, rig, workers, silent, options);
        for (int i = 0; i < 3; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const auto compare = [&](const char* kind, const LightField& field, Reconstruction by) {
                const PlaneIrradiance plane = project(field, patches[at], workers, silent, by);
                fmt::print("error,{},{:g},{},{},{:.5g}\n", lamp.name, lamp.at[i], views, kind,
                           rms(plane.values, truths[at]));
                if (views == kPictureViews && i == lamp.pictured) print_picture(lamp, kind, plane.values);
            };
            compare("filtered", filtered, Reconstruction::exact);
            compare("approximate", filtered, Reconstruction::approximate);
            compare("canned", canned, Reconstruction::exact);
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    return figure_main("canned", argc, argv, [](const std::vector<std::string>& /*words*/) {
        measure(chip());
        measure(projector());
    });
}
