#include "engine/photometry/illuminance.h"

#include <Imath/ImathBoxAlgo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/base/deadline_monitor.h"
#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/photometry/cut_off_points.h"
#include "engine/photometry/light_paths_at.h"
#include "engine/photometry/path_rounds.h"
#include "engine/render/chance_light.h"
#include "engine/scene/path_account.h"
#include "engine/scene/quantity.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr float kOffLamp = 0.01F;  // m, beyond a lamp's bounds

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
// The share of the time for the first round, where light paths follow it, and the share that is too little
// for another round.
constexpr double kFirstShare = 0.4, kLeastLeft = 0.02;

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

// Tells which points of the surfaces are cut off from the light.
std::vector<bool> cut_off_from(const std::vector<SurfaceIlluminance>& surfaces, const Job& job,
                               std::uint64_t seed, const Workers& workers) {
    std::vector<bool> cut_off;
    for (const SurfaceIlluminance& surface : surfaces) {
        std::vector<double> all, direct;
        for (const PointIlluminance& point : surface.points) {
            all.push_back(point.all.value);
            direct.push_back(point.direct);
        }
        const auto receivers = std::span(job.receivers.points).subspan(cut_off.size(), all.size());
        std::vector<bool> of_surface = cut_off_points(job.scene, receivers, all, direct, seed, workers);
        for (std::size_t i = 0; i < surface.surface.excluded.size(); ++i)
            of_surface[i] = of_surface[i] || surface.surface.excluded[i];
        cut_off.insert(cut_off.end(), of_surface.begin(), of_surface.end());
    }
    return cut_off;
}
// Marks these points, and sums up their surfaces again.
void leave_out(const std::vector<bool>& cut_off, std::vector<SurfaceIlluminance>& surfaces) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    auto is_cut_off = cut_off.begin();
    for (SurfaceIlluminance& surface : surfaces) {
        const std::vector<double> groups(surface.groups.size(), kNone);
        for (PointIlluminance& point : surface.points)
            if (*is_cut_off++) point = {{kNone, kNone}, kNone, {kNone, kNone}, kNone, groups};
        if (surface.cut_off() > 0) sum_up(surface);
    }
}

// Light of a point that paths find by chance alone (SampleAccount::by_chance), and the rest of the light.
struct ChanceAtPoint {
    ChanceLight met;
    std::vector<double> groups;  // chance light by light group of the scene
    Reading95 rest, rest_indirect;
};

