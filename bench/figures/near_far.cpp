// Compares a measured lamp with its far field over the distance, for the study `near-far`.
//
// Each lamp lights a plane across its beam, by its coefficients. It is compared with its photometric web (as
// `lucerna light farfield` writes it, but in steps of 0.25 and 2.5 degrees) as a point light, once at the
// centre of S and once at the waist of its light: the place, often virtual, at which its lines are closest
// together. Distances are from the light's place, in sizes of the lamp, the diameter on S that holds 98 % of
// its light. Writes lines
//
//   lamp,size,waist,point,distance,rms,worst,axis
//
// with size and waist (in front of S) in metres, and errors over the square that holds the light: root mean
// square relative to that of the irradiance, the largest relative to the peak, and at the brightest pixel.
// After a line "#" it writes lines
//
//   lamp,size,waist,model,sample_Le,sample_Li,bytes
//
// with CPU seconds per particle and per light sample, and the memory, of the field and the web.
//
// usage: figure_near_far [--quick] LAMP.exr... > near-far.csv
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "bench/figures/figure_main.h"
#include "bench/figures/lamp_emission.h"
#include "lights/measurement/plane_irradiance.h"

namespace {

using namespace lucerna;

struct Effort {
    int distances = 34, pixels = 48;
    double polar_step = 0.25, azimuth_step = 2.5;  // degrees
    std::uint32_t particles = 1U << 20;
};

constexpr double kFirst = 0.5, kLast = 1000;  // sizes

// The origin of a field's light, by the coefficients as measured; negative ones subtract.
struct Origin {
    double size = 0;   // metres
    double waist = 0;  // z at which the lines are closest together
    V2d centre{0, 0};  // of the lines at the waist
};

Origin origin_of(const LightField& field) {
    const Rig& rig = field.rig();
    Origin origin;
    // Moments of positions on S and of slopes, over both axes.
    double weight = 0, deviation = 0, joint = 0;
    V2d at(0, 0), slope(0, 0);
    double at_slope = 0, slope2 = 0;
    std::vector<std::pair<double, double>> reach;  // distance from the centre, flux
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d u(rig.filter(0, m), rig.filter(1, n));
            double view = 0;
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    const double e{field.coefficient(m, n, k, l)};
                    const V2d sensor(rig.shift.x > 0 ? u.x : 0.0, rig.shift.y > 0 ? u.y : 0.0);
                    const V2d s = sensor + V2d((k + 0.5 - 0.5 * rig.pixels.x) * rig.pixel.x,
                                               (l + 0.5 - 0.5 * rig.pixels.y) * rig.pixel.y);
                    const V2d a = (s - u) / rig.distance;
                    view += e;
                    at += e * u;
                    slope += e * a;
                    at_slope += e * u.dot(a);
                    slope2 += e * a.length2();
                }
            }
            weight += view;
            reach.emplace_back(u.length(), std::max(view, 0.0));
        }
    }
    at /= weight, slope /= weight;  // a lamp's flux is positive
    joint = at_slope / weight - at.dot(slope);
    deviation = slope2 / weight - slope.length2();
    origin.waist = deviation > 0 ? -joint / deviation : 0;
    origin.centre = at + origin.waist * slope;
    std::sort(reach.begin(), reach.end());
    double total = 0, sum = 0;
    for (const auto& [distance, flux] : reach) total += flux;
    for (const auto& [distance, flux] : reach) {
        sum += flux;
        if (sum < 0.98 * total) continue;
        origin.size = 2 * distance + 0.5 * (rig.spacing.x + rig.spacing.y);  // plus the width of a filter
        break;
    }
    return origin;
}

// Returns the irradiance of the web as a point light at `from`, over the patch.
std::vector<double> web_irradiance(const PhotometricWeb& web, const V3d& from, const PlanePatch& patch) {
    constexpr int kFine = 4;  // samples per pixel and axis
    std::vector<double> values;
    for (int i = 0; i < patch.pixels.x * patch.pixels.y; ++i) {
        double sum = 0;
        for (int s = 0; s < kFine * kFine; ++s) {
            const double column = i % patch.pixels.x + (s % kFine + 0.5) / kFine;
            const double row = i / patch.pixels.x + (s / kFine + 0.5) / kFine;
            const V3d way =
                V3d(patch.centre.x + (column / patch.pixels.x - 0.5) * patch.size.x,
                    patch.centre.y + (row / patch.pixels.y - 0.5) * patch.size.y, patch.distance) -
                from;
            const double d2 = way.length2();  // > 0, because the plane is in front of the point
            sum += web.intensity(way / std::sqrt(d2)) * way.z / std::sqrt(d2) / d2;
        }
        values.push_back(sum / (kFine * kFine));
    }
    return values;
}

