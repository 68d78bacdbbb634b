#include "engine/scene/texture_patterns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "engine/scene/noise_lanes.h"

namespace lucerna {
namespace {

// This is Perlin's permutation of 0...255.
constexpr std::array<std::uint8_t, 256> kPermutation = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

unsigned hashed(unsigned i) {
    return kPermutation[i & 255U];
}

// Holds the lattice cell of a coordinate, modulo the period, and the position within it.
struct Cell {
    unsigned index;
    double within;  // [0,1]
};
Cell cell_of(double x) {
    const double floor = std::floor(x);
    // It is exact: floor/256 only changes the exponent. Beyond 2^53 every number is a lattice point.
    return {static_cast<unsigned>(floor - 256 * std::floor(floor / 256)) & 255U, x - floor};
}

// The gradients of the sixteen hash values point towards the edges of a cube, four of them twice. They are in
// a table, because a branch on a hash is unpredictable.
constexpr std::array<std::array<double, 3>, 16> kGradients = [] {
    std::array<std::array<double, 3>, 16> all{};
    for (unsigned h = 0; h < 16; ++h) {
        const std::size_t u = h < 8 || h == 12 || h == 13 ? 0 : 1;
        const std::size_t v = h < 4 || h == 12 || h == 13 ? 1 : 2;
        all[h][u] = (h & 1U) != 0 ? -1 : 1;
        all[h][v] = (h & 2U) != 0 ? -1 : 1;
    }
    return all;
}();

// Returns the product of a lattice point's gradient with the offset from it.
double gradient(unsigned hash, double dx, double dy, double dz) {
    const std::array<double, 3>& g = kGradients[hash & 15U];
    return g[0] * dx + g[1] * dy + g[2] * dz;
}

double quintic(double t) {
    return t * t * t * (t * (t * 6 - 15) + 10);
}
double between(double t, double a, double b) {
    return a + t * (b - a);
}

}  // namespace

double perlin_noise(const V3d& p) {
    if (!std::isfinite(p.x + p.y + p.z)) return 0;
    const Cell x = cell_of(p.x), y = cell_of(p.y), z = cell_of(p.z);
    const double wx = quintic(x.within), wy = quintic(y.within);
    const unsigned hash_x[] = {hashed(x.index), hashed(x.index + 1)};
    const auto along_x = [&](unsigned dy, unsigned dz) {
        const double ry = y.within - dy, rz = z.within - dz;
        const unsigned low = hashed(hashed(hash_x[0] + y.index + dy) + z.index + dz);
        const unsigned high = hashed(hashed(hash_x[1] + y.index + dy) + z.index + dz);
        return between(wx, gradient(low, x.within, ry, rz), gradient(high, x.within - 1, ry, rz));
    };
    return between(quintic(z.within), between(wy, along_x(0, 0), along_x(1, 0)),
                   between(wy, along_x(0, 1), along_x(1, 1)));
}

namespace {

#if LUCERNA_NOISE_LANES
// This is kGradients transposed: component by component.
constexpr std::array<std::array<double, 16>, 3> kGradientParts = [] {
    std::array<std::array<double, 16>, 3> parts{};
    for (std::size_t h = 0; h < 16; ++h) {
        for (std::size_t c = 0; c < 3; ++c) parts[c][h] = kGradients[h][c];
    }
    return parts;
}();
#endif

// Returns the noise at p times each of kNoiseLanes increasing frequencies; only the first `count` are needed.
std::array<double, kNoiseLanes> noise_of(const V3d& p, const double* frequencies, std::size_t count) {
    std::array<double, kNoiseLanes> noise{};
#if LUCERNA_NOISE_LANES
    // The condition is false if p is NaN.
    if (has_noise_lanes() &&
        (std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z)) * frequencies[kNoiseLanes - 1] < kLanesReach) {
        noise_lanes(kPermutation, kGradientParts, p, frequencies, noise.data());
        return noise;
    }
#endif
    for (std::size_t i = 0; i < count; ++i) noise[i] = perlin_noise(frequencies[i] * p);
    return noise;
}

constexpr std::size_t kFirstOctaves = 16;  // a multiple of kNoiseLanes, and more than images need
constexpr std::array<double, kFirstOctaves> kFrequencies = [] {
    std::array<double, kFirstOctaves> all{};
    double frequency = 1;
    for (double& f : all) {
        f = frequency;
        frequency *= 1.99;
    }
    return all;
}();

// Returns the sum over octaves of amplitude times shape(noise).
template <typename Shape>
double sum_octaves(const V3d& p, const Octaves& octaves, Shape&& shape) {
    const auto count = static_cast<std::size_t>(std::max(octaves.count, 0));
    const std::size_t first = std::min(count, kFirstOctaves);
    double sum = 0, amplitude = 1;
    for (std::size_t begin = 0; begin < first; begin += kNoiseLanes) {
        const std::size_t here = std::min(kNoiseLanes, first - begin);
        const auto noise = noise_of(p, &kFrequencies[begin], here);
        for (std::size_t i = 0; i < here; ++i) {
            sum += amplitude * shape(noise[i]);
            amplitude *= octaves.omega;
        }
    }
    double frequency = kFrequencies.back() * 1.99;
    for (std::size_t i = first; i < count; ++i) {
        sum += amplitude * shape(perlin_noise(frequency * p));
        frequency *= 1.99;
        amplitude *= octaves.omega;
    }
    return sum;
}

#if LUCERNA_NOISE_LANES
// Several places share the vector lanes: three places of five octaves take two vectors of eight lanes, where
// one place at a time would take three.
constexpr std::size_t kMostPlaces = 3;

bool share_lanes(std::span<const V3d> at, const Octaves& octaves) {
    if (at.size() < 2 || at.size() > kMostPlaces || octaves.count < 1 ||
        octaves.count > static_cast<int>(kNoiseLanes) || !has_noise_lanes()) {
        return false;
    }
    for (const V3d& p : at) {
        if (!((std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z)) * kFrequencies[kNoiseLanes - 1] <
              kLanesReach))
            return false;
    }
    const std::size_t wanted = at.size() * static_cast<std::size_t>(octaves.count);
    return (wanted + kNoiseLanes - 1) / kNoiseLanes < at.size();
}