// Half-widths that more paths from a point reduce, and one that more light paths reduce.
struct PointScatter {
    double all, indirect, light = 0;
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
        place_sensors(surfaces, job);
        sensors_ = job.receivers.sensors;
        job.film.chance = has_chance_light(job.scene);
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
// Returns the greater of a point's half-widths relative to its light, as in worst_of(), and, with `indirect`,
// relative to its indirect light.
double share_of(double of_all, double of_indirect, const PointIlluminance& point,
                const SurfaceIlluminance& surface, bool indirect) {
    const double share = share_of(of_all, point.all, surface.mean);
    const Reading95 mean_indirect{surface.mean.value - surface.direct, 0};
    return indirect ? std::max(share, share_of(of_indirect, point.indirect, mean_indirect)) : share;
}
// Returns the greatest share for the half-widths that more samples reduce.
double worst_scatter_of(const Readings& readings, bool indirect) {
    double worst = 0;
    auto scatter = readings.scatter.begin();
    for (const SurfaceIlluminance& surface : readings.surfaces) {
        for (const PointIlluminance& point : surface.points) {
            worst = std::max(worst, share_of(scatter->all, scatter->indirect, point, surface, indirect));
            ++scatter;
        }
    }
    return worst;
}

// Returns each point's share for the half-width that more light paths reduce.
std::vector<double> light_errors_of(const Readings& readings, bool indirect) {
    std::vector<double> errors;
    for (const SurfaceIlluminance& surface : readings.surfaces) {
        for (const PointIlluminance& point : surface.points) {
            const double light = readings.scatter[errors.size()].light;
            errors.push_back(share_of(light, light, point, surface, indirect));
        }
    }
    return errors;
}
double worst_light_of(const Readings& readings, bool indirect) {
    return std::ranges::max(light_errors_of(readings, indirect));
}

// Returns half of the greater distance between neighbouring points.
double half_spacing(const CalculationSurface& surface) {
    return std::max(surface.u.length() / surface.points.x, surface.v.length() / surface.points.y) / 2;
}

// Returns the distances around a point for light paths. The radius of the density estimate is half of the
// spacing of a surface's points, but at most a share of the median distance to the surfaces that the point
// sees (the scene's size where it sees nothing), and this share itself if half of the spacing is below a
// quarter of it.
LightPathsAt::Reach reach_of(const CalculationSurface& surface, const Receiver& receiver,
                             const Scene& scene) {
    constexpr double kOfSight = 0.05, kNearOfSight = 0.2;
    constexpr int kDirections = 31;
    const V3f from = ray_origin(receiver, scene);
    // Where nothing is seen, the light comes from within the scene, which the point may lie outside of.
    const double size = double{diagonal(scene)} + double{(from - Imath::clip(from, scene.bounds())).length()};
    std::vector<double> sight;
    Sampler sampler(0, Purpose::receiver, 0, 0);
    for (int i = 0; i < kDirections; ++i) {
        const V3f d = face_forward(square_to_sphere(sampler.next2()), receiver.normal);
        const auto hit = scene.intersect(Ray{from, d});
        sight.push_back(hit ? double{hit->t} : size);
    }
    std::nth_element(sight.begin(), sight.begin() + kDirections / 2, sight.end());
    const double seen = std::min(sight[kDirections / 2], size), reach = kOfSight * seen;
    const double spacing = half_spacing(surface);
    const double radius = spacing > reach / 4 ? std::min(spacing, reach) : reach;
    return {static_cast<float>(radius), static_cast<float>(std::max(radius, spacing / 2)),
            static_cast<float>(kNearOfSight * seen)};
}

double half_width_of(const ChanceLight& by_light_paths) {
    return student_95(LightPathsAt::kBatches) * by_light_paths.standard_error;
}
// Adds the light paths' estimate, which replaces the light met by chance, with its own uncertainty.
Reading95 instead(const Reading95& rest, const LightPathsAt::Mean& there) {
    return {rest.value + there.light.value, hypot(rest.half_width, half_width_of(there.light)) + there.blur};
}

// The light that a surface's paths find by chance, and the rest.
struct ChanceAtSurface {
    ChanceLight met;
    double rest = 0;  // half-width of the rest
};
ChanceAtSurface at_surface(std::span<const ChanceAtPoint> points, const SurfaceIlluminance& of) {
    const auto n = static_cast<double>(points.size() - of.cut_off());
    ChanceAtSurface surface;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (of.points[i].is_cut_off()) continue;
        const ChanceAtPoint& point = points[i];
        surface.met.value += point.met.value / n;
        surface.met.standard_error = hypot(surface.met.standard_error, point.met.standard_error / n);
        surface.rest = hypot(surface.rest, point.rest.half_width / n);
    }
    return surface;
}

// Replaces the light that a point's paths find by chance with the estimate of light paths.
void take_from_light_paths(PointIlluminance& point, const ChanceAtPoint& chance, PointScatter& scatter,
                           const LightPathsAt::Mean& there) {
    point.all = instead(chance.rest, there);
    point.indirect = instead(chance.rest_indirect, there);
    point.mirrored = there.seen.value;
    for (std::size_t g = 0; g < point.groups.size(); ++g)
        point.groups[g] = std::max(0.0, point.groups[g] - chance.groups[g]) + there.groups[g];
    scatter = {chance.rest.half_width, chance.rest_indirect.half_width,
               half_width_of(there.light) + there.blur - there.lasting_blur};
}

