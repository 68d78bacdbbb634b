#include "engine/photometry/illuminance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/photometry/path_rounds.h"
#include "engine/render/chance_light.h"
#include "engine/scene/path_account.h"
#include "engine/scene/quantity.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// A point has enough sensor replicas for a reliable interval, and an image enough pixels for tiles for all
// threads.
constexpr int kLeastSensors = 16;
constexpr std::int64_t kLeastPixels = 16384;
constexpr int kWidth = 256;
// The first round takes so many samples over all replicas of a point, so that its interval is meaningful, and
// at least so many per replica.
constexpr int kFirstOfPoint = 256, kFirstOfSensor = 4;
// Intervals scatter from round to round, so aiming a little below the wanted width often saves a round.
constexpr double kAim = 0.95;

// Returns the luminance of an image's channels PREFIX.R .G .B.
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

// Computes the mean, extremes and uniformity of a surface whose points are done.
void sum_up(SurfaceIlluminance& done) {
    double mean = 0, variance = 0;
    done.direct = 0;
    const auto n = static_cast<double>(done.points.size());
    done.groups.assign(done.points.front().groups.size(), 0.0);
    for (const PointIlluminance& point : done.points) {
        mean += point.all.value / n;
        variance += sqr(point.all.half_width / n);
        done.direct += point.direct / n;
        for (std::size_t g = 0; g < done.groups.size(); ++g) done.groups[g] += point.groups[g] / n;
    }
    done.mean = {mean, std::sqrt(variance)};
    const auto by_value = [](const PointIlluminance& a, const PointIlluminance& b) {
        return a.all.value < b.all.value;
    };
    const auto [least, greatest] = std::minmax_element(done.points.begin(), done.points.end(), by_value);
    done.least = least->all;
    done.greatest = greatest->all;
    if (!(mean > 0)) return;
    // The uncertainty of the ratio is taken to first order, as if its two estimates were independent: among
    // many points the darkest contributes little to the mean.
    const double u0 = done.least.value / mean;
    done.uniformity = {u0, hypot(done.least.half_width, u0 * done.mean.half_width) / mean};
}

// Light of a point that paths find by chance alone (SampleAccount::by_chance), and the rest of the light.
struct ChanceAtPoint {
    ChanceLight met;
    std::vector<double> groups;  // chance light by light group of the scene
    Reading95 rest, rest_indirect;
};

// Half-widths that more samples reduce.
struct PointScatter {
    double all, indirect;
};

struct Readings {
    std::vector<SurfaceIlluminance> surfaces;
    // Both list the points of all surfaces. `chance` is empty where no light is found by chance.
    std::vector<PointScatter> scatter;
    std::vector<ChanceAtPoint> chance;
};

