#include "engine/evaluation/flip.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

constexpr double kColourExponent =
    0.7;  // q_c: compresses large colour distances, which are harder to tell apart
constexpr double kFeatureExponent = 0.5;  // q_f
constexpr double kKneeIn = 0.4;           // p_c, a share of the largest colour distance …
constexpr double kKneeOut = 0.95;         // … and p_t, the error at that distance
constexpr std::int64_t kPixelsPerChunk = 4096;

// A linear opponent space: L*a*b* without its cube roots [FLIP 4.1.1].
struct Opponent {
    std::array<FlipPlane, 3> planes;  // Y, Cx, Cz
};

V3d white_xyz() {
    return rgb_to_xyz(Rgb(1));
}

Opponent opponent_of(const std::vector<Rgb>& linear, int width, int height, const Workers& workers) {
    Opponent result{{FlipPlane(width, height), FlipPlane(width, height), FlipPlane(width, height)}};
    const V3d white = white_xyz();
    parallel_each(workers, linear.size(), kPixelsPerChunk, [&](std::size_t i) {
        const V3d c = rgb_to_xyz(linear[i]) / white;  // no component of white is 0
        result.planes[0].data[i] = static_cast<float>(116 * c.y - 16);
        result.planes[1].data[i] = static_cast<float>(500 * (c.x - c.y));
        result.planes[2].data[i] = static_cast<float>(200 * (c.y - c.z));
    });
    return result;
}

// Returns CIE L*a*b* with a* and b* scaled down in the dark, where colours are harder to tell apart [FLIP
// (9), after Hunt].
V3d hunt_lab(const Rgb& linear, const V3d& white) {
    const auto root = [](double t) {
        constexpr double kDelta = 6.0 / 29;
        return t > kDelta * kDelta * kDelta ? cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
    };
    const V3d c = rgb_to_xyz(linear) / white;
    const double x = root(c.x), y = root(c.y), z = root(c.z);
    const double lightness = 116 * y - 16;
    return {lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)};
}

// Returns the HyAB distance [Abasi 2019].
double colour_distance(const V3d& a, const V3d& b) {
    return std::fabs(a.x - b.x) + hypot(a.y - b.y, a.z - b.z);
}

// Returns the largest distance in the gamut, from green to blue, to the power q_c.
double largest_colour_error() {
    const V3d white = white_xyz();
    return pow(colour_distance(hunt_lab(Rgb(0, 1, 0), white), hunt_lab(Rgb(0, 0, 1), white)),
               kColourExponent);
}

// Maps [0, largest] to [0, 1], with most of the range for small distances [FLIP (11)].
double redistributed(double error, double largest) {
    const double knee = kKneeIn * largest;
    if (error < knee) return error * kKneeOut / knee;
    return std::min(1.0, kKneeOut + (error - knee) / (largest - knee) * (1 - kKneeOut));
}

// Returns the colours after the eye's blur, clamped to a screen's gamut, in L*a*b*.
std::vector<V3d> seen_colours(const Opponent& picture, const EyeBlurs& eye, const Workers& workers) {
    const FlipPlane y = blurred(picture.planes[0], eye.achromatic, workers);
    const FlipPlane cx = blurred(picture.planes[1], eye.red_green, workers);
    const FlipPlane cz = blurred(picture.planes[2], eye.blue_yellow, workers);
    std::vector<V3d> lab(y.data.size());
    const V3d white = white_xyz();
    parallel_each(workers, lab.size(), kPixelsPerChunk, [&](std::size_t i) {
        const double luma = (double{y.data[i]} + 16) / 116;
        const V3d xyz(luma + double{cx.data[i]} / 500, luma, luma - double{cz.data[i]} / 200);
        const Rgb c = xyz_to_rgb(xyz * white);
        const auto clamped = [](float v) { return std::clamp(v, 0.0F, 1.0F); };
        lab[i] = hunt_lab({clamped(c.x), clamped(c.y), clamped(c.z)}, white);
    });
    return lab;
}

// Strength of edges and points that the eye detects at each pixel.
struct Features {
    FlipPlane edge, point;
};

FlipPlane lengths(const FlipPlane& x, const FlipPlane& y) {
    FlipPlane result(x.width, x.height);
    for (std::size_t i = 0; i < result.data.size(); ++i) result.data[i] = hypot(x.data[i], y.data[i]);
    return result;
}

Features features_of(const Opponent& picture, const FeatureKernels& kernels, const Workers& workers) {
    FlipPlane luma = picture.planes[0];
    for (float& v : luma.data) v = (v + 16) / 116;
    const FlipPlane smooth = along_rows(luma, kernels.smooth, workers);
    const FlipPlane edge = along_rows(luma, kernels.edge, workers);
    const FlipPlane point = along_rows(luma, kernels.point, workers);
    return {
        lengths(along_columns(edge, kernels.smooth, workers), along_columns(smooth, kernels.edge, workers)),
        lengths(along_columns(point, kernels.smooth, workers),
                along_columns(smooth, kernels.point, workers))};
}

// Filters and constants shared by all pictures at one viewing distance.
struct Viewer {
    EyeBlurs eye;
    FeatureKernels features;
    double largest = largest_colour_error();

    explicit Viewer(double pixels_per_degree)
        : eye(eye_blurs(pixels_per_degree)), features(feature_kernels(pixels_per_degree)) {}
};