// Takes the light that paths find by chance from light paths, but for points where those paths know it
// better. Rare hits of a lamp do not reveal their variance, so their standard error counts only if they are
// many.
void take_from_light_paths(SurfaceIlluminance& surface, std::span<const ChanceAtPoint> chance,
                           std::span<PointScatter> scatter, const LightPathsAt& there, std::size_t first) {
    constexpr double kTold = 4;   // standard errors by which the light paths' estimate differs from 0
    constexpr double kMany = 20;  // standard errors of the light met by chance: some 400 hits
    const auto count = static_cast<double>(surface.points.size() - surface.cut_off());
    double apart = 0;  // half-width of the mean by points that paths alone know best
    std::vector<std::size_t> all, taken;
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
        PointIlluminance& point = surface.points[i];
        if (point.is_cut_off()) {
            scatter[i] = {};
            continue;
        }
        const std::size_t receiver = first + i;
        all.push_back(receiver);
        const LightPathsAt::Mean at_point = there.mean(std::span(&receiver, 1));
        const ChanceLight& met = chance[i].met;
        if (met.value > kMany * met.standard_error &&
            kStandardErrors95 * met.standard_error < half_width_of(at_point.light) + at_point.blur) {
            apart = hypot(apart, point.all.half_width / count);
        } else {
            take_from_light_paths(point, chance[i], scatter[i], at_point);
            taken.push_back(receiver);
        }
    }
    sum_up(surface);
    const auto [met, rest] = at_surface(chance, surface);
    surface.never_met = missing_light(there.mean(all).light, met, kTold);
    if (taken.empty()) return;
    // Light paths pass several points, whose errors are therefore not independent.
    const LightPathsAt::Mean of_taken = there.mean(taken);
    const double share = static_cast<double>(taken.size()) / count;
    surface.by_light_paths = share * of_taken.light.value;
    surface.blur = share * of_taken.blur;
    surface.mean.half_width = hypot(apart, hypot(rest, share * half_width_of(of_taken.light))) + surface.blur;
}
void take_from_light_paths(Readings& readings, const LightPathsAt& there) {
    std::size_t first = 0;
    for (SurfaceIlluminance& surface : readings.surfaces) {
        const std::size_t count = surface.points.size();
        take_from_light_paths(surface, std::span(readings.chance).subspan(first, count),
                              std::span(readings.scatter).subspan(first, count), there, first);
        first += count;
    }
}

// Traces light paths until they know the light that paths from the points find by chance alone as well as
// those know the rest.
class LightPathRounds {
  public:
    // `job` must outlive this object, and its receivers must be those of the surfaces.
    LightPathRounds(std::span<const CalculationSurface> surfaces, const Job& job,
                    const IlluminanceOptions& options, const Stopwatch& clock, Monitor& monitor)
        : options_(options), clock_(clock), monitor_(monitor, Deadline::after(options.seconds)) {
        std::vector<LightPathsAt::Reach> reaches;
        for (const CalculationSurface& surface : surfaces) {
            for (std::size_t i = 0; i < surface.size(); ++i)
                reaches.push_back(reach_of(surface, job.receivers.points[reaches.size()], job.scene));
        }
        const auto* path = std::get_if<PathSettings>(&job.integrator);
        there_.emplace(job.receivers.points, reaches,
                       ChanceLightWork{job.scene, options.seed, most_bounces(path ? path->max_depth : 0),
                                       options.workers, monitor_});
    }

    // Adds the light paths' estimate to readings of paths from the points.
    Readings completed(const Readings& readings) {
        turn_ends_at_ = options_.seconds;
        if (there_->paths() == 0 && !trace(2 * LightPathsAt::kLeastRound)) return readings;
        for (;;) {
            while (!there_->has_found() && there_->paths() < kBeforeNone) {
                if (!learned_ && is_affordable() && !learn(readings)) return readings;
                if (!trace(std::max(there_->paths(), 2 * LightPathsAt::kLeastRound))) return readings;
            }
            Readings now = readings;
            if (!there_->has_found()) return now;
            take_from_light_paths(now, *there_);
            const double light = worst_light_of(now, options_.indirect),
                         scatter = worst_scatter_of(now, options_.indirect);
            const double wanted = std::max(scatter, kShare * options_.precision);
            if (light <= wanted || clock_.seconds() >= turn_ends_at_) return now;
            limit_turn(light, scatter);
            if (focused_ < kFocused && is_affordable()) {
                ++focused_;
                if (!learned_ && !learn(readings)) return now;
                if (!there_->focus(light_errors_of(now, options_.indirect))) return now;
                if (!trace(2 * LightPathsAt::kLeastRound)) return now;
                continue;
            }
            const double growth = std::clamp(sqr(light / (kAim * wanted)) - 1, 1.0, 3.0);
            if (!trace(static_cast<std::int64_t>(growth * static_cast<double>(there_->paths())))) return now;
        }
    }
    // Returns the share of a limited time for light paths, by the variances at the least accurate points. It
    // is bounded, so that one point, which light paths hardly reach, does not take the time of all.
    static double share_of_light(double light, double scatter) {
        constexpr double kMost = 0.6;
        return std::min(kMost, sqr(light) / (sqr(light) + sqr(scatter)));
    }
    bool have_run() const { return there_->paths() > 0; }
    // Whether no more paths can be traced.
    bool are_over() const { return are_over_; }
    // Paths that find nothing before it is taken that there is nothing to find.
    static constexpr std::int64_t kBeforeNone = 1 << 20;
    // The least half-width to which they are traced, as a share of the wanted precision.
    static constexpr double kShare = 0.5;