// Maps the points of surfaces to the pixels of an image and back.
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
        receivers.sensors = kLeastSensors * static_cast<int>(std::max<std::int64_t>(
                                                1, kLeastPixels / kLeastSensors / points));
        sensors_ = receivers.sensors;
        FilmSettings film;
        film.width = kWidth;
        film.height = static_cast<int>((points * sensors_ + kWidth - 1) / kWidth);
        film.parts = true;
        film.chance = has_chance_light(job.scene);
        job.film = film;
    }

    int sensors() const { return sensors_; }
    Readings read(const RenderResult& result, const std::vector<std::string>& groups) const {
        const Image& parts = result.parts.value();
        const LightOf all(result.image, ""), direct(parts, std::string(layer_name(Layer::direct)) + ".");
        // Adds up indirect light from layers, as a difference from all light would leave its rounding error.
        std::vector<LightOf> others;
        for (const Layer part : {Layer::indirect, Layer::caustic, Layer::media})
            others.emplace_back(parts, std::string(layer_name(part)) + ".");
        const LightOf caustic(parts, std::string(layer_name(Layer::caustic)) + ".");
        const std::vector<LightOf> by_group = lights_of(parts, groups);
        const auto chance =
            result.chance ? std::optional<LightOf>(LightOf(*result.chance, "")) : std::nullopt;
        const std::vector<LightOf> chance_by_group =
            chance ? lights_of(*result.chance, groups) : std::vector<LightOf>();
        Readings read;
        std::size_t pixel = 0;
        for (const CalculationSurface& surface : surfaces_) {
            SurfaceIlluminance& done = read.surfaces.emplace_back();
            done.surface = surface;
            for (std::size_t i = 0; i < surface.size(); ++i) {
                RunningStats sensors, indirect, rest, rest_indirect, met;
                PointIlluminance point;
                point.groups.resize(groups.size());
                ChanceAtPoint by_chance;
                by_chance.groups.resize(groups.size());
                for (int h = 0; h < sensors_; ++h, ++pixel) {
                    sensors.add(all(pixel));
                    double not_direct = 0;
                    for (const LightOf& part : others) not_direct += part(pixel);
                    indirect.add(not_direct);
                    point.direct += direct(pixel) / sensors_;
                    point.mirrored += caustic(pixel) / sensors_;
                    for (std::size_t g = 0; g < groups.size(); ++g)
                        point.groups[g] += by_group[g](pixel) / sensors_;
                    if (!chance) continue;
                    const double found = (*chance)(pixel);
                    met.add(found);
                    rest.add(reading_without(all(pixel), found));
                    rest_indirect.add(reading_without(not_direct, found));
                    for (std::size_t g = 0; g < groups.size(); ++g)
                        by_chance.groups[g] += chance_by_group[g](pixel) / sensors_;
                }
                point.all = reading_95(sensors);
                point.indirect = reading_95(indirect);
                read.scatter.push_back({point.all.half_width, point.indirect.half_width});
                done.points.push_back(std::move(point));
                if (!chance) continue;
                by_chance.met = {met.mean(), met.standard_error()};
                by_chance.rest = reading_95(rest);
                by_chance.rest_indirect = reading_95(rest_indirect);
                read.chance.push_back(std::move(by_chance));
            }
            sum_up(done);
        }
        return read;
    }

  private:
    static std::vector<LightOf> lights_of(const Image& image, const std::vector<std::string>& groups) {
        std::vector<LightOf> lights;
        for (const std::string& name : groups) lights.emplace_back(image, kLightGroupPrefix + name + ".");
        return lights;
    }
    // Returns `all` - `found`, or 0 where this is no more than single-precision rounding.
    static double reading_without(double all, double found) {
        constexpr double kRounding = 1e-5;
        const double rest = all - found;
        return rest > kRounding * all ? rest : 0.0;
    }

    std::span<const CalculationSurface> surfaces_;
    int sensors_ = 1;
};

double share_of(double half_width, const Reading95& point, const Reading95& mean) {
    return half_width > 0 ? half_width / std::max(point.value, mean.value) : 0.0;
}
double worst_of(const std::vector<SurfaceIlluminance>& surfaces) {
    double worst = 0;
    for (const SurfaceIlluminance& surface : surfaces) {
        for (const PointIlluminance& point : surface.points)
            worst = std::max(worst, share_of(point.all.half_width, point.all, surface.mean));
    }
    return worst;
}
// Returns the share of worst_of() for the half-widths that more samples reduce. With `indirect`, those of
// indirect light count, too, as shares of indirect light.
double worst_scatter_of(const Readings& readings, bool indirect) {
    double worst = 0;
    auto scatter = readings.scatter.begin();
    for (const SurfaceIlluminance& surface : readings.surfaces) {
        const Reading95 mean_indirect{surface.mean.value - surface.direct, 0};
        for (const PointIlluminance& point : surface.points) {
            worst = std::max(worst, share_of(scatter->all, point.all, surface.mean));
            if (indirect) worst = std::max(worst, share_of(scatter->indirect, point.indirect, mean_indirect));
            ++scatter;
        }
    }
    return worst;
}

// Returns the radius of the density estimate of light paths around a point: half of the spacing of a
// surface's points, but at most a share of the median distance to the surfaces that the point sees, and this
// share itself if half of the spacing is below a quarter of it.
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