template <typename Shape>
void sum_octaves_sharing(std::span<const V3d> at, const Octaves& octaves, std::span<double> sums,
                         Shape&& shape) {
    std::array<double, kMostPlaces * kNoiseLanes> x{}, y{}, z{}, noise;
    const auto count = static_cast<std::size_t>(octaves.count);
    std::size_t lane = 0;
    for (const V3d& p : at) {
        for (std::size_t i = 0; i < count; ++i, ++lane) {
            x[lane] = kFrequencies[i] * p.x;
            y[lane] = kFrequencies[i] * p.y;
            z[lane] = kFrequencies[i] * p.z;
        }
    }
    for (std::size_t first = 0; first < lane; first += kNoiseLanes) {
        noise_lanes(kPermutation, kGradientParts, &x[first], &y[first], &z[first], &noise[first]);
    }
    lane = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
        double sum = 0, amplitude = 1;
        for (std::size_t i = 0; i < count; ++i, ++lane) {
            sum += amplitude * shape(noise[lane]);
            amplitude *= octaves.omega;
        }
        sums[k] = sum;
    }
}
#endif

template <typename Shape>
void sum_octaves_each(std::span<const V3d> at, const Octaves& octaves, std::span<double> sums,
                      Shape&& shape) {
#if LUCERNA_NOISE_LANES
    if (share_lanes(at, octaves)) return sum_octaves_sharing(at, octaves, sums, shape);
#endif
    for (std::size_t i = 0; i < at.size(); ++i) sums[i] = sum_octaves(at[i], octaves, shape);
}

double itself(double x) {
    return x;
}
double size_of(double x) {
    return std::fabs(x);
}

}  // namespace

double fractal_noise(const V3d& p, const Octaves& octaves) {
    return sum_octaves(p, octaves, itself);
}
double turbulence(const V3d& p, const Octaves& octaves) {
    return sum_octaves(p, octaves, size_of);
}
void fractal_noise(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise) {
    sum_octaves_each(at, octaves, noise, itself);
}
void turbulence(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise) {
    sum_octaves_each(at, octaves, noise, size_of);
}

double fractal_bound(const Octaves& octaves) {
    double sum = 0, amplitude = kNoiseBound;
    for (int i = 0; i < octaves.count; ++i) {
        sum += amplitude;
        amplitude *= std::fabs(octaves.omega);
    }
    return sum;
}

}  // namespace lucerna