  private:
    // Where paths from the points must become more precise, too, they get their share of a limited time: the
    // time is divided by the variances of both.
    void limit_turn(double light, double scatter) {
        if (!std::isfinite(options_.seconds) || turn_ends_at_ < options_.seconds ||
            scatter <= kAim * options_.precision)
            return;
        const double now = clock_.seconds();
        turn_ends_at_ = now + (options_.seconds - now) * share_of_light(light, scatter);
    }
    // Returns false if the monitor stopped it.
    bool learn(const Readings& readings) {
        learned_ = true;
        std::vector<double> rest;
        for (const ChanceAtPoint& point : readings.chance)
            rest.push_back(options_.indirect ? point.rest_indirect.value : point.rest.value);
        return there_->learn(rest);
    }
    // Whether there is time for learning, which loses the paths traced so far.
    bool is_affordable() const {
        constexpr double kPaths = 1 << 20;  // about as many as all pilots and their rounds
        const double left = options_.seconds - clock_.seconds();
        return left > 2 * seconds_ / static_cast<double>(there_->paths()) * kPaths;
    }
    // Returns false if no more paths can be traced.
    bool trace(std::int64_t wanted) {
        constexpr std::int64_t kMostUntimed = 1 << 22;
        const double left = turn_ends_at_ - clock_.seconds();
        if (options_.most_samples > 0 || !std::isfinite(left)) {
            wanted = std::min(wanted, kMostUntimed - there_->paths());
        } else if (there_->paths() > 0) {
            const double paths_left = left / seconds_ * static_cast<double>(there_->paths());
            if (paths_left < static_cast<double>(wanted))
                wanted = static_cast<std::int64_t>(0.9 * paths_left);
        }
        const Stopwatch watch;
        const bool goes_on = wanted >= LightPathsAt::kLeastRound && there_->trace(wanted) > 0;
        are_over_ = !goes_on && turn_ends_at_ >= options_.seconds;
        seconds_ += watch.seconds();
        return goes_on;
    }

    const IlluminanceOptions& options_;
    const Stopwatch& clock_;
    DeadlineMonitor monitor_;
    std::optional<LightPathsAt> there_;
    double seconds_ = 0;  // > 0 when paths are traced
    double turn_ends_at_ = 0;
    static constexpr int kFocused = 3;
    int focused_ = 0;
    bool learned_ = false;
    bool are_over_ = false;
};

void warn_without_light_paths(Monitor& monitor) {
    monitor.warn(
        "the time is too short for light paths, so the intervals do not include light that comes over "
        "mirrors, lenses or solid glass from lamps that are too small for path tracing to meet; --time sets "
        "how long the computation may take");
}

// Warns of the surface with the greatest share of light that is blurred.
void warn_of_blurred_light(const std::vector<SurfaceIlluminance>& surfaces, double precision,
                           const std::string& unit, Monitor& monitor) {
    const auto share = [](const SurfaceIlluminance& surface) {
        return surface.blur > 0 ? surface.blur / surface.mean.value : 0.0;
    };
    const auto most = most_affected(surfaces, share, precision);
    if (!most) return;
    monitor.warn(fmt::format(
        "\"{}\": of the mean of {:.4g} {}, {:.3g} {} come over mirrors, lenses or solid glass from lamps "
        "that are too small for path tracing to meet; light paths estimate them, blurred by up to {:.2g} "
        "{}{}",
        plain_text(most->surface->surface.name), most->surface->mean.value, unit,
        most->surface->by_light_paths, unit, most->surface->blur, unit, most->others));
}