// Estimates by light paths the light that the points' paths find by chance alone.
ChanceLightAt by_light_paths(const Readings& readings, const Job& job, const IlluminanceOptions& options,
                             Monitor& monitor) {
    std::vector<float> radii;
    std::vector<double> rest;
    for (const SurfaceIlluminance& surface : readings.surfaces) {
        for (std::size_t i = 0; i < surface.points.size(); ++i)
            radii.push_back(blur_of(surface.surface, job.receivers.points[radii.size()], job.scene));
    }
    for (const ChanceAtPoint& point : readings.chance)
        rest.push_back(options.indirect ? point.rest_indirect.value : point.rest.value);
    const auto* path = std::get_if<PathSettings>(&job.integrator);
    const ChanceLightWork work{job.scene, options.seed, most_bounces(path ? path->max_depth : 0),
                               options.workers, monitor};
    return chance_light_at(job.receivers.points, radii, rest, options.precision / 4, work);
}

// Adds the light paths' estimate, which replaces the light met by chance, with its own uncertainty.
Reading95 instead(const Reading95& rest, const ChanceLightAt::Mean& there) {
    return {rest.value + there.light.value,
            hypot(rest.half_width, kStandardErrors95 * there.light.standard_error) + there.blur};
}

// Replaces the light that a surface's paths find by chance with the estimate of light paths where it is more
// precise. Rare hits of a lamp do not reveal their variance, so their standard error counts only if they are
// many. Where neither estimate is reliable, the intervals cover both.
void take_from_light_paths(SurfaceIlluminance& surface, std::span<const ChanceAtPoint> chance,
                           std::span<PointScatter> scatter, const ChanceLightAt& there, std::size_t first) {
    constexpr double kTold = 4;   // standard errors by which the light paths' estimate differs from 0
    constexpr double kMany = 20;  // standard errors of the light met by chance: some 400 hits
    const std::size_t count = surface.points.size();
    const auto n = static_cast<double>(count);
    const ChanceLightAt::Mean of_surface = there.mean(first, count);
    ChanceLight met;
    double rest2 = 0;
    for (const ChanceAtPoint& point : chance) {
        met.value += point.met.value / n;
        met.standard_error = hypot(met.standard_error, point.met.standard_error / n);
        rest2 += sqr(point.rest.half_width / n);
    }
    const ChanceLight& light = of_surface.light;
    const bool many = met.value > kMany * met.standard_error;
    if (many && met.standard_error < light.standard_error + of_surface.blur) return;
    const auto open = [](const ChanceLight& by_light_paths, const ChanceLight& by_chance) {
        return std::max(
            0.0, by_light_paths.value + kStandardErrors95 * by_light_paths.standard_error - by_chance.value);
    };
    if (!(light.value > kTold * light.standard_error)) {
        if (many) return;
        for (std::size_t i = 0; i < count; ++i) {
            const double more = open(there.mean(first + i, 1).light, chance[i].met);
            surface.points[i].all.half_width += more;
            surface.points[i].indirect.half_width += more;
        }
        const double half_width = surface.mean.half_width + open(light, met);
        sum_up(surface);
        surface.mean.half_width = half_width;
        return;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const ChanceLightAt::Mean at_point = there.mean(first + i, 1);
        PointIlluminance& point = surface.points[i];
        point.all = instead(chance[i].rest, at_point);
        point.indirect = instead(chance[i].rest_indirect, at_point);
        point.mirrored = at_point.seen.value;
        for (std::size_t g = 0; g < point.groups.size(); ++g)
            point.groups[g] = std::max(0.0, point.groups[g] - chance[i].groups[g]) + at_point.groups[g];
        scatter[i] = {chance[i].rest.half_width, chance[i].rest_indirect.half_width};
    }
    surface.by_light_paths = light.value;
    surface.never_met = missing_light(light, met, kTold);
    sum_up(surface);
    // Light paths pass several points, whose errors are therefore not independent.
    surface.mean.half_width = instead({0, std::sqrt(rest2)}, of_surface).half_width;
}
void take_from_light_paths(Readings& readings, const ChanceLightAt& there) {
    std::size_t first = 0;
    for (SurfaceIlluminance& surface : readings.surfaces) {
        const std::size_t count = surface.points.size();
        take_from_light_paths(surface, std::span(readings.chance).subspan(first, count),
                              std::span(readings.scatter).subspan(first, count), there, first);
        first += count;
    }
}