void compare(const std::string& lamp, const LightField& field, const PhotometricWeb& web,
             const Origin& origin, const Effort& effort) {
    Monitor silent;
    const std::array<std::pair<const char*, V3d>, 2> points{
        {{"middle of S", V3d(0, 0, 0)}, {"waist", V3d(origin.centre.x, origin.centre.y, origin.waist)}}};
    for (const auto& [name, point] : points) {
        for (int i = 0; i < effort.distances; ++i) {
            const double sizes =
                kFirst * std::pow(kLast / kFirst, static_cast<double>(i) / (effort.distances - 1));
            const double z = point.z + sizes * origin.size;
            if (!(z > 0)) continue;  // nothing was measured behind S
            const PlaneIrradiance near =
                project(field, frame_light(field, z, effort.pixels, Workers{}, silent), Workers{}, silent);
            const std::vector<double> far = web_irradiance(web, point, near.patch);
            double worst = 0;
            for (std::size_t p = 0; p < far.size(); ++p)
                worst = std::max(worst, std::fabs(far[p] - near.values[p]));
            const auto brightest = static_cast<std::size_t>(
                std::max_element(near.values.begin(), near.values.end()) - near.values.begin());
            fmt::print("{},{:.6g},{:.6g},{},{:.4g},{:.6g},{:.6g},{:.6g}\n", lamp, origin.size, origin.waist,
                       name, sizes, relative_rms(far, near.values), worst / near.peak(),
                       far[brightest] / near.values[brightest] - 1);
        }
    }
}

// Measures CPU seconds per particle, and per light sample at places some sizes away.
void time_light(const std::string& lamp, const Origin& origin, const char* model, const Light& light,
                std::size_t bytes, const Effort& effort) {
    constexpr std::uint32_t kChunk = 512;
    const EmissionNet net(1, Purpose::bench, 0);
    std::vector<LeSampleU> u(kChunk);
    std::vector<std::optional<LeSample>> out(kChunk);
    double sample_Le = 0, sample_Li = 0, sum = 0;
    for (std::uint32_t first = 0; first < effort.particles; first += kChunk) {
        for (std::uint32_t i = 0; i < kChunk; ++i) u[i] = net.at(first + i).u;
        const double begin = cpu_seconds();
        light.sample_Le_many(u, out);
        const double between = cpu_seconds();
        for (std::uint32_t i = 0; i < kChunk; ++i) {
            if (!out[i]) continue;
            const V3f x = out[i]->from.p + static_cast<float>(10 * origin.size) * out[i]->d;
            const auto light_sample = light.sample_Li(x, u[i].position);
            if (light_sample) sum += double{light_sample->weight.x};
        }
        sample_Le += between - begin;
        sample_Li += cpu_seconds() - between;
    }
    fmt::print("{},{:.6g},{:.6g},{},{:.4g},{:.4g},{}\n", lamp, origin.size, origin.waist, model,
               sample_Le / effort.particles, sample_Li / effort.particles, bytes);
    if (!std::isfinite(sum)) fmt::print(stderr, "figure_near_far: {}: light that is not finite\n", lamp);
}

struct Lamp {
    std::string name;
    LightField field;
    Origin origin;
    PhotometricWeb web;
};

void time_both(const Lamp& lamp, const Effort& effort) {
    Monitor silent;
    const CellTable table(lamp.field, Workers{}, silent);
    const auto near = make_measured_light(lamp.field, table, MeasuredSettings{}, silent);
    time_light(lamp.name, lamp.origin, "field", *near, table.bytes() + lamp.field.coefficients().size_bytes(),
               effort);
    const V3f place(static_cast<float>(lamp.origin.centre.x), static_cast<float>(lamp.origin.centre.y),
                    static_cast<float>(lamp.origin.waist));
    PhotometricWeb web = lamp.web;
    web.set_opening({});  // shines from a point
    const auto far =
        make_photometric_light("ies", std::make_shared<const PhotometricWeb>(web), {place, {}}, Rgb(1));
    time_light(lamp.name, lamp.origin, "web", *far, 2 * lamp.web.grid().candela.size() * sizeof(float),
               effort);
}

void run(const std::vector<std::string>& words) {
    Effort effort;
    Monitor silent;
    std::vector<Lamp> lamps;
    for (const std::string& word : words) {
        if (word == "--quick") {
            effort = {3, 12, 5, 45, 1U << 12};
        } else if (!word.empty()) {
            LightField field = read_light_field(word);
            const Origin origin = origin_of(field);
            PhotometricWeb web =
                far_field(field, {effort.polar_step, effort.azimuth_step}, Workers{}, silent);
            lamps.push_back(
                {std::filesystem::path(word).stem().string(), std::move(field), origin, std::move(web)});
        }
    }
    fmt::print("lamp,size,waist,point,distance,rms,worst,axis\n");
    for (const Lamp& lamp : lamps) compare(lamp.name, lamp.field, lamp.web, lamp.origin, effort);
    fmt::print("#\nlamp,size,waist,model,sample_Le,sample_Li,bytes\n");
    for (const Lamp& lamp : lamps) time_both(lamp, effort);
}

}  // namespace

int main(int argc, char** argv) {
    return lucerna::figure_main("figure_near_far", argc, argv, run);
}
