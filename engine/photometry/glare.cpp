#include "engine/photometry/glare.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "engine/scene/quantity.h"
#include "engine/transport/direct_light.h"

namespace lucerna {
namespace {

constexpr double kFwhmOverSigma = 2.3548200450309493;

// What an eye sees of all lamps along a direction, luminance.
double lamps_seen(const Scene& scene, const V3f& eye, const V3f& w) {
    const Ray ray{eye, w};
    return double{luminance(emission(scene, ray, scene.intersect(ray), EmissionRule::all()))};
}

// Batches of one luminaire's samples, whose means are nearly normal.
constexpr int kBatches = 32;
// Where their random numbers begin, beyond those of all heads that measure the background.
constexpr std::uint64_t kLuminaires = std::uint64_t{1} << 62;
// Sums over the samples of one, of what directions towards the luminaire bring, each over its density.
struct LuminaireSums {
    double solid_angle = 0;
    double flux = 0;  // L dω: illuminance without its cosine
    double flux_over_p = 0, flux_over_p2 = 0;
    double square = 0;  // L² dω / p², of filtered luminance
};

class Eye {
  public:
    Eye(const Scene& scene, const Observer& observer, const GlareOptions& options)
        : scene_(scene), observer_(observer), options_(options), at_(V3f(observer.eye - scene.origin())) {}

    std::vector<GlareSource> sources() const {
        std::vector<GlareSource> all;
        for (std::uint32_t light = 0; light < scene_.lights().size(); ++light) {
            const Light& lamp = *scene_.lights()[light];
            if (!(lamp.power() > 0) || !lamp.bounds()) continue;  // the sky is no luminaire
            const auto source = lamp.is_delta() ? look_at_point(light, lamp) : look_at(light, lamp);
            if (source) all.push_back(*source);
        }
        return all;
    }

  private:
    std::optional<GlareSource> look_at(std::uint32_t light, const Light& lamp) const {
        std::array<LuminaireSums, kBatches> sums;
        const int in_a_batch = std::max(1, options_.samples / kBatches);
        parallel_each(options_.workers, kBatches, 1, [&](std::size_t batch) {
            for (int i = 0; i < in_a_batch; ++i) {
                Sampler sampler = Sampler::stratified(options_.seed, Purpose::receiver,
                                                      kLuminaires + (std::uint64_t{light} << 8) + batch,
                                                      static_cast<std::uint32_t>(i));
                add(lamp, sampler, sums[batch]);
            }
        });
        const auto per_sample = [&](double LuminaireSums::*sum) {
            RunningStats batches;
            for (const LuminaireSums& of : sums) batches.add(of.*sum / in_a_batch);
            return reading_95(batches);
        };
        const double flux = per_sample(&LuminaireSums::flux).value;
        if (!(flux > 0)) return std::nullopt;
        GlareSource source;
        source.light = light;
        source.kind = std::string(lamp.kind());
        source.solid_angle = per_sample(&LuminaireSums::solid_angle).value;
        source.luminance = flux / source.solid_angle;
        source.position = flux / per_sample(&LuminaireSums::flux_over_p).value;
        const Reading95 even = per_sample(&LuminaireSums::flux_over_p2);
        source.even = {source.luminance * even.value, source.luminance * even.half_width};
        source.seen = per_sample(&LuminaireSums::square);
        return source;
    }

    // A far field with the luminous opening that its file states, evenly bright: as CIE 117 has all
    // luminaires.
    std::optional<GlareSource> look_at_point(std::uint32_t light, const Light& lamp) const {
        const auto towards = lamp.sample_Li(at_, {0.5F, 0.5F});
        if (!towards) return std::nullopt;
        const double flux = double{luminance(towards->weight)};  // I / d²
        const double p = position_index(observer_, towards->w);
        const auto area = lamp.projected_opening(-towards->w);
        if (!(flux > 0) || !area || !std::isfinite(p)) return std::nullopt;
        if (scene_.closest_hit(Ray{at_, towards->w, towards->distance})) return std::nullopt;
        GlareSource source;
        source.light = light;
        source.kind = std::string(lamp.kind());
        source.solid_angle = *area / sqr(double{towards->distance});  // both > 0
        source.luminance = flux / source.solid_angle;
        source.position = p;
        source.even = source.seen = {source.luminance * flux / (p * p), 0};
        return source;
    }

    void add(const Light& lamp, Sampler& sampler, LuminaireSums& sums) const {
        const auto towards = lamp.sample_Li(at_, sampler.next2());
        const V2f u_blur = sampler.next2();
        if (!towards || !(towards->pdf_w > 0)) return;  // a density is divided by: that of what was drawn
        const double p = position_index(observer_, towards->w);
        if (!std::isfinite(p)) return;
        if (scene_.closest_hit(Ray{at_, towards->w, towards->distance})) return;
        const double solid_angle = 1 / double{towards->pdf_w};
        const double flux = double{luminance(towards->weight)};
        if (!(flux > 0)) return;
        const double again =
            options_.blur > 0 ? lamps_seen(scene_, at_, blurred(*towards, u_blur)) : flux / solid_angle;
        sums.solid_angle += solid_angle;
        sums.flux += flux;
        sums.flux_over_p += flux / p;
        sums.flux_over_p2 += flux / (p * p);
        sums.square += flux * again / (p * p);
    }

