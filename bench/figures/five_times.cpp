// Measures the near-field error of a far-field lamp (the five-times rule), for
// docs/explanation/near-and-far.md.
//
// Three lamps light a square surface that faces them and is as wide as it is distant. Each is evaluated as it
// is and with its far-field intensities, from a point and from an evenly bright disc of its size, and these
// are compared over the distance in sizes of the lamp. For the Lambertian disc the latter is exact. Writes
// lines "lamp,distance,axis,rms,worst" with relative errors: on the axis (or at the surface's centre), root
// mean square over the surface relative to the mean, and the largest relative to the peak.
//
// usage: five_times LED.tm25ray|- > five-times.csv
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "lights/gauss.h"
#include "lights/measurement/plane_irradiance.h"

namespace {

using namespace lucerna;

constexpr int kDistances = 49;
constexpr double kFirst = 0.5, kLast = 20;  // sizes
constexpr const char* kOpening = " (opening)";

// Irradiance at (x, y) on the plane at distance z, for a lamp of size 1.
struct Compared {
    std::string name;
    std::function<double(double x, double y, double z)> near, far;
    // That of an evenly bright disc with the lamp's far field; none where it is `near`.
    std::function<double(double x, double y, double z)> opening = {};
    int pixels = 41;
};

// Returns the irradiance of a Lambertian disc of radiance 1 in closed form, the form factor of a parallel
// disc.
double disc_irradiance(double x, double y, double z) {
    const double r2 = x * x + y * y, z2 = z * z, a2 = 0.25;
    const double sum = z2 + r2 + a2;
    return M_PI / 2 * (1 - (z2 + r2 - a2) / std::sqrt(sum * sum - 4 * r2 * a2));
}

double point_irradiance(double x, double y, double z, const std::function<double(double cosine)>& intensity) {
    const double d2 = x * x + y * y + z * z;
    const double cosine = z / std::sqrt(d2);
    return intensity(cosine) * cosine / d2;
}

Compared disc() {
    return {"Lambertian disc", disc_irradiance, [](double x, double y, double z) {
                return point_irradiance(x, y, z, [](double cosine) { return M_PI / 4 * cosine; });
            }};
}

// Three round emitters in a triangle, each with a beam of cos^m; together they fill a circle of diameter 1.
struct Trio {
    static constexpr double kRadius = 0.12, kRing = 0.5 - kRadius, kExponent = 60;

    static double intensity(double cosine) { return 3 * std::pow(cosine, kExponent); }
    static double near(double x, double y, double z) {
        // Sums over rings and sectors of each emitter; its light is smooth, so few are needed.
        constexpr int kSectors = 12;
        double sum = 0;
        for (int lamp = 0; lamp < 3; ++lamp) {
            const double turn = 2 * M_PI * (lamp + 0.25) / 3;
            for (const GaussNode& ring : gauss_rule(4)) {
                const double radius = kRadius * std::sqrt(ring.x);
                for (int sector = 0; sector < kSectors; ++sector) {
                    const double angle = 2 * M_PI * (sector + 0.5) / kSectors;
                    const double u = kRing * std::cos(turn) + radius * std::cos(angle);
                    const double v = kRing * std::sin(turn) + radius * std::sin(angle);
                    sum += ring.weight / kSectors *
                           point_irradiance(x - u, y - v, z, [](double c) { return std::pow(c, kExponent); });
                }
            }
        }
        return sum;
    }
};

Compared trio() {
    const auto opening = [](double x, double y, double z) {
        constexpr int kSectors = 24;
        double sum = 0;
        for (const GaussNode& ring : gauss_rule(8)) {
            const double radius = 0.5 * std::sqrt(ring.x);
            for (int sector = 0; sector < kSectors; ++sector) {
                const double angle = 2 * M_PI * (sector + 0.5) / kSectors;
                sum += ring.weight / kSectors *
                       point_irradiance(x - radius * std::cos(angle), y - radius * std::sin(angle), z,
                                        Trio::intensity);
            }
        }
        return sum;
    };
    return {"three narrow beams", Trio::near,
            [](double x, double y, double z) { return point_irradiance(x, y, z, Trio::intensity); }, opening};
}

// The origin of a ray file's light: the centre of the waist, where the rays are closest together (an LED's
// chip is seen below its window), and the diameter around it that holds 98 % of the light there.
struct Extent {
    V3d centre{0, 0, 0};
    double size = 0;  // metres
};

Extent extent_of(const RaySet& rays) {
    constexpr float kSteepest = 0.5F;  // cosine; flat rays tell little about depth
    // The waist minimises the variance of positions, from the positions on z = 0 and the slopes.
    struct Line {
        Imath::V2d at, slope;
    };
    std::vector<Line> lines;
    Imath::V2d at(0, 0), slope(0, 0);
    for (const LampRay& ray : rays.rays) {
        if (!(ray.d.z > kSteepest)) continue;
        const Imath::V2d s(double{ray.d.x} / double{ray.d.z}, double{ray.d.y} / double{ray.d.z});
        lines.push_back({Imath::V2d(double{ray.o.x}, double{ray.o.y}) - double{ray.o.z} * s, s});
        at += lines.back().at;
        slope += s;
    }
    const double count = static_cast<double>(lines.size());  // > 0 for a lamp that shines forward
    at /= count, slope /= count;
    double joint = 0, deviation = 0;
    for (const Line& line : lines) {
        joint += (line.at - at).dot(line.slope - slope);
        deviation += (line.slope - slope).length2();
    }
    Extent extent;
    const double z = -joint / deviation;
    const Imath::V2d middle = at + z * slope;
    extent.centre = V3d(middle.x, middle.y, z);
    std::vector<double> reach;
    for (const Line& line : lines) reach.push_back((line.at + z * line.slope - middle).length());
    const auto nth = reach.begin() + static_cast<std::ptrdiff_t>(0.98 * (count - 1));
    std::nth_element(reach.begin(), nth, reach.end());
    extent.size = 2 * *nth;
    return extent;
}

struct Errors {
    double axis, rms, worst;
};

Errors errors_of(const std::vector<double>& near, const std::vector<double>& far) {
    double mean = 0, peak = 0, square = 0, worst = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
        mean += near[i] / static_cast<double>(near.size());
        peak = std::max(peak, near[i]);
        square += sqr(far[i] - near[i]) / static_cast<double>(near.size());
        worst = std::max(worst, std::fabs(far[i] - near[i]));
    }
    const std::size_t middle = near.size() / 2;  // the number of pixels per side is odd
    return {far[middle] / near[middle] - 1, std::sqrt(square) / mean, worst / peak};
}