// Returns the map for linear colours in [0, 1].
ZeroedVector<float> flip_linear(const Viewer& viewer, const std::vector<Rgb>& picture,
                                const std::vector<Rgb>& reference, int width, int height,
                                const Workers& workers) {
    const Opponent a = opponent_of(picture, width, height, workers);
    const Opponent b = opponent_of(reference, width, height, workers);
    const std::vector<V3d> colours_a = seen_colours(a, viewer.eye, workers);
    const std::vector<V3d> colours_b = seen_colours(b, viewer.eye, workers);
    const Features found_a = features_of(a, viewer.features, workers);
    const Features found_b = features_of(b, viewer.features, workers);
    ZeroedVector<float> error(picture.size());
    parallel_each(workers, error.size(), kPixelsPerChunk, [&](std::size_t i) {
        const double colour =
            redistributed(pow(colour_distance(colours_a[i], colours_b[i]), kColourExponent), viewer.largest);
        const double edge = std::fabs(double{found_a.edge.data[i]} - double{found_b.edge.data[i]});
        const double point = std::fabs(double{found_a.point.data[i]} - double{found_b.point.data[i]});
        // Both are at most √2 [FLIP (13)]; min() prevents rounding beyond 1.
        const double feature = std::min(1.0, pow(std::max(edge, point) / std::sqrt(2.0), kFeatureExponent));
        error[i] = static_cast<float>(pow(colour, 1 - feature));  // [FLIP (15)]
    });
    return error;
}

template <typename Map>
std::vector<Rgb> mapped(const Image& image, Map&& map) {
    std::vector<Rgb> result;
    result.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = image.rgb_at(x, y);
            result.emplace_back(map(c.x), map(c.y), map(c.z));
        }
    }
    return result;
}

float decoded_in_range(float v) {
    return srgb_decoded(v > 0 ? std::min(v, 1.0F) : 0.0F);
}

// Narkowicz's fit of the ACES curve, (a x² + b x) / (c x² + d x + e) of x = 0.6 times the value, the tone
// mapping of [Andersson 2021]. It increases for all x >= 0 and tends to a / c > 1.
constexpr double kCurveA = 0.36 * 2.51, kCurveB = 0.6 * 0.03;
constexpr double kCurveC = 0.36 * 2.43, kCurveD = 0.6 * 0.59, kCurveE = 0.14;

float film_curve(double x) {
    if (!(x > 0)) return 0;
    if (x > 1e6) return 1;  // the curve exceeds 1 there, and squares stay finite
    return static_cast<float>(
        std::min(1.0, x * (kCurveA * x + kCurveB) / (x * (kCurveC * x + kCurveD) + kCurveE)));  // e > 0
}

// Inverts the curve at `shown`, which is below a / c: returns the positive root of (a - s c) x² + (b - s d) x
// - s e = 0.
double film_curve_inverse(double shown) {
    const double a = kCurveA - shown * kCurveC, b = kCurveB - shown * kCurveD, c = -shown * kCurveE;
    return (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
}

}  // namespace

double pixels_per_degree(double distance, double width, double pixels) {
    return distance * pixels / width * kPiD / 180;
}

Image flip(const Image& picture, const Image& reference, double pixels_per_degree, const Workers& workers) {
    assert(picture.width == reference.width && picture.height == reference.height);
    Image map(picture.width, picture.height, {"flip"});
    map.data = flip_linear(Viewer(pixels_per_degree), mapped(picture, decoded_in_range),
                           mapped(reference, decoded_in_range), picture.width, picture.height, workers);
    return map;
}

std::optional<ExposureRange> flip_exposures(const Image& reference) {
    std::vector<double> lit;
    for (int y = 0; y < reference.height; ++y) {
        for (int x = 0; x < reference.width; ++x) {
            const double value = double{luminance(reference.rgb_at(x, y))};
            if (value > 0 && std::isfinite(value)) lit.push_back(value);
        }
    }
    if (lit.empty()) return std::nullopt;
    // Takes the upper median of an even number.
    const auto middle = lit.begin() + static_cast<std::ptrdiff_t>(lit.size() / 2);
    std::nth_element(lit.begin(), middle, lit.end());
    const double median = *middle;
    const double most = *std::max_element(middle, lit.end());
    const double target = film_curve_inverse(0.85);
    ExposureRange range;
    range.start = log2(target / most);
    range.stop = log2(target / median);
    range.count = std::max(2, static_cast<int>(std::ceil(range.stop - range.start)));
    return range;
}

HdrFlip hdr_flip(const Image& image, const Image& reference, const ExposureRange& range,
                 double pixels_per_degree, const Workers& workers, Monitor& monitor) {
    assert(image.width == reference.width && image.height == reference.height);
    const Viewer viewer(pixels_per_degree);
    HdrFlip result;
    result.map = Image(image.width, image.height, {"flip"});
    result.worst.resize(result.map.data.size());
    Phase phase(monitor, "FLIP", static_cast<std::uint64_t>(range.count));
    for (int i = 0; i < range.count; ++i) {
        const double factor = exp2(range.exposure(i));
        const auto shown = [&](float v) { return film_curve(double{v} * factor); };
        const ZeroedVector<float> error = flip_linear(viewer, mapped(image, shown), mapped(reference, shown),
                                                      image.width, image.height, workers);
        for (std::size_t p = 0; p < error.size(); ++p) {
            if (error[p] <= result.map.data[p]) continue;
            result.map.data[p] = error[p];
            result.worst[p] = i;
        }
        phase.advance(1);
    }
    return result;
}

}  // namespace lucerna
