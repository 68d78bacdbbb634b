#include "engine/photometry/daylight_glare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/photometry/path_rounds.h"
#include "engine/scene/media_traversal.h"

namespace lucerna {
namespace {

// evalglare's luminance above which pixels form separate sources, cd/m², and angle within a source, radians.
constexpr double kPeak = 50000, kSearchRadius = 0.2;
// A threshold above this value is a luminance in cd/m²; a smaller one is a multiple of the mean luminance.
constexpr double kLargestFactor = 100;
// The random numbers of distant lights begin here, beyond those of all sensor replicas and luminaires.
constexpr std::uint64_t kSuns = std::uint64_t{1} << 63;
constexpr double kSunRadius = 0.26656 * kPiD / 180;  // radians, as seen at the mean distance

// Samples per pixel of the first round, and the maximum.
constexpr int kFirstViewSamples = 8, kMostViewSamples = 4096;

struct Cluster {
    V3d middle{0};  // Σ ω w, without luminance, so that noise does not choose a pixel's source
    V3d moment{0};  // Σ L ω w
    std::array<double, 2> flux{};  // Σ L ω of each half of the picture
    double solid_angle = 0;
    double variance = 0;  // estimated variance of the mean of both halves' flux
    double squares = 0;   // sum of the squared variances of the pixels