// Returns the pieces of a light that do not touch each other, such as the panels of one mesh, by the bounds
// of its parts, whose powers are shares. A light without parts is one piece.
std::vector<LightBounds> pieces_of(LightBounds whole, std::span<const LightBounds> parts) {
    constexpr float kTouching = 1e-3F;  // m
    whole.power = 1;
    if (parts.size() < 2) return {whole};
    std::vector<std::size_t> order(parts.size()), root(parts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::iota(root.begin(), root.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return parts[i].box.min.x; });
    const auto root_of = [&](std::size_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    std::vector<std::size_t> reaching;  // the parts before that reach the place of the next one along x
    for (const std::size_t i : order) {
        Box3f box = parts[i].box;
        box.min -= V3f(kTouching);
        box.max += V3f(kTouching);
        std::erase_if(reaching, [&](std::size_t j) { return parts[j].box.max.x < box.min.x; });
        for (const std::size_t j : reaching) {
            if (parts[j].box.intersects(box)) root[root_of(j)] = root_of(i);
        }
        reaching.push_back(i);
    }
    std::map<std::size_t, std::vector<LightBounds>> pieces;
    for (std::size_t i = 0; i < parts.size(); ++i) pieces[root_of(i)].push_back(parts[i]);
    std::vector<LightBounds> all;
    for (const auto& [index, of] : pieces) {
        all.push_back(union_of(of));
        all.back().two_sided = whole.two_sided;
    }
    return all;
}

// Returns where the axis of a lamp meets the first surface that is not part of the lamp.
std::optional<V3d> aim_of(const Scene& scene, const LightBounds& lamp) {
    const V3f centre = lamp.box.center();
    const float beyond = 0.5F * lamp.box.size().length() + kOffLamp;
    const auto hit = scene.intersect(Ray{centre + beyond * lamp.axis, lamp.axis});
    if (!hit) return std::nullopt;
    return V3d(centre) + double{beyond + hit->t} * V3d(lamp.axis) + scene.origin();
}

}  // namespace

void sum_up(SurfaceIlluminance& done) {
    double mean = 0, variance = 0;
    done.direct = 0;
    const auto n = static_cast<double>(done.points.size() - done.cut_off());
    done.groups.assign(done.points.front().groups.size(), 0.0);
    const PointIlluminance *least = nullptr, *greatest = nullptr;
    for (const PointIlluminance& point : done.points) {
        if (point.is_cut_off()) continue;
        mean += point.all.value / n;
        variance += sqr(point.all.half_width / n);
        done.direct += point.direct / n;
        for (std::size_t g = 0; g < done.groups.size(); ++g) done.groups[g] += point.groups[g] / n;
        if (least == nullptr || point.all.value < least->all.value) least = &point;
        if (greatest == nullptr || !(point.all.value < greatest->all.value)) greatest = &point;
    }
    done.mean = {mean, std::sqrt(variance)};
    done.least = done.greatest = done.uniformity = {};
    if (least == nullptr) return;
    done.least = least->all;
    done.greatest = greatest->all;
    if (!(mean > 0)) return;
    // The uncertainty of the ratio is taken to first order, as if its two estimates were independent: among
    // many points the darkest contributes little to the mean.
    const double u0 = done.least.value / mean;
    done.uniformity = {u0, hypot(done.least.half_width, u0 * done.mean.half_width) / mean};
}

