#include "engine/photometry/illuminance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/path_limits.h"
#include "engine/base/plain_text.h"
#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/photometry/path_rounds.h"
#include "engine/render/chance_light.h"
#include "engine/scene/light_parts.h"
#include "engine/scene/quantity.h"

namespace lucerna {
namespace {

// Heads of a point, so that an interval of theirs is worth something, and pixels of an image, so that all
// threads have tiles.
constexpr int kLeastHeads = 16;
constexpr std::int64_t kLeastPixels = 16384;
constexpr int kWidth = 256;
// Samples of all of a point's heads after the first round, so that its interval tells something, of a head at
// least.
constexpr int kFirstOfPoint = 256, kFirstOfHead = 4;
// An interval is as wide as its heads happen to scatter: aiming a little lower spares a round.
constexpr double kAim = 0.95;

// The luminance of an image's channels PREFIX.R .G .B.
class LightOf {
  public:
    LightOf(const Image& image, const std::string& prefix) : image_(image), first_(find(prefix + "R")) {
        assert(find(prefix + "G") == first_ + 1 && find(prefix + "B") == first_ + 2);
    }
    double operator()(std::size_t pixel) const {
        const float* rgb = &image_.data[pixel * image_.channels.size() + first_];
        return double{luminance(Rgb(rgb[0], rgb[1], rgb[2]))};
    }

  private:
    std::size_t find(const std::string& channel) const { return find_channel(image_, channel).value(); }

    const Image& image_;
    std::size_t first_;
};

// Of a surface whose points are done.
void sum_up(SurfaceIlluminance& done) {
    double mean = 0, variance = 0;
    done.direct = 0;
    const auto n = static_cast<double>(done.points.size());
    done.groups.assign(done.points.front().groups.size(), 0.0);
    for (const PointParts& point : done.points) {
        mean += point.all.value / n;
        variance += sqr(point.all.half_width / n);
        done.direct += point.direct / n;
        for (std::size_t g = 0; g < done.groups.size(); ++g) done.groups[g] += point.groups[g] / n;
    }
    done.mean = {mean, std::sqrt(variance)};
    const auto by_value = [](const PointParts& a, const PointParts& b) { return a.all.value < b.all.value; };
    const auto [least, greatest] = std::minmax_element(done.points.begin(), done.points.end(), by_value);
    done.least = least->all;
    done.greatest = greatest->all;
    if (!(mean > 0)) return;
    // Of a ratio of two estimates to first order, as if they did not depend on each other: of many points the
    // least one is little of the mean.
    const double u0 = done.least.value / mean;
    done.uniformity = {u0, std::hypot(done.least.half_width, u0 * done.mean.half_width) / mean};
}

// The surfaces' points as the pixels of an image, and back.
class PointImage {
  public:
    PointImage(std::span<const CalculationSurface> surfaces, Job& job) : surfaces_(surfaces) {
        Receivers& receivers = job.receivers;
        for (const CalculationSurface& surface : surfaces) {
            for (int y = 0; y < surface.points.y; ++y) {
                for (int x = 0; x < surface.points.x; ++x) {
                    receivers.points.push_back(placed(surface.receiver(x, y), job.scene));
                }
            }
        }
        const auto points = static_cast<std::int64_t>(receivers.points.size());
        receivers.heads =
            kLeastHeads * static_cast<int>(std::max<std::int64_t>(1, kLeastPixels / kLeastHeads / points));
        heads_ = receivers.heads;
        FilmSettings film;
        film.width = kWidth;
        film.height = static_cast<int>((points * heads_ + kWidth - 1) / kWidth);
        film.parts = true;
        film.chance = has_chance_light(job.scene);
        job.film = film;
    }

    int heads() const { return heads_; }
    // Of each point, what its paths met by chance.
    std::vector<ChanceLight> met_by_chance(const Image& chance) const {
        const LightOf met(chance, "");
        std::vector<ChanceLight> points;
        const std::size_t pixels = chance.data.size() / chance.channels.size();
        for (std::size_t pixel = 0; pixel < pixels;) {
            RunningStats heads;
            for (int h = 0; h < heads_ && pixel < pixels; ++h, ++pixel) heads.add(met(pixel));
            points.push_back({heads.mean(), heads.standard_error()});
        }
        return points;
    }
    std::vector<SurfaceIlluminance> read(const RenderResult& result,
                                         const std::vector<std::string>& groups) const {
        const Image& parts = result.parts.value();
        const LightOf all(result.image, ""),
            direct(parts, std::string(light_part_name(LightPart::direct)) + ".");
        // As their own sums: a difference would leave the rounding of what it takes off.
        std::vector<LightOf> others;
        for (const LightPart part : {LightPart::indirect, LightPart::caustic, LightPart::media})
            others.emplace_back(parts, std::string(light_part_name(part)) + ".");
        std::vector<LightOf> by_group;
        for (const std::string& name : groups) by_group.emplace_back(parts, kLightGroupPrefix + name + ".");
        std::vector<SurfaceIlluminance> read;
        std::size_t pixel = 0;
        for (const CalculationSurface& surface : surfaces_) {
            SurfaceIlluminance& done = read.emplace_back();
            done.surface = surface;
            for (std::size_t i = 0; i < surface.size(); ++i) {
                RunningStats heads, indirect;
                PointParts point;
                point.groups.resize(groups.size());
                for (int h = 0; h < heads_; ++h, ++pixel) {
                    heads.add(all(pixel));
                    double not_direct = 0;
                    for (const LightOf& part : others) not_direct += part(pixel);
                    indirect.add(not_direct);
                    point.direct += direct(pixel) / heads_;
                    for (std::size_t g = 0; g < groups.size(); ++g)
                        point.groups[g] += by_group[g](pixel) / heads_;
                }
                point.all = reading_95(heads);
                point.indirect = reading_95(indirect);
                done.points.push_back(std::move(point));
            }
            sum_up(done);
        }
        return read;
    }