    // Returns one more than the effective degrees of freedom [Satterthwaite 1946]. Each pixel's variance
    // comes from one difference and has one degree of freedom.
    std::uint64_t values() const {
        return 1 + std::max<std::uint64_t>(
                       1, squares > 0 ? static_cast<std::uint64_t>(sqr(variance) / squares) : 1);
    }
};

// Returns the nearest cluster within the search radius of `w`, or a new one.
Cluster& cluster_near(std::vector<Cluster>& clusters, const V3d& w) {
    double nearest = cos(kSearchRadius);
    Cluster* found = nullptr;
    for (Cluster& cluster : clusters) {
        const double cosine = cluster.middle.normalized().dot(w);
        if (cosine > nearest) nearest = cosine, found = &cluster;
    }
    return found ? *found : clusters.emplace_back();
}

// Returns the unit vector across the line of sight that is nearest to the observer's upward direction.
V3d up_of(const Observer& observer) {
    const V3d z(observer.view), up(observer.up);
    return (up - up.dot(z) * z).normalized();
}

std::vector<DaylightSource> sources_of(const LuminanceView& view, const Observer& observer,
                                       double threshold) {
    std::vector<Cluster> bright, peaks;
    std::size_t pixel = 0;
    for (int y = 0; y < view.pixels; ++y) {
        for (int x = 0; x < view.pixels; ++x, ++pixel) {
            const double seen = double{view.denoised[pixel]};
            if (!(seen > threshold)) continue;
            const ViewDirection to = view_direction(view.pixels, x, y);
            if (!(to.solid_angle > 0)) continue;
            Cluster& cluster = cluster_near(seen > kPeak ? peaks : bright, to.w);
            cluster.middle += to.solid_angle * to.w;
            cluster.moment += view.luminance(pixel) * to.solid_angle * to.w;
            for (std::size_t half = 0; half < 2; ++half)
                cluster.flux[half] += double{view.halves[half][pixel]} * to.solid_angle;
            cluster.solid_angle += to.solid_angle;
            const double apart = double{view.halves[0][pixel]} - double{view.halves[1][pixel]};
            const double variance = sqr(0.5 * apart * to.solid_angle);
            cluster.variance += variance;
            cluster.squares += sqr(variance);
        }
    }
    bright.insert(bright.end(), peaks.begin(), peaks.end());
    const V3d x(observer.right()), z(observer.view), y = up_of(observer);
    std::vector<DaylightSource> sources;
    for (const Cluster& cluster : bright) {
        const V3d w = cluster.moment.normalized();
        DaylightSource& source = sources.emplace_back();
        source.towards = V3f(w.x * x + w.y * y + w.z * z);
        source.solid_angle = cluster.solid_angle;  // > 0, as each cluster has a pixel
        source.luminance = {0.5 * (cluster.flux[0] + cluster.flux[1]) / cluster.solid_angle,
                            student_95(cluster.values()) * std::sqrt(cluster.variance) / cluster.solid_angle};
        source.square = cluster.flux[0] * cluster.flux[1] / sqr(cluster.solid_angle);
        source.position = position_index(observer, source.towards);
    }
    return sources;
}

// Adds distant lights, attenuated by panes and media, as uniform discs of the sun's solid angle.
void add_distant_lights(const Observer& observer, const Scene& scene, std::uint64_t seed,
                        std::vector<DaylightSource>& sources) {
    const double disc = 4 * kPiD * sqr(sin(0.5 * kSunRadius));
    const V3f at(observer.eye - scene.origin());
    const std::int32_t medium = medium_around(scene, {at}, observer.view);
    for (const auto& light : scene.lights()) {
        if (light->bounds() || !light->is_delta() || !(light->power() > 0)) continue;
        const auto towards = light->sample_Li(at, {0.5F, 0.5F});
        if (!towards) continue;
        const double position = position_index(observer, towards->w);
        if (!std::isfinite(position)) continue;
        RunningStats across;  // luminance, which varies where media are sampled
        constexpr std::uint32_t kSamples = 1024;
        for (std::uint32_t i = 0; i < kSamples; ++i) {
            Sampler sampler = Sampler::stratified(seed, Purpose::receiver, kSuns, i);
            const Ray way{at, towards->w, towards->distance};
            across.add(double{luminance(towards->weight * passing(scene, way, medium, sampler, false))} /
                       disc);
        }
        const Reading95 seen = reading_95(across);
        if (!(seen.value > 0)) continue;
        const double square = sqr(seen.value) - sqr(across.standard_error());  // unbiased
        sources.push_back({towards->w, disc, seen, square, position});
    }
}

double threshold_of(double threshold, double mean) {
    return threshold > kLargestFactor ? threshold : threshold * mean;
}

// Returns Σ L² ω / P² and its half-width.
Reading95 sum_of(const std::vector<DaylightSource>& sources) {
    double sum = 0, square = 0;
    for (const DaylightSource& source : sources) {
        if (!std::isfinite(source.position)) continue;  // not seen, at the edge of the hemisphere
        const double share = source.solid_angle / sqr(source.position);
        sum += source.square * share;
        // Includes the second-order term, which is no smaller than the first in a picture of few samples.
        const double width = source.luminance.half_width;
        square += sqr(share * width) * (sqr(2 * source.luminance.value) + sqr(width));
    }
    return {std::max(0.0, sum), std::sqrt(square)};
}

Reading95 dgp_reading(const Reading95& vertical, const Reading95& sum) {
    const double dgp = dgp_of(vertical.value, sum.value);
    // Propagates the half-widths to first order by differences, as DGP is smooth in both arguments.
    const double by_vertical = std::fabs(dgp_of(vertical.value + vertical.half_width, sum.value) - dgp);
    const double by_sum = std::fabs(dgp_of(vertical.value, sum.value + sum.half_width) - dgp);
    return {dgp, hypot(by_vertical, by_sum)};
}

struct ViewSums {
    double vertical = 0, mean = 0;  // illuminance at the eye, lx, and mean luminance, cd/m²
};
ViewSums sums_of(const LuminanceView& view) {
    ViewSums sums;
    std::size_t pixel = 0;
    for (int y = 0; y < view.pixels; ++y) {
        for (int x = 0; x < view.pixels; ++x, ++pixel) {
            const ViewDirection to = view_direction(view.pixels, x, y);
            const double flux = view.luminance(pixel) * to.solid_angle;
            sums.vertical += flux * to.w.z;
            sums.mean += flux / (2 * kPiD);
        }
    }
    return sums;
}

Camera fisheye(const Observer& observer, const Scene& scene, int pixels) {
    Camera::Settings settings;
    settings.kind = Camera::Settings::Kind::spherical;
    settings.mapping = Camera::Settings::Mapping::fisheye;
    settings.width = settings.height = pixels;
    const V3d x(observer.right()), y = up_of(observer), z(observer.view), at = observer.eye - scene.origin();
    settings.world_from_camera =
        M44d(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, at.x, at.y, at.z, 1);
    return Camera(settings);
}

std::vector<float> luminances(const Image& image, int pixels) {
    std::vector<float> all;
    for (int y = 0; y < pixels; ++y) {
        for (int x = 0; x < pixels; ++x) {
            const bool seen = view_direction(pixels, x, y).solid_angle > 0;
            all.push_back(seen ? luminance(image.rgb_at(x, y)) : 0);
        }
    }
    return all;
}

LuminanceView view_of(const RenderResult& result, int pixels) {
    const auto& halves = result.denoiser_input.value().halves;
    return {pixels,
            {luminances(halves[0], pixels), luminances(halves[1], pixels)},
            luminances(result.denoised.value(), pixels)};
}

}  // namespace

ViewDirection view_direction(int pixels, int x, int y) {
    const double px = (2 * x + 1.0) / pixels - 1, py = 1 - (2 * y + 1.0) / pixels;
    const double r = hypot(px, py);
    if (r >= 1) return {};
    const double theta = 0.5 * kPiD * r;
    const double across = r > 0 ? sin(theta) / r : 0.5 * kPiD;  // limit of sin(theta) / r at r = 0
    const double area = sqr(2.0 / pixels);
    return {{across * px, across * py, cos(theta)}, across * 0.5 * kPiD * area};
}

bool has_daylight(const Scene& scene) {
    constexpr std::array<std::string_view, 3> kKinds{"infinite", "sun", "distant"};
    return std::ranges::any_of(scene.lights(), [&](const auto& light) {
        return light->power() > 0 && std::ranges::find(kKinds, light->kind()) != kKinds.end();
    });
}

double dgp_of(double vertical, double sum) {
    if (!(vertical > 0)) return 0;
    const double dgp = 5.87e-5 * vertical + 9.18e-2 * log10(1 + sum / pow(vertical, 1.87)) + 0.16;
    if (vertical >= 1000) return dgp;
    return dgp / (1 + exp(4 - 0.024 * vertical));
}

LuminanceView luminance_view(const Observer& observer, Job& job, const DaylightOptions& options,
                             Monitor& monitor) {
    job.camera = fisheye(observer, job.scene, options.pixels);
    job.camera_medium = medium_around(job.scene, {V3f(observer.eye - job.scene.origin())}, observer.view);
    job.film = FilmSettings();
    job.film.width = job.film.height = options.pixels;
    job.film.two_halves = true;
    PathRounds rounds(job, Quantity::radiance, kFirstViewSamples, options.seed, options.workers,
                      options.seconds);
    for (;;) {
        const RenderResult result = rounds.render(monitor);
        if (result.report.samples_done == 0) throw Stopped("ended before every observer's view had a sample");
        const LuminanceView view = view_of(result, options.pixels);
        if (!result.report.complete || result.report.samples_done < job.spp || job.spp >= kMostViewSamples)
            return view;
        const ViewSums sums = sums_of(view);
        const std::vector<DaylightSource> sources =
            sources_of(view, observer, threshold_of(options.threshold, sums.mean));
        const double reached = dgp_reading({sums.vertical, 0}, sum_of(sources)).half_width;
        if (reached <= options.precision) return view;
        rounds.grow(reached / options.precision, kMostViewSamples);
    }
}

Image view_image(const LuminanceView& view) {
    Image image = Image::rgb(view.pixels, view.pixels), denoised = image;
    for (int y = 0; y < view.pixels; ++y) {
        for (int x = 0; x < view.pixels; ++x) {
            const auto pixel = static_cast<std::size_t>(y * view.pixels + x);
            image.set_rgb(x, y, Rgb(static_cast<float>(view.luminance(pixel))));
            denoised.set_rgb(x, y, Rgb(view.denoised[pixel]));
        }
    }
    add_channels(image, denoised, "denoised.");
    image.attributes["lucerna.unit"] = "cd/m^2";
    return image;
}

DaylightGlare daylight_glare(const LuminanceView& view, const Observer& observer, const Scene& scene,
                             double threshold, std::uint64_t seed) {
    DaylightGlare glare;
    glare.mean_luminance = sums_of(view).mean;
    glare.sources = sources_of(view, observer, threshold_of(threshold, glare.mean_luminance));
    add_distant_lights(observer, scene, seed, glare.sources);
    return glare;
}

Reading95 daylight_rating(const DaylightGlare& glare, const Reading95& vertical) {
    return dgp_reading(vertical, sum_of(glare.sources));
}

}  // namespace lucerna