void print(const std::string& name, double distance, const Errors& errors) {
    fmt::print("{},{:.4f},{:.6f},{:.6f},{:.6f}\n", name, distance, errors.axis, errors.rms, errors.worst);
}

double distance_at(int i) {
    return kFirst * std::pow(kLast / kFirst, static_cast<double>(i) / (kDistances - 1));
}

void compare_formulas(const Compared& lamp) {
    for (int i = 0; i < kDistances; ++i) {
        const double z = distance_at(i);
        std::vector<double> near, far, opening;
        for (int y = 0; y < lamp.pixels; ++y) {
            for (int x = 0; x < lamp.pixels; ++x) {
                const double px = ((x + 0.5) / lamp.pixels - 0.5) * z,
                             py = ((y + 0.5) / lamp.pixels - 0.5) * z;
                near.push_back(lamp.near(px, py, z));
                far.push_back(lamp.far(px, py, z));
                if (lamp.opening) opening.push_back(lamp.opening(px, py, z));
            }
        }
        print(lamp.name, z, errors_of(near, far));
        if (lamp.opening) print(lamp.name + kOpening, z, errors_of(near, opening));
    }
}

// Compares the measured LED's rays, counted on the surface, with its far field. Pixels are few and wide,
// because there are only 100,000 rays.
void compare_rays(const std::filesystem::path& file) {
    constexpr int kPixels = 3, kFine = 40;
    Monitor silent;
    RaySet rays = read_rays(file, silent);
    const Extent extent = extent_of(rays);
    for (LampRay& ray : rays.rays) ray.o -= V3f(extent.centre);
    fmt::print(stderr, "LED: size {:.2f} mm, waist at ({:.2f}, {:.2f}, {:.2f}) mm\n", extent.size * 1e3,
               extent.centre.x * 1e3, extent.centre.y * 1e3, extent.centre.z * 1e3);
    const PhotometricWeb web = far_field(rays, {2.5, 15});
    for (int i = 0; i < kDistances; ++i) {
        const double z = distance_at(i) * extent.size;
        const PlaneIrradiance near = project(rays, {z, {0, 0}, {z, z}, {kPixels, kPixels}});
        std::vector<double> far, opening;
        for (int p = 0; p < kPixels * kPixels; ++p) {
            double sum = 0, opening_sum = 0;
            for (int s = 0; s < kFine * kFine; ++s) {
                const double x = ((p % kPixels + (s % kFine + 0.5) / kFine) / kPixels - 0.5) * z;
                const double y = ((p / kPixels + (s / kFine + 0.5) / kFine) / kPixels - 0.5) * z;
                const auto from = [&](double u, double v) {
                    const V3d way(x - u, y - v, z);
                    const double d2 = way.length2();  // > 0
                    return web.intensity(way / std::sqrt(d2)) * z / std::sqrt(d2) / d2;
                };
                sum += from(0, 0);
                // Points of the disc are on a spiral, in an order that has nothing to do with the pixel's.
                constexpr int kPoints = kFine * kFine, kStride = 997;  // without a common divisor
                const double turn = s * kStride % kPoints + 0.5;
                const double radius = extent.size / 2 * std::sqrt(turn / kPoints);
                const double angle = 2 * M_PI * turn * 0.6180339887498949;
                opening_sum += from(radius * std::cos(angle), radius * std::sin(angle));
            }
            far.push_back(sum / (kFine * kFine));
            opening.push_back(opening_sum / (kFine * kFine));
        }
        print("measured LED", distance_at(i), errors_of(near.values, far));
        print(std::string("measured LED") + kOpening, distance_at(i), errors_of(near.values, opening));
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: five_times LED.tm25ray|- > five-times.csv\n");
        return 1;
    }
    try {
        fmt::print("lamp,distance,axis,rms,worst\n");
        compare_formulas(disc());
        compare_formulas(trio());
        if (std::string(argv[1]) != "-") compare_rays(argv[1]);
    } catch (const InputError& error) {
        fmt::print(stderr, "five_times: {}\n", error.what());
        return 1;
    }
    return 0;
}