// Warns of the surface with the greatest share of light that no path from a point met.
void warn_of_blurred_light(const std::vector<SurfaceIlluminance>& surfaces, const std::string& unit,
                           Monitor& monitor) {
    constexpr double kLeastWarned = 0.001;  // of the mean
    const auto share = [](const SurfaceIlluminance& surface) {
        return surface.never_met > 0 ? surface.never_met / surface.mean.value : 0.0;
    };
    const auto most = most_affected(surfaces, share, kLeastWarned);
    if (!most) return;
    monitor.warn(fmt::format(
        "\"{}\": of the mean of {:.4g} {}, {:.3g} {} come over mirrors, lenses or solid glass from lamps "
        "that are too small for path tracing to meet; light paths estimate them, blurred around each point{}",
        plain_text(most->surface->surface.name), most->surface->mean.value, unit,
        most->surface->by_light_paths, unit, most->others));
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

// Evaluates Cornish and Fisher's expansion around the normal quantile, accurate to 1e-4 from 16 values on.
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

std::optional<MostAffected> most_affected(std::span<const SurfaceIlluminance> surfaces,
                                          const std::function<double(const SurfaceIlluminance&)>& share,
                                          double least) {
    MostAffected most{nullptr, {}};
    double greatest = least;
    int affected = 0;
    for (const SurfaceIlluminance& surface : surfaces) {
        const double of_surface = share(surface);
        if (!(of_surface > least)) continue;
        ++affected;
        if (most.surface != nullptr && !(of_surface > greatest)) continue;
        greatest = of_surface;
        most.surface = &surface;
    }
    if (most.surface == nullptr) return std::nullopt;
    if (affected > 1)
        most.others = fmt::format("; the same holds for {} other{}", affected - 1, affected == 2 ? "" : "s");
    return most;
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
    report.sensors = points.sensors();
    report.lamps = luminaires_of(job.scene);
    const bool counts = options.most_samples > 0;
    PathRounds rounds(
        job, Quantity::illuminance,
        counts ? options.most_samples : std::max(kFirstOfSensor, kFirstOfPoint / report.sensors),
        options.seed, options.workers, options.seconds);
    std::optional<ChanceLightAt> there;
    for (;;) {
        const RenderResult result = rounds.render(monitor);
        if (result.report.samples_done == 0) throw Stopped("ended before every point had a sample");
        Readings readings = points.read(result, report.groups);
        if (result.chance && !there) there = by_light_paths(readings, job, options, monitor);
        if (there) take_from_light_paths(readings, *there);
        const double scatter = worst_scatter_of(readings, options.indirect);
        report.surfaces = std::move(readings.surfaces);
        report.precision = worst_of(report.surfaces);
        report.samples = result.report.samples_done;
        report.rays = job.scene.rays();
        report.ended_by = !result.report.complete        ? "user"
                          : report.samples < job.spp     ? "time"
                          : counts                       ? "samples"
                          : scatter <= options.precision ? "precision"
                                                         : "";
        if (report.ended_by.empty() && !rounds.is_worth_going_on(scatter, options.precision, monitor))
            report.ended_by = "forecast";
        if (!report.ended_by.empty()) break;
        rounds.grow(scatter / (kAim * options.precision), kNoEndOfSamples);
    }
    if (report.ended_by == "precision" && report.precision > options.precision)
        report.ended_by = "light paths";  // more samples would not improve the light paths' estimate
    warn_of_blurred_light(report.surfaces, report.unit, monitor);
    report.seconds = clock.seconds();
    return report;
}

}  // namespace lucerna