std::vector<LuminairePlace> luminaires_of(const Scene& scene) {
    std::vector<LuminairePlace> all;
    for (std::size_t i = 0; i < scene.lights().size(); ++i) {
        const Light& light = *scene.lights()[i];
        const auto bounds = light.bounds();
        if (!bounds || !(light.power() > 0)) continue;
        for (const LightBounds& lamp : pieces_of(*bounds, light.part_bounds())) {
            // A photometric file has a direction of its own, to however many sides it shines.
            const bool one_sided = !lamp.two_sided && lamp.theta_o + lamp.theta_e < 0.75F * kPi;
            const bool has_axis = one_sided || light.kind() == "photometric";
            LuminairePlace& place =
                all.emplace_back(LuminairePlace{.kind = std::string(light.kind()),
                                                .file = light.file().filename().string(),
                                                .place = V3d(lamp.box.center()) + scene.origin(),
                                                .axis = has_axis ? V3d(lamp.axis) : V3d(0),
                                                .flux = light.power() * double{lamp.power},
                                                .size = V3d(lamp.box.size()),
                                                .aim = {},
                                                .light = i});
            if (has_axis) place.aim = aim_of(scene, lamp);
        }
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

void place_sensors(std::span<const CalculationSurface> surfaces, Job& job) {
    Receivers& receivers = job.receivers;
    for (const CalculationSurface& surface : surfaces) {
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x)
                receivers.points.push_back(placed(surface.receiver(x, y), job.scene));
        }
    }
    const auto points = static_cast<std::int64_t>(receivers.points.size());
    receivers.sensors =
        kLeastSensors * static_cast<int>(std::max<std::int64_t>(1, kLeastPixels / kLeastSensors / points));
    FilmSettings film;
    film.width = kWidth;
    film.height = static_cast<int>((points * receivers.sensors + kWidth - 1) / kWidth);
    film.parts = true;
    job.film = film;
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
    const bool counts = options.most_samples > 0;
    PathRounds rounds(
        job, Quantity::illuminance,
        counts ? options.most_samples : std::max(kFirstOfSensor, kFirstOfPoint / report.sensors),
        options.seed, options.workers, options.seconds);
    std::optional<LightPathRounds> light_paths;
    if (job.film.chance) light_paths.emplace(surfaces, job, options, clock, monitor);
    if (light_paths) rounds.end_at(kFirstShare * options.seconds);
    std::optional<std::vector<bool>> cut_off;  // points of all surfaces
    double path_seconds = 0;
    for (;;) {
        const Stopwatch watch;
        const RenderResult result = rounds.render(monitor);
        path_seconds += watch.seconds();
        if (result.report.samples_done == 0) throw Stopped("ended before every point had a sample");
        Readings readings = points.read(result, report.groups);
        if (!cut_off) cut_off = cut_off_from(readings.surfaces, job, options.seed, options.workers);
        leave_out(*cut_off, readings.surfaces);
        if (light_paths) readings = light_paths->completed(readings);
        const double scatter = worst_scatter_of(readings, options.indirect);
        const double light = worst_light_of(readings, options.indirect);
        report.surfaces = std::move(readings.surfaces);
        report.precision = worst_of(report.surfaces);
        const int before = std::exchange(report.samples, result.report.samples_done);
        report.rays = job.scene.rays();
        // Paths from the points may add this much to an interval that they share with light paths.
        const double limit =
            light_paths ? options.precision * std::sqrt(1 - sqr(LightPathRounds::kShare)) : options.precision;
        const double left = options.seconds - clock.seconds();
        const bool is_late = left < kLeastLeft * options.seconds ||
                             (report.samples < job.spp && (!light_paths || report.samples == before));
        report.ended_by =
            !result.report.complete                                    ? "user"
            : is_late                                                  ? "time"
            : counts                                                   ? "samples"
            : std::max(report.precision, scatter) <= options.precision ? "precision"
            : scatter <= limit && light_paths &&
                    (light_paths->are_over() || light <= LightPathRounds::kShare * options.precision)
                ? "light paths"
                : "";
        if (report.ended_by.empty() &&
            !rounds.is_worth_going_on(report.precision, options.precision, monitor))
            report.ended_by = "forecast";
        if (!report.ended_by.empty()) break;
        rounds.grow(scatter / (kAim * limit), kNoEndOfSamples);
        if (light_paths && std::isfinite(left))
            rounds.end_at(path_seconds + left * (1 - LightPathRounds::share_of_light(light, scatter)));
    }
    if (light_paths && !light_paths->have_run()) warn_without_light_paths(monitor);
    warn_of_blurred_light(report.surfaces, options.precision, report.unit, monitor);
    report.seconds = clock.seconds();
    return report;
}

}  // namespace lucerna