  private:
    std::span<const CalculationSurface> surfaces_;
    int heads_ = 1;
};

double worst_of(const std::vector<SurfaceIlluminance>& surfaces) {
    double worst = 0;
    for (const SurfaceIlluminance& surface : surfaces) {
        for (const PointParts& point : surface.points) {
            if (point.all.half_width > 0)
                worst = std::max(worst, point.all.half_width / std::max(point.all.value, surface.mean.value));
        }
    }
    return worst;
}

// The radius over which light paths are blurred around a point: half of the distance of a surface's points,
// but no more than a share of how far the point sees in the median direction of a few.
float blur_of(const CalculationSurface& surface, const Receiver& receiver, const Scene& scene) {
    constexpr double kOfSight = 0.05;
    constexpr int kDirections = 31;
    const auto size = static_cast<double>(diagonal(scene));
    const V3f from = V3f(receiver.position - scene.origin()) + receiver.off;
    std::vector<double> sight;
    Sampler sampler(0, Purpose::receiver, 0, 0);
    for (int i = 0; i < kDirections; ++i) {
        const V3f d = face_forward(square_to_sphere(sampler.next2()), receiver.normal);
        const auto hit = scene.intersect(Ray{from, d});
        sight.push_back(hit ? double{hit->t} : size);
    }
    std::nth_element(sight.begin(), sight.begin() + kDirections / 2, sight.end());
    const double reach = std::min(kOfSight * sight[kDirections / 2], size);
    const V3d u = surface.u / surface.points.x, v = surface.v / surface.points.y;
    const double spacing = std::max(u.length(), v.length()) / 2;
    return static_cast<float>(spacing > reach / 4 ? std::min(spacing, reach) : reach);
}

// Widens the intervals of points that light reaches over specular surfaces without any of their paths having
// met it, and says so.
void cross_check(std::vector<SurfaceIlluminance>& surfaces, const PointImage& points, const Image& chance,
                 const Job& job, const std::string& unit, const IlluminanceOptions& options,
                 Monitor& monitor) {
    constexpr double kStandardErrors = 4;  // there are many points
    constexpr double kStandardErrorsApart = 2;
    constexpr double kLeastWarned = 0.001;  // of the mean
    std::vector<float> radii;
    for (const SurfaceIlluminance& surface : surfaces) {
        for (std::size_t i = 0; i < surface.points.size(); ++i)
            radii.push_back(blur_of(surface.surface, job.receivers.points[radii.size()], job.scene));
    }
    const auto* path = std::get_if<PathSettings>(&job.integrator);
    const ChanceLightWork work{job.scene, options.seed, most_bounces(path ? path->max_depth : 0),
                               options.workers, monitor};
    std::vector<double> enough;
    for (const SurfaceIlluminance& surface : surfaces) {
        for (const PointParts& of_point : surface.points) enough.push_back(of_point.all.half_width / 4);
    }
    const std::vector<ChanceLight> there = chance_light_at(job.receivers.points, radii, enough, work);
    const std::vector<ChanceLight> met = points.met_by_chance(chance);
    std::size_t point = 0;
    for (SurfaceIlluminance& surface : surfaces) {
        const auto n = static_cast<double>(surface.points.size());
        std::vector<double> missing(surface.points.size());
        ChanceLight all_there, all_met;
        for (double& of_point : missing) {
            of_point = missing_light(there[point], met[point], kStandardErrors);
            all_there.value += there[point].value / n;
            all_there.standard_error += there[point].standard_error / n;  // paths pass several points
            all_met.value += met[point].value / n;
            all_met.standard_error = std::hypot(all_met.standard_error, met[point].standard_error / n);
            ++point;
        }
        surface.missing = missing_light(all_there, all_met, kStandardErrors);
        for (std::size_t i = 0; i < missing.size(); ++i) {
            Reading95& all = surface.points[i].all;
            all.half_width += missing[i];
            surface.points[i].indirect.half_width += missing[i];
        }
        const double mean = surface.mean.value;
        double half_width = surface.mean.half_width + surface.missing;
        // Where lamps are met seldom, their few meetings scatter more than they tell of themselves.
        const double apart = std::fabs(all_there.value - all_met.value);
        const bool known = all_there.value > kStandardErrors * all_there.standard_error;
        if (known && apart > kStandardErrorsApart * all_there.standard_error)
            half_width = std::max(half_width, apart);
        if (missing.size() == 1) surface.points[0].all.half_width = half_width;
        sum_up(surface);
        surface.mean = {mean, half_width};
        if (!(surface.missing > kLeastWarned * mean)) continue;
        monitor.warn(fmt::format(
            "surface \"{}\": about {:.3g} {} are missing in the mean, beside the {:.4g} {} that were found: "
            "light that comes over mirrors, lenses or solid glass from lamps that are too small for path "
            "tracing to meet. A cross-check by light paths found it; the intervals are wide enough to hold "
            "it",
            plain_text(surface.surface.name), surface.missing, unit, mean, unit));
    }
}

}  // namespace

std::vector<LuminairePlace> luminaires_of(const Scene& scene) {
    std::vector<LuminairePlace> all;
    for (const auto& light : scene.lights()) {
        const auto bounds = light->bounds();
        if (!bounds || !(light->power() > 0)) continue;
        const bool one_sided = !bounds->two_sided && bounds->theta_o + bounds->theta_e < 0.75F * kPi;
        all.push_back({.kind = std::string(light->kind()),
                       .file = light->file().filename().string(),
                       .place = V3d(bounds->box.center()) + scene.origin(),
                       .axis = one_sided ? V3d(bounds->axis) : V3d(0),
                       .flux = light->power()});
    }
    return all;
}

// Cornish and Fisher's expansion around the normal quantile: to 1e-4 from 16 values on.
double student_95(std::uint64_t n) {
    constexpr double z = kStandardErrors95;
    if (n < 2) return std::numeric_limits<double>::infinity();
    if (n == 2) return 12.706204736432095;
    const double v = static_cast<double>(n - 1), z2 = z * z;
    return z + z * (z2 + 1) / (4 * v) + z * ((5 * z2 + 16) * z2 + 3) / (96 * v * v) +
           z * (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * v * v * v);
}

Reading95 reading_95(const RunningStats& values) {
    return {values.mean(), student_95(values.count()) * values.standard_error()};
}

IlluminanceReport illuminance_on(std::span<const CalculationSurface> surfaces, Job job,
                                 const IlluminanceOptions& options, Monitor& monitor) {
    if (surfaces.empty()) throw InputError("there is no calculation surface");
    const std::optional<FluxUnit> unit = scene_unit(job.scene);
    if (!unit) {
        throw InputError(
            "some lights of the scene are in W and some in lm, and their illuminances cannot be added; state "
            "Option \"string unit\" \"photometric\" in the scene, or use --unit photometric");
    }
    const Stopwatch clock;
    const PointImage points(surfaces, job);

    IlluminanceReport report;
    report.groups = job.scene.light_groups().names;
    report.unit = unit_text(Quantity::illuminance, unit);
    report.flux_unit = flux_unit_text(unit);
    report.heads = points.heads();
    report.lamps = luminaires_of(job.scene);
    const bool counts = options.most_samples > 0;
    PathRounds rounds(job, Quantity::illuminance,
                      counts ? options.most_samples : std::max(kFirstOfHead, kFirstOfPoint / report.heads),
                      options.seed, options.workers, options.seconds);
    RenderResult result;
    for (;;) {
        result = rounds.render(monitor);
        if (result.report.samples_done == 0) throw Stopped("ended before every point had a sample");
        report.surfaces = points.read(result, report.groups);
        report.precision = worst_of(report.surfaces);
        report.samples = result.report.samples_done;
        report.rays = job.scene.rays();
        report.ended_by = !result.report.complete                 ? "user"
                          : report.samples < job.spp              ? "time"
                          : counts                                ? "samples"
                          : report.precision <= options.precision ? "precision"
                                                                  : "";
        if (report.ended_by.empty() &&
            !rounds.is_worth_going_on(report.precision, options.precision, monitor))
            report.ended_by = "forecast";
        if (!report.ended_by.empty()) break;
        rounds.grow(report.precision / (kAim * options.precision), kNoEndOfSamples);
    }
    if (result.chance && report.ended_by != "user") {
        cross_check(report.surfaces, points, *result.chance, job, report.unit, options, monitor);
        report.precision = worst_of(report.surfaces);
        if (report.ended_by == "precision" && report.precision > options.precision)
            report.ended_by = "missing light";
    }
    report.seconds = clock.seconds();
    return report;
}

}  // namespace lucerna