    // Another direction, normally distributed around the first with twice the filter's variance.
    V3f blurred(const LightSample& towards, const V2f& u) const {
        const double sigma = std::sqrt(2.0) * options_.blur / kFwhmOverSigma / double{towards.distance};
        const double r = sigma * std::sqrt(-2 * std::log1p(-double{u.x})), phi = 2 * kPiD * double{u.y};
        const V3f local(V3d(r * std::cos(phi), r * std::sin(phi), 1));
        return Frame(towards.w).to_world(local).normalized();
    }

    const Scene& scene_;
    const Observer& observer_;
    const GlareOptions& options_;
    V3f at_;
};

Reading95 rating(const std::vector<GlareSource>& sources, Reading95 GlareSource::*term,
                 const Reading95& background) {
    double sum = 0, square = 0;
    for (const GlareSource& source : sources) {
        sum += (source.*term).value;
        square += sqr((source.*term).half_width);
    }
    if (!(sum > 0)) return {-INFINITY, 0};
    // Without any background it is infinite; the division is as the formula has it.
    const double relative = std::hypot(std::sqrt(square) / sum, background.half_width / background.value);
    return {8 * std::log10(0.25 / background.value * sum), 8 / std::numbers::ln10 * relative};
}

void check(const Observer& observer) {
    if (!(observer.view.cross(observer.up).length() > 1e-3F)) {
        throw InputError(
            {observer.name},
            "looks straight up or down, where UGR is not defined; use a line of sight that is not vertical");
    }
}

}  // namespace

std::vector<GlareReport> glare_at(std::span<const Observer> observers, Job job, const GlareOptions& options,
                                  Monitor& monitor) {
    const Stopwatch clock;
    if (scene_unit(job.scene) != FluxUnit::lumen) {
        throw InputError(
            "the lights of the scene are not all in lm, and glare is computed from luminance; state Option "
            "\"string unit\" \"photometric\" in the scene, or use --unit photometric");
    }
    std::vector<CalculationSurface> eyes;
    for (const Observer& observer : observers) {
        check(observer);
        const Frame frame(observer.view);
        CalculationSurface& eye = eyes.emplace_back();
        constexpr double kTiny = 1e-4;  // m: a point
        eye.name = observer.name;
        eye.u = kTiny * V3d(frame.s);
        eye.v = kTiny * V3d(frame.t);
        eye.corner = observer.eye - 0.5 * (eye.u + eye.v);
        eye.normal = eye.up = observer.view;
        eye.points = {1, 1};
    }
    std::size_t without_extent = 0;
    for (const auto& light : job.scene.lights())
        without_extent += light->power() > 0 && light->bounds() && light->is_delta() &&
                          !light->projected_opening({0, 0, 1});
    if (without_extent > 0) {
        monitor.warn(
            fmt::format("{} of the scene's lights {} no extent, and so no luminance; not rated, though part "
                        "of E_v and of the light that the room reflects",
                        without_extent, without_extent == 1 ? "has" : "have"));
    }
    std::vector<GlareReport> reports;
    for (const Observer& observer : observers) {
        GlareReport& report = reports.emplace_back();
        report.observer = observer;
        report.sources = Eye(job.scene, observer, options).sources();
    }
    const bool daylight = has_daylight(job.scene);
    const IntegratorSettings integrator = job.integrator;
    for (std::size_t i = 0; (daylight || options.view) && i < observers.size(); ++i) {
        DaylightOptions how;
        how.seed = options.seed;
        how.workers = options.workers;
        how.threshold = options.threshold;
        how.pixels = options.view_pixels;
        how.precision = 0.25 * options.precision;
        // Half of the time for all views, as much for each of those left; the other half for illuminance.
        how.seconds = (0.5 * options.seconds - clock.seconds()) / static_cast<double>(observers.size() - i);
        job.integrator = integrator;
        const LuminanceView view = luminance_view(observers[i], job, how, monitor);
        if (options.view) options.view(i, view);
        if (daylight) reports[i].daylight = daylight_glare(view, observers[i], job.scene, options.threshold);
    }
    job.integrator = integrator;
    IlluminanceOptions how;
    how.seed = options.seed;
    how.workers = options.workers;
    how.seconds = options.seconds - clock.seconds();
    how.precision = options.precision;
    const IlluminanceReport illuminance = illuminance_on(eyes, std::move(job), how, monitor);
    for (std::size_t i = 0; i < reports.size(); ++i) {
        GlareReport& report = reports[i];
        const PointParts& at_eye = illuminance.surfaces[i].points[0];
        report.vertical = at_eye.all;
        report.background = {at_eye.indirect.value / kPiD, at_eye.indirect.half_width / kPiD};
        report.ugr_even = rating(report.sources, &GlareSource::even, report.background);
        report.ugr = rating(report.sources, &GlareSource::seen, report.background);
        if (report.daylight) report.daylight->dgp = daylight_rating(*report.daylight, report.vertical);
    }
    return reports;
}

}  // namespace lucerna
